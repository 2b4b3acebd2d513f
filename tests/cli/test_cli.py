"""The command line: what each command prints and writes, and what it says to bad input."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from conftest import DATA, PANDA
from helpers import urdf_text
from helpers.command_line import run_linkwise
from linkwise import Options
from linkwise.check.compare import Result

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def linkwise(tmp_path: Path) -> Run:
    return partial(run_linkwise, folder=tmp_path)


@pytest.fixture
def planar2(linkwise: Run, tmp_path: Path) -> Path:
    done = linkwise("generate", "planar2", "--out", "out", "--backend", "numpy")
    assert done.returncode == 0, done.stderr
    return tmp_path / "out/planar2"


def test_generate_says_what_it_wrote_in_plain_lines(linkwise: Run, tmp_path: Path) -> None:
    done = linkwise("generate", "planar2", "--out", "out", "--name", "arm", "--backend", "c", "--verbose")
    assert done.returncode == 0
    files = [path for path in (tmp_path / "out/arm").rglob("*") if path.is_file()]
    assert done.stdout == f"wrote out/arm: 2 joints, 2 links, {len(files)} files\n"
    assert done.stderr == ""


def test_generate_leaves_a_foreign_directory_alone(linkwise: Run, tmp_path: Path) -> None:
    foreign = tmp_path / "out/planar2"
    (foreign / "src").mkdir(parents=True)
    (foreign / "manifest.json").write_text('{"name": "an extension"}')
    (foreign / "src/precious.js").write_text("precious")
    done = linkwise("generate", "planar2", "--out", "out", "--backend", "c")
    assert done.returncode == 2
    assert done.stderr.startswith("linkwise: error: out/planar2 exists and is not a generated package")
    assert (foreign / "src/precious.js").read_text() == "precious"


def test_generate_leaves_the_package_of_another_robot_alone(linkwise: Run, planar2: Path) -> None:
    done = linkwise("generate", "planar4", "--out", "out", "--name", "planar2", "--backend", "c")
    assert done.returncode == 2
    assert "holds the package of another robot, 'planar2'" in done.stderr


@pytest.mark.parametrize(
    "arguments", [["generate", "planar3"], ["frobnicate"], ["check", "x", "--samples", "0"]]
)
def test_a_mistaken_option_is_one_line(linkwise: Run, arguments: list[str]) -> None:
    done = linkwise(*arguments)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1


def test_generate_replaces_an_earlier_package_whole(linkwise: Run, planar2: Path) -> None:
    assert (planar2 / "forms").is_dir()
    linkwise("generate", "planar2", "--out", "out", "--backend", "c")
    assert not (planar2 / "forms").exists()


def test_manifest_tells_how_to_make_the_package_again(planar2: Path) -> None:
    manifest = json.loads((planar2 / "manifest.json").read_text())
    assert manifest["schema"] == 15
    asked = {"robot": "planar2", "backends": ["numpy"], "kernel": "auto", "derivation": "rule"}
    assert manifest["request"] == asked | {"vendor_runtime": False} | Options().request()
    assert manifest["kernel"] == "straight"
    assert [joint["name"] for joint in manifest["joints"]] == ["joint1", "joint2"]
    assert manifest["links"][1]["path"] == [0, 1]
    written = {p.relative_to(planar2).as_posix() for p in planar2.rglob("*") if p.is_file()}
    assert set(manifest["files"]) == written - {"manifest.json"}


def test_closed_forms_are_derived_from_energies_where_asked(linkwise: Run, tmp_path: Path) -> None:
    asked = ("generate", "planar2", "--out", "out", "--backend", "numpy", "--derivation", "energy")
    assert linkwise(*asked).returncode == 0
    assert (
        json.loads((tmp_path / "out/planar2/manifest.json").read_text())["request"]["derivation"] == "energy"
    )
    done = linkwise(*asked, "--kernel", "loops")
    assert done.returncode == 2
    assert "--kernel loops derives nothing, and --derivation energy does; leave one out" in done.stderr


def test_check_prints_the_largest_error_of_each(linkwise: Run, planar2: Path) -> None:
    done = linkwise("check", planar2, "--samples", 5)
    assert done.returncode == 0
    assert "ok    numpy: tau_ij against Newton-Euler recursion" in done.stdout
    assert "largest relative error" in done.stdout
    results = json.loads(linkwise("check", planar2, "--samples", 5, "--json").stdout)
    assert all(result["held"] for result in results)
    *_, last = done.stdout.splitlines()
    assert last == f"{len(results)} checks held, 0 failed, 0 could not be made here"
    assert {"name", "held", "error", "detail", "mark"} == set(results[0])


@pytest.mark.parametrize("backend", ["numpy", "torch", "autograd", "native"])
def test_a_package_of_one_back_end_passes_its_check(backend: str, linkwise: Run) -> None:
    assert linkwise("generate", "planar1", "--out", "out", "--backend", backend).returncode == 0
    done = linkwise("check", "out/planar1", "--samples", "1")
    assert (done.returncode, "FAIL" in done.stdout) == (0, False), done.stdout


def test_check_tells_each_result_before_it_makes_the_next(
    linkwise: Run, planar2: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[bytes] = []

    def results(package: Path, samples: int) -> Iterator[Result]:
        for name in ("first", "second"):
            yield Result(name, True, None, "")
            seen.append(sys.stdout.buffer.getvalue())  # type: ignore[attr-defined]

    monkeypatch.setattr("linkwise.cli.check.results_of", results)
    linkwise("check", planar2)
    assert [text.split()[1::2] for text in seen] == [[b"first"], [b"first", b"second"]]


def test_check_catches_a_tampered_file(linkwise: Run, planar2: Path) -> None:
    (planar2 / "forms/link_2.py").write_text("# mine now\n")
    (planar2 / "names.py").unlink()
    done = linkwise("check", planar2)
    assert done.returncode == 1
    assert "FAIL  hashes" in done.stdout
    assert "forms/link_2.py was changed; names.py is missing" in done.stdout


def test_check_catches_wrong_numbers_under_a_right_hash(linkwise: Run, planar2: Path) -> None:
    import hashlib

    path = planar2 / "forms/link_1.py"
    path.write_text(path.read_text().replace("0.5", "0.6").replace("0.0", "0.1"))
    manifest = json.loads((planar2 / "manifest.json").read_text())
    manifest["files"]["forms/link_1.py"] = hashlib.sha256(path.read_bytes()).hexdigest()
    (planar2 / "manifest.json").write_text(json.dumps(manifest))
    done = linkwise("check", planar2, "--samples", 5)
    assert done.returncode == 1
    assert "FAIL  numpy: tau_ij against Newton-Euler recursion" in done.stdout


def test_inspect_names_what_was_merged_locked_and_ignored(linkwise: Run) -> None:
    done = linkwise(
        "inspect", PANDA, "--lock", "panda_finger_joint1=0.01", "--lock", "panda_finger_joint2=0", "--json"
    )
    assert done.returncode == 0, done.stderr
    data = json.loads(done.stdout)
    assert [joint["name"] for joint in data["joints"]] == [f"panda_joint{k}" for k in range(1, 8)]
    notes = {(note["kind"], note["subject"]) for note in data["notes"]}
    assert ("locked", "panda_finger_joint1") in notes
    assert ("merged", "panda_hand") in notes
    assert ("ignored", "visual") in notes


def test_inspect_prints_a_page_first_and_all_on_request(linkwise: Run) -> None:
    page = linkwise("inspect", "planar40").stdout.splitlines()
    assert page[:2] == ["planar40: 40 joints, 40 links, 24 kg that move", "base: fixed; on the ground: base"]
    assert page[2] == "gravity: (0, -9.80665, 0) m/s²"
    assert len(page) <= 40
    assert max(map(len, page)) <= 110
    assert "  3  link3  (0.6 kg; joint1, joint2, joint3)" in page
    assert page.count("  and 32 more") == 2
    assert page[-1] == "--details shows all"
    whole = linkwise("inspect", "planar40", "--details").stdout.splitlines()
    assert "  40  joint40 [rad]" in whole
    assert any(line.startswith("  m_40 = 0.6") for line in whole)


def test_inspect_tells_gravity_that_loads_no_joint_and_angles_that_look_like_degrees(
    linkwise: Run, tmp_path: Path
) -> None:
    gravity = "gravity: (0, 0, -9.81) m/s²"
    for kind, told in (("revolute", f"{gravity}, which loads no joint"), ("prismatic", gravity)):
        (tmp_path / f"{kind}.toml").write_text(arm(type=f'"{kind}"'))
        assert told in linkwise("inspect", tmp_path / f"{kind}.toml").stdout.splitlines()
    (tmp_path / "turned.toml").write_text(arm() + "rpy = [0, 0, 90]\nlower = -180\nupper = 3.1\n")
    assert (
        "doubtful: joint 'hinge', range of 'hinge'; angles that look like degrees, taken as radians"
        in linkwise("inspect", tmp_path / "turned.toml").stdout.splitlines()
    )


def arm(**changes: str) -> str:
    """A TOML arm of one link with keys replaced."""
    link = {"name": '"rod"', "mass": "1.0", "inertia": "{ xx = 0.1, yy = 0.1, zz = 0.1 }"}
    joint = {"name": '"hinge"', "parent": '"base"', "child": '"rod"', "axis": "[0, 0, 1]"}
    for key, value in changes.items():
        (joint if key in ("axis", "parent", "child", "type", "xyz") else link)[key] = value
    tables = (("link", link), ("joint", joint))
    return "schema = 1\n" + "".join(
        f"[[{name}]]\n" + "".join(f"{key} = {value}\n" for key, value in table.items())
        for name, table in tables
    )


SECOND = '[[joint]]\nname = "{name}"\nparent = "{parent}"\nchild = "{child}"\n'
BAD_FILES = {
    "malformed.toml": ("schema = = 1", "malformed TOML"),
    "binary.toml": ("\x00\x01", "malformed TOML"),
    "unschemed.toml": ('name = "arm"', "write schema = 1 at the top"),
    "massless.toml": (arm(mass="0", inertia="{}"), "massless.toml: no link has mass, so no torque is to be"),
    "negative.toml": (arm(mass="-2"), "link 'rod' has negative mass -2 kg"),
    "triangle.toml": (
        arm(inertia="{ xx = 0.1, yy = 0.1, zz = 0.3 }"),
        "link 'rod' has an inertia that breaks the triangle inequality",
    ),
    "indefinite.toml": (
        arm(inertia="{ xx = 0.1, yy = 0.1, zz = 0.1, xy = 0.2 }"),
        "link 'rod' has an inertia that is not positive",
    ),
    "axis.toml": (arm(axis="[0, 0, 0]"), "joint 'hinge' has a zero axis"),
    "nan.toml": (arm(mass="nan"), "link 'rod' has NaN or infinity"),
    "infinity.toml": (arm(xyz="[inf, 0, 0]"), "joint 'hinge' has NaN or infinity in its origin"),
    "type.toml": (arm(type='"spherical"'), "joint 'hinge' has the unknown type 'spherical'"),
    "parent.toml": (arm(parent='"moon"'), "joint 'hinge' has the parent 'moon', which is not a link"),
    "key.toml": (arm(weight="3"), "link 'rod' has the unknown key 'weight'"),
    "empty.toml": (arm(name='""', child='""'), "a link has an empty name"),
    "loop.toml": (
        arm(parent='"rod"') + SECOND.format(name="other", parent="base", child="base"),
        "loop",
    ),
    "two_parents.toml": (
        arm() + SECOND.format(name="other", parent="base", child="rod"),
        "link 'rod' has 2 parents",
    ),
    "duplicate.toml": (
        arm() + '[[link]]\nname = "rod"\n',
        "2 links are named 'rod'",
    ),
    "same_joint.toml": (
        arm() + '[[link]]\nname = "tip"\n' + SECOND.format(name="hinge", parent="rod", child="tip"),
        "2 joints are named 'hinge'",
    ),
    "code.toml": (arm(mass="\"__import__('os').getcwd()\""), "is not a formula"),
    "name.toml": (arm(mass='"m"'), "uses 'm', which is not among the parameters"),
    "still.toml": (arm(type='"fixed"'), "no joint moves"),
    "malformed.urdf": ("<robot><link", "malformed XML"),
    "entities.urdf": (
        '<!DOCTYPE robot [<!ENTITY a "aaaa">]><robot name="&a;"/>',
        "malformed XML",
    ),
    "root.urdf": ("<model/>", "the root element is <model>"),
    "childless.urdf": (
        '<robot name="r"><link name="a"/><joint name="j" type="revolute"><parent link="a"/></joint></robot>',
        "joint 'j' has no <child",
    ),
    "word.urdf": (
        '<robot name="r"><link name="a"><inertial><mass value="heavy"/></inertial></link></robot>',
        "link 'a': <mass value='heavy'> needs 1 number",
    ),
    "steep.py": (
        "from linkwise import *\nx = Coordinate('x')\ncoordinates = [x]\n"
        "links = [LinkEnergy('a', x.qd**13, 0)]\n",
        "link 'a': its kinetic energy has degree 13 in the velocities",
    ),
    "crash.py": ("1 / 0", "running the file failed in line 1: ZeroDivisionError"),
    "nothing.py": ("", "the file must define 'links', a list of linkwise.LinkEnergy"),
    "picture.png": ("", "unknown kind of file '.png'"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_file_is_one_line_that_names_the_remedy(name: str, linkwise: Run, tmp_path: Path) -> None:
    text, message = BAD_FILES[name]
    (tmp_path / name).write_text(text, encoding="utf-8")
    done = linkwise("generate", name, "--out", "out")
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.startswith(f"linkwise: error: {name}: ")
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
    assert not (tmp_path / "out").exists()


BAD_ARGUMENTS = {
    "unknown robot": (("planarx",), "planarx: no such file or built-in robot"),
    "unknown file": (("arm.toml",), "arm.toml: no such file or built-in robot"),
    "lock without value": (("planar2", "--lock", "joint1"), "is not of the form JOINT=VALUE"),
    "lock at nan": (("planar2", "--lock", "joint1=nan"), "is not of the form JOINT=VALUE"),
    "lock of no joint": (("planar2", "--lock", "elbow=0"), "--lock 'elbow' is not a moving joint"),
    "back end": (("planar2", "--backend", "fortran"), "no back end 'fortran'; choose among numpy"),
    "name": (("planar2", "--name", "../arm"), "as it has '.' at place 1; use up to 60 letters a-z and A-Z"),
    "long name": (
        ("planar2", "--name", "a" * 61),
        "is not a usable module name, as it has 61 characters; use",
    ),
    "empty name": (("planar2", "--name", ""), "'' is not a usable module name, as it is empty; use up to 60"),
    "digit": (("planar2", "--name", "7dof"), "as it begins with the digit '7'; use up to 60 letters"),
    "header of a link": (("planar2", "--name", "Link_1"), "or the name of a module or of a header of C; use"),
    "header of every robot": (("planar2", "--name", "Tree"), "or the name of a module or of a header of C"),
    "underscore": (("planar2", "--name", "_arm"), "as it begins or ends with '_'; use up to 60 letters"),
    "keyword": (
        ("planar2", "--name", "class"),
        "'class' is not a usable module name, as it is a word of Python's, or the name of a module",
    ),
    "parameters": (
        ("planar2", "--parameters", "some"),
        "'some' is not one of 'numeric', 'nonzero', 'symbolic'",
    ),
    "base": (("planar2", "--base", "moving"), "'moving' is not one of 'fixed', 'floating'"),
    "tip": (("planar2", "--tip", "hand"), "--tip 'hand' is not a link"),
}


@pytest.mark.parametrize("case", BAD_ARGUMENTS)
def test_bad_argument_is_one_line_that_names_the_remedy(case: str, linkwise: Run, tmp_path: Path) -> None:
    arguments, message = BAD_ARGUMENTS[case]
    done = linkwise("generate", *arguments, "--out", "out")
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_unphysical_body_passes_on_request(linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "negative.toml").write_text(arm(mass="-2"))
    arguments = ("generate", "negative.toml", "--out", "out", "--backend", "numpy", "--allow-unphysical")
    assert linkwise(*arguments).returncode == 0


def test_generate_never_replaces_what_is_not_a_package(linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "out/planar2").mkdir(parents=True)
    (tmp_path / "out/planar2/thesis.txt").write_text("mine")
    done = linkwise("generate", "planar2", "--out", "out", "--backend", "c")
    assert done.returncode == 2
    assert "exists and is not a generated package" in done.stderr
    assert (tmp_path / "out/planar2/thesis.txt").read_text() == "mine"


@pytest.mark.parametrize(
    "name", ["thesis.txt", "__pycache__/notes.txt", "forms/link_9.py", "c/__pycache__/a.cpython-311.pyc"]
)
def test_generate_never_replaces_what_was_added_to_a_package(
    name: str, linkwise: Run, tmp_path: Path
) -> None:
    arguments = ("generate", "planar2", "--out", "out", "--backend", "numpy")
    assert linkwise(*arguments).returncode == 0
    own = tmp_path / "out/planar2" / name
    own.parent.mkdir(parents=True, exist_ok=True)
    own.write_text("mine")
    done = linkwise(*arguments)
    assert done.returncode == 2
    assert f"out/planar2 holds '{name}', which linkwise did not write; move it away" in done.stderr
    assert own.read_text() == "mine"


def test_a_refused_generate_brings_back_what_a_dead_writer_took_away(
    linkwise: Run, planar2: Path, tmp_path: Path
) -> None:
    dead = tmp_path / "out/.linkwise-abcdefgh"
    (dead / "old").mkdir(parents=True)
    (dead / "lock").touch()
    planar2.rename(dead / "old/planar2")
    assert linkwise("generate", "planarx", "--out", "out").returncode == 2
    assert os.listdir(tmp_path / "out") == ["planar2"]


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("file", "file is not a folder; choose another --out or --name"),
        ("link", "link is a symbolic link; choose another --out or --name"),
        ("file/deeper", "file: nothing was written: it is not a folder; choose another place"),
        ("file/deeper/still", "file: nothing was written: it is not a folder; choose another place"),
    ],
)
def test_what_blocks_the_target_is_named(target: str, message: str, linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "link").symlink_to("elsewhere")
    out, name = ("./" + target).rsplit("/", 1)
    done = linkwise("generate", "planar2", "--out", out, "--name", name, "--backend", "c")
    assert (done.returncode, done.stderr) == (2, f"linkwise: error: {message}\n")
    assert sorted(os.listdir(tmp_path)) == ["elsewhere", "file", "link"]


def test_check_of_a_folder_without_a_package_says_so(linkwise: Run, tmp_path: Path) -> None:
    done = linkwise("check", tmp_path)
    assert done.returncode == 2
    assert "no manifest.json" in done.stderr


def test_energies_take_no_lock(linkwise: Run) -> None:
    done = linkwise("inspect", DATA / "turntable.py", "--lock", "x=0")
    assert done.returncode == 2
    assert "energies in Python do not accept --lock" in done.stderr


def test_energies_take_no_option_of_rigid_bodies(linkwise: Run) -> None:
    given = ("--lock", "x=0", "--base", "floating", "--root", "a", "--tip", "b", "--allow-unphysical")
    done = linkwise("inspect", DATA / "turntable.py", *given, "--free-mimic")
    assert done.returncode == 2
    named = "not accept --lock, --base, --root, --tip, --allow-unphysical, --free-mimic; change the energies"
    assert named in done.stderr


ENERGIES = """import sympy as sp
from linkwise import Coordinate, LinkEnergy, energy_system

x = Coordinate("x", "m")
k, b, F, t = sp.symbols("k b F t")
_links = [
    LinkEnergy("cart", x.qd**2, {"spring": k * x.q**2}, {"damper": b * x.qd**2}, {"push": {x: F * t}}),
    LinkEnergy("wall", 0, {"spring": 3 * x.q**2}),
]
system = energy_system("cart", [x], _links, {k: 40.0, b: 0.8}, time=t, inputs=[F])
"""


def test_inspect_shows_energies_with_numbers_unless_symbols_are_asked_for(
    linkwise: Run, tmp_path: Path
) -> None:
    (tmp_path / "cart.py").write_text(ENERGIES)
    data = json.loads(linkwise("inspect", "cart.py", "--json").stdout)
    assert data["shares"] == [
        {"name": "spring", "kinds": ["potential"], "links": ["cart", "wall"]},
        {"name": "damper", "kinds": ["dissipation"], "links": ["cart"]},
        {"name": "push", "kinds": ["force"], "links": ["cart"]},
    ]
    assert (data["time"], data["inputs"]) == ("t", ["F"])
    for details in ((), ("--details",)):
        told = linkwise("inspect", "cart.py", *details).stdout
        assert "  spring  (potential of cart, wall)\n  damper  (dissipation of cart)\n" in told
        assert "given at run time (robot.at): time: t; inputs: F\n" in told
    refused = linkwise("inspect", "cart.py", "--parameters", "symbolic")
    assert refused.returncode == 2
    assert "cart.py: line 10: `system` is made with numbers; give symbolic=True there" in refused.stderr


def test_analyze_names_the_file_of_energies_that_it_cannot_take(linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "cart.py").write_text(ENERGIES)
    (tmp_path / "log.csv").write_text("time,x\n0,0\n")
    done = linkwise("analyze", "log.csv", "--robot", "cart.py", "--out", "out", "--backend", "native")
    assert done.stderr.splitlines()[-1].startswith("linkwise: error: cart.py: its torques depend on ")


HAND = """<mujoco><worldbody><body name="palm"><joint name="a" axis="0 0 1" armature="0.1" damping="0.2"/>
<geom size="0.1"/><body name="finger"><joint name="b" axis="0 1 0" stiffness="3"/><geom size="0.1"/></body>
<body name="thumb"><joint name="c" axis="0 1 0" damping="0.3"/><geom size="0.1"/></body></body></worldbody>
<tendon><fixed name="t" stiffness="4"><joint joint="a" coef="1"/></fixed></tendon>
<equality><joint joint1="b" joint2="c"/></equality><actuator><motor joint="a"/></actuator></mujoco>"""


APART = "apart from the links' torques, by passive_torque"


def test_generate_says_what_the_torques_leave_out_and_what_stands_apart_from_them(
    linkwise: Run, tmp_path: Path
) -> None:
    pytest.importorskip("mujoco")
    (tmp_path / "hand.xml").write_text(HAND)
    done = linkwise("generate", "hand.xml", "--out", "out", "--backend", "c", "--free-mimic")
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stderr.splitlines() if line.startswith("warning")] == [
        "warning: hand.xml: moving by themselves, their coupling left out of the torques: "
        "b (coupled to 'c' by an equality)",
        f"warning: hand.xml: spring {APART}: b (3 N·m/rad)",
        f"warning: hand.xml: damping {APART}: a (0.2 N·m·s/rad), c (0.3 N·m·s/rad)",
        f"warning: hand.xml: armature {APART}: a (0.1 kg·m²)",
        "warning: hand.xml: tendon spring left out of the torques: t (4)",
    ]
    asked = linkwise("generate", "hand.xml", "--out", "out", "--backend", "c", "--free-mimic", "--details")
    assert f"damping {APART}: a (0.2 N·m·s/rad)\n" in asked.stderr
    assert f"damping {APART}: c (0.3 N·m·s/rad)\n" in asked.stderr


def test_generate_warns_of_a_floating_base_and_of_bodies_that_cannot_be(
    linkwise: Run, tmp_path: Path
) -> None:
    (tmp_path / "negative.toml").write_text(arm(mass="-2"))
    flags = ("--backend", "c", "--allow-unphysical", "--base", "floating")
    done = linkwise("generate", "negative.toml", "--out", "out", *flags)
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stderr.splitlines() if line.startswith("warning")] == [
        "warning: negative.toml: accepted though physically impossible: "
        "rod (negative mass -2 kg), "
        "'base_yaw', 'base_pitch', 'base_roll', 'hinge' (can move together without moving any mass)",
        "warning: negative.toml: six coordinates without any contact forces, singular at a pitch of ±90°: "
        "base (floating: x, y, z, yaw, pitch, roll)",
    ]


def test_inspect_shows_a_robot_that_generate_refuses_for_a_body_that_cannot_be(
    linkwise: Run, tmp_path: Path
) -> None:
    (tmp_path / "negative.toml").write_text(arm(mass="-2"))
    reason = "link 'rod' has negative mass -2 kg; correct it, or pass --allow-unphysical"
    refused = linkwise("generate", "negative.toml", "--out", "out")
    assert refused.returncode == 2
    assert reason in refused.stderr
    shown = linkwise("inspect", "negative.toml", "--details")
    assert shown.returncode == 0
    assert f"refused by generate: negative.toml: {reason}\n" in shown.stdout
    assert "  1  rod  (-2 kg; hinge)" in shown.stdout
    assert "\nunphysical\n  rod negative mass -2 kg" in shown.stdout
    page = linkwise("inspect", "negative.toml").stdout
    assert f"\nrefused by generate: negative.toml: {reason}\n" in page
    assert "\nunphysical: rod negative mass -2 kg; refused without --allow-unphysical" in page
    assert json.loads(linkwise("inspect", "negative.toml", "--json").stdout)["refused"].endswith(reason)
    accepted = linkwise("inspect", "negative.toml", "--allow-unphysical", "--json")
    assert json.loads(accepted.stdout)["refused"] == ""


def test_floating_arm_on_a_base_without_mass_is_refused_with_the_joints_that_it_binds(
    linkwise: Run, tmp_path: Path
) -> None:
    refused = linkwise("generate", "puma560", "--base", "floating", "--out", "out")
    assert refused.returncode == 2
    assert refused.stderr == (
        "linkwise: error: puma560: the joints 'base_yaw', 'base_pitch', 'base_roll', 'joint1' can move "
        "together without moving any mass; give link 'base' between them mass and inertia, "
        "hold one with --lock joint1=0, or pass --allow-unphysical\n"
    )
    assert not (tmp_path / "out").exists()
    held = ("--base", "floating", "--lock", "joint1=0", "--backend", "numpy")
    assert linkwise("generate", "puma560", *held, "--out", "out").returncode == 0
    assert linkwise("check", "out/puma560").returncode == 0


def test_xacro_is_told_to_be_expanded(linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf.xacro").write_text("<robot/>")
    refused = linkwise("generate", "arm.urdf.xacro", "--out", "out")
    assert refused.returncode == 2
    assert refused.stderr.endswith(
        "this is xacro, a language of macros; expand it first: xacro FILE > robot.urdf\n"
    )


def test_inspect_lists_what_each_joint_has_of_its_own_on_request(linkwise: Run, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    (tmp_path / "hand.xml").write_text(HAND)
    told = linkwise("inspect", "hand.xml", "--free-mimic").stdout
    assert f"\npassive: spring 1 ×, damping 2 ×, armature 1 ×; {APART}\n" in told
    assert "\nleft out: tendon spring 1 ×; left out of the torques\n" in told
    assert "N·m·s/rad" not in told
    asked = linkwise("inspect", "hand.xml", "--free-mimic", "--details").stdout
    assert f"  c 0.3 N·m·s/rad; damping {APART}\n" in asked


def test_inspect_lists_frames_on_request(linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(
        urdf_text.chain(urdf_text.joint("ab", "a", "b"), urdf_text.joint("bc", "b", "c", type="fixed"))
    )
    assert "frames" not in linkwise("inspect", "arm.urdf").stdout
    asked = linkwise("inspect", "arm.urdf", "--details").stdout
    assert "frames (of `kinematics`; on which link)\n  a  (the ground)\n  b  (b)\n  c  (b)\n" in asked


def test_a_package_may_have_capitals_in_its_name(linkwise: Run) -> None:
    made = linkwise("generate", "planar1", "--name", "LeftArm", "--out", "out", "--backend", "c")
    assert made.returncode == 0, made.stderr
    checked = linkwise("check", "out/LeftArm", "--samples", "3")
    assert checked.returncode == 0, checked.stdout


@pytest.mark.parametrize("report", ["terms", "reduction"])
def test_reports_read_what_generate_reads(report: str, linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "negative.toml").write_text(arm(mass="-2"))
    robot = ["negative.toml"] if report == "terms" else ["--robot", "negative.toml", "--dof", "1"]
    refused = linkwise("report", report, *robot)
    assert refused.returncode == 2
    assert "pass --allow-unphysical" in refused.stderr
    done = linkwise("report", report, *robot, "--allow-unphysical", "--parameters", "numeric", "--json")
    assert done.returncode == 0, done.stderr


def test_terms_of_a_floating_robot_are_counted(linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "negative.toml").write_text(arm(mass="-2"))
    flags = ("--base", "floating", "--allow-unphysical", "--free-mimic", "--joint", "hinge", "--json")
    done = linkwise("report", "terms", "negative.toml", *flags)
    assert done.returncode == 0, done.stderr
    (torque, *_) = json.loads(done.stdout)["torques"]
    assert torque["joint"] == 7


LOOP = """schema = 1
[[constraint]]
name = "{name}"
type = "point"
first = {{ frame = "rod", xyz = [0.31, 0, 0] }}
second = {{ frame = "rocker", xyz = [{at}, 0, 0] }}
"""


@pytest.fixture
def bars(tmp_path: Path) -> Path:
    """The four-bar without its pin."""
    tree = (DATA / "fourbar.toml").read_text().partition("[[constraint]]")[0]
    (tmp_path / "bars.toml").write_text(tree)
    return tmp_path / "bars.toml"


def test_a_file_beside_the_robots_closes_its_loop(bars: Path, linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "loop.toml").write_text(LOOP.format(name="pin", at=0.24))
    asked = ("bars.toml", "--constraints", "loop.toml", "--independent", "c")
    done = linkwise("generate", *asked, "--out", "out", "--backend", "numpy", "--verbose")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[1] == "independent: c; following by constraints: a, b"
    assert done.stderr.splitlines() == [
        "warning: bars.toml: constraints, which robot.constraints holds, beside the torques of the open "
        "tree: pin (point, pin_first and pin_second)",
    ]
    request = json.loads((tmp_path / "out/fourbar/manifest.json").read_text())["request"]
    digest = hashlib.sha256((tmp_path / "loop.toml").read_bytes()).hexdigest()
    assert request["constraints"] == {"file": "loop.toml", "sha256": digest}
    assert request["independent"] == ["c"]
    assert linkwise("check", "out/fourbar").returncode == 0
    shown = linkwise("inspect", *asked).stdout
    table = "\nconstraints (of `robot.constraints`; on what)\n  pin  (point: pin_first and pin_second)\n"
    assert table + "  independent: c\n  dependent: a, b\n" in shown
    data = json.loads(linkwise("inspect", *asked, "--json").stdout)
    assert (data["independent"], data["dependent"]) == (["c"], ["a", "b"])


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (
            ("--constraints", "far.toml"),
            "bars.toml: constraint 'pin' never closes: from 24 positions that were",
        ),
        (("--constraints", "none.toml"), "bars.toml: none.toml: no such file"),
        (
            ("--constraints", "."),
            "bars.toml: .: this is a directory; give a TOML file with [[constraint]] in it",
        ),
        (
            ("--independent", "a"),
            "bars.toml: --independent is for constraints, and here are none; leave it out",
        ),
        (("--independent", "a,,b"), "--independent has an empty name; give joints as A,B"),
    ],
)
def test_constraints_that_cannot_be_are_one_line_and_nothing_is_written(
    flags: tuple[str, str], message: str, bars: Path, linkwise: Run, tmp_path: Path
) -> None:
    (tmp_path / "far.toml").write_text(LOOP.format(name="pin", at=3))
    done = linkwise("generate", bars.name, *flags, "--out", "out", "--backend", "numpy")
    assert done.returncode == 2
    assert done.stderr.startswith(f"linkwise: error: {message}")
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()
