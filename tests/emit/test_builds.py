"""`generate` in the builds of others: what it says to make and ninja, and which times its files keep."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import pytest
from helpers import urdf_text
from helpers.command_line import run_linkwise
from helpers.needed import needs
from linkwise import LinkwiseError
from linkwise.cli.depfile import depfile_text

Run = Callable[..., subprocess.CompletedProcess[str]]
C = ("--out", "out", "--backend", "c")
HOUSE = Path(__file__).parents[2] / "generator/linkwise"


@pytest.fixture
def linkwise(tmp_path: Path) -> Run:
    return partial(run_linkwise, folder=tmp_path)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    (tmp_path / "arm.urdf").write_text(urdf_text.chain(urdf_text.joint("ab", "a", "b")))
    return tmp_path / "arm.urdf"


def times(folder: Path) -> dict[str, int]:
    return {
        path.relative_to(folder).as_posix(): path.stat().st_mtime_ns
        for path in (folder, *folder.rglob("*"))
        if "__pycache__" not in path.parts
    }


def aged(folder: Path) -> dict[str, int]:
    """Times of files and folders, set long ago."""
    for path in (*folder.rglob("*"), folder):
        os.utime(path, (1_000_000_000, 1_000_000_000))
    return times(folder)


def inputs_of(depfile: Path) -> list[str]:
    rule = depfile.read_text().replace("\\\n", "").splitlines()[0]
    return [name.replace("\0", " ") for name in rule.partition(": ")[2].replace("\\ ", "\0").split()]


def test_outputs_are_listed_and_none_is_written(linkwise: Run, tmp_path: Path) -> None:
    listed = linkwise("generate", "planar1", "planar2", *C, "--list-outputs")
    assert (listed.returncode, listed.stderr) == (0, "")
    assert not list(tmp_path.iterdir())
    assert linkwise("generate", "planar1", "planar2", *C).returncode == 0
    written = [path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()]
    assert sorted(listed.stdout.splitlines()) == sorted(written)


def test_where_nobody_watches_there_is_nothing_to_read_but_warnings(linkwise: Run, arm: Path) -> None:
    done = linkwise("generate", "planar1", "puma560", *C)
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr.startswith("warning: puma560: accepted though physically impossible")
    assert len(done.stderr.splitlines()) == 1
    told = linkwise("generate", "planar1", *C, "--verbose").stdout
    assert told.startswith("up to date: out/planar1: 1 joint, 1 link, ")


def test_a_package_of_which_nothing_differs_is_not_touched(linkwise: Run, arm: Path, tmp_path: Path) -> None:
    assert linkwise("generate", "arm.urdf", *C).returncode == 0
    before = aged(tmp_path / "out")
    arm.write_text(arm.read_text().replace("<robot", "<!-- a remark -->\n<robot", 1))
    assert linkwise("generate", "arm.urdf", *C).returncode == 0
    assert times(tmp_path / "out") == before


def test_only_files_that_differ_get_a_new_time(linkwise: Run, tmp_path: Path) -> None:
    assert linkwise("generate", "planar2", *C).returncode == 0
    package = tmp_path / "out/planar2"
    before, names = aged(package), (package / "names.py").read_text()
    (package / "names.py").write_text("# changed by hand\n")
    (package / "c/linkwise/sines.h").unlink()
    (package / "__pycache__").mkdir(exist_ok=True)
    assert linkwise("generate", "planar2", *C).returncode == 0
    after = times(package)
    files = [path for path in before if (package / path).is_file()]
    assert {path for path in files if after[path] != before[path]} == {"names.py", "c/linkwise/sines.h"}
    assert (package / "names.py").read_text() == names


def test_check_says_file_by_file_what_is_stale_and_writes_nothing(
    linkwise: Run, arm: Path, tmp_path: Path
) -> None:
    absent = linkwise("generate", "arm.urdf", *C, "--check")
    assert (absent.returncode, absent.stderr) == (1, "")
    assert absent.stdout.startswith("out/test is not there: ")
    assert not (tmp_path / "out").exists()
    assert linkwise("generate", "arm.urdf", *C).returncode == 0
    [package] = (tmp_path / "out").iterdir()
    before = aged(package)
    fresh = linkwise("generate", "arm.urdf", *C, "--check")
    assert (fresh.returncode, fresh.stdout, fresh.stderr) == (0, "", "")
    assert linkwise("generate", "arm.urdf", *C, "--check", "--verbose").stdout.endswith("is up to date\n")
    assert times(package) == before
    (package / "c/linkwise/dense.h").unlink()
    (package / "names.py").write_text("# mine\n")
    stale = linkwise("generate", "arm.urdf", "--out", "out", "--backend", "c", "--check")
    assert stale.returncode == 1
    head, *lines = stale.stdout.splitlines()
    assert head.startswith(f"out/{package.name} is stale: 2 files of ")
    assert sorted(lines) == ["  differs: names.py", "  is missing: c/linkwise/dense.h"]
    fewer = linkwise("generate", "arm.urdf", "--out", "out", "--backend", "numpy", "--check")
    head, *lines = fewer.stdout.splitlines()
    asked = linkwise("generate", "arm.urdf", "--out", "out", "--backend", "numpy", "--list-outputs")
    wanted = {package / Path(line).relative_to(f"out/{package.name}") for line in asked.stdout.splitlines()}
    gone = sorted(path for path in before if (package / path).is_file() and package / path not in wanted)
    found = re.search(r" is stale: (\d+) files of (\d+), and (\d+) that would go$", head)
    assert found
    assert int(found[1]) < int(found[2]) == len(wanted)
    assert int(found[3]) == len(gone)
    assert lines[-1] == f"  is not written any more: {', '.join(gone[:8])} and {len(gone) - 8} more"
    assert linkwise("generate", "gone.urdf", *C, "--check").returncode == 2


def test_robots_of_one_call_are_all_written_or_none(linkwise: Run, arm: Path, tmp_path: Path) -> None:
    refused = linkwise("generate", "planar1", "gone.urdf", *C)
    assert refused.returncode == 2
    assert refused.stderr.startswith("linkwise: error: gone.urdf: no such file")
    assert not (tmp_path / "out").exists()
    assert linkwise("generate", "planar1", "arm.urdf", *C).returncode == 0
    assert len(list((tmp_path / "out").iterdir())) == 2
    assert linkwise("generate", "planar1", "arm.urdf", *C, "--check").returncode == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("planar1", "planar1"),
            "planar1 and planar1 would both be out/planar1; generate one of them in its",
        ),
        (("planar1", "planar2", "--name", "arm"), "--name is for one robot; generate each with a name"),
        (
            ("planar1", "--check", "--list-outputs"),
            "--list-outputs writes nothing and stands alone; leave --check",
        ),
        (
            ("planar1", "--check", "--depfile", "d"),
            "--check writes nothing and stands alone; leave --depfile out",
        ),
        (
            ("arm.urdf", "--depfile", "arm.urdf"),
            "arm.urdf cannot be a depfile or a stamp: arm.urdf is read from",
        ),
        (
            ("planar1", "--stamp", "out/planar1/new"),
            "out/planar1/new cannot be a depfile or a stamp: planar1 is",
        ),
        (
            ("bad*name.urdf", "--depfile", "d"),
            "--depfile: 'bad*name.urdf' has '*' in it, which make and ninja",
        ),
    ],
)
def test_mistakes_are_one_line_and_nothing_is_written(
    arguments: tuple[str, ...], message: str, linkwise: Run, arm: Path, tmp_path: Path
) -> None:
    shutil.copy(arm, tmp_path / "bad*name.urdf")
    before = sorted(tmp_path.iterdir())
    done = linkwise("generate", *arguments, *C)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"linkwise: error: {message}")
    assert len(done.stderr.splitlines()) == 1
    assert sorted(tmp_path.iterdir()) == before


def test_replace_takes_the_place_of_another_robot(linkwise: Run, tmp_path: Path) -> None:
    assert linkwise("generate", "planar1", *C, "--name", "arm").returncode == 0
    refused = linkwise("generate", "planar2", *C, "--name", "arm")
    assert refused.returncode == 2
    assert "give this one a --name of its own, remove that one, or pass --replace" in refused.stderr
    assert linkwise("generate", "planar2", *C, "--name", "arm", "--replace").returncode == 0
    assert "ARM_JOINTS = 2" in (tmp_path / "out/arm/c/arm.h").read_text()


def test_empty_folders_in_the_place_of_a_package_are_nothing(linkwise: Run, tmp_path: Path) -> None:
    (tmp_path / "out/planar1/c").mkdir(parents=True)  # as ninja makes them for outputs
    assert linkwise("generate", "planar1", *C).returncode == 0
    assert linkwise("generate", "planar1", *C, "--check").returncode == 0


def test_depfile_has_the_robot_the_generator_and_its_version(
    linkwise: Run, arm: Path, tmp_path: Path
) -> None:
    done = linkwise("generate", "arm.urdf", "planar1", *C, "--depfile", "new/arm.d")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "new/arm.d").read_text()
    targets = text.splitlines()[0].removesuffix(": \\").split()
    assert len(targets) == 2
    assert all((tmp_path / target).is_file() and target.endswith("/manifest.json") for target in targets)
    inputs = inputs_of(tmp_path / "new/arm.d")
    assert inputs[0] == "arm.urdf"
    assert all((tmp_path / name).is_file() for name in inputs)
    own = {Path(name).relative_to(HOUSE.parent).as_posix() for name in inputs if f"{HOUSE.parent}/" in name}
    made_by = {"linkwise/cli/generate.py", "linkwise_runtime/dynamics.py"}
    assert made_by | {"linkwise/robot/builtin/puma560.toml"} <= own
    assert any(name.endswith("/templates/c/robot.h.j2") for name in inputs)
    records = [Path(name) for name in inputs if name.endswith("/METADATA")]
    assert {path.parent.name.split("-")[0] for path in records} >= {"linkwise", "sympy"}
    assert [line for line in text.splitlines() if line == "arm.urdf:"]


def test_depfile_has_what_a_mjcf_file_includes_and_its_meshes(linkwise: Run, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/rod.xml").write_text(
        '<mujoco><worldbody><body name="rod"><joint name="hinge" axis="0 1 0"/>'
        '<geom type="mesh" mesh="rod"/></body></worldbody></mujoco>'
    )
    (tmp_path / "parts/rod.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    (tmp_path / "rod.xml").write_text(
        '<mujoco model="rod"><compiler meshdir="parts"/><asset><mesh name="rod" file="rod.obj"/></asset>'
        '<include file="parts/rod.xml"/></mujoco>'
    )
    done = linkwise("generate", "rod.xml", *C, "--depfile", "rod.d")
    assert done.returncode == 0, done.stderr
    own = {Path(tmp_path, name).resolve() for name in inputs_of(tmp_path / "rod.d")}
    assert {tmp_path / "rod.xml", tmp_path / "parts/rod.xml", tmp_path / "parts/rod.obj"} <= own
    assert any("mujoco-" in path.parent.name for path in own if path.name == "METADATA")


def test_depfile_has_the_file_of_constraints(linkwise: Run, tmp_path: Path) -> None:
    data = Path(__file__).parents[1] / "data/fourbar.toml"
    tree, mark, loop = data.read_text().partition("[[constraint]]")
    (tmp_path / "bars.toml").write_text(tree)
    (tmp_path / "loop.toml").write_text(f"schema = 1\n{mark}{loop}")
    done = linkwise("generate", "bars.toml", "--constraints", "loop.toml", *C, "--depfile", "bars.d")
    assert done.returncode == 0, done.stderr
    assert inputs_of(tmp_path / "bars.d")[:2] == ["bars.toml", "loop.toml"]


def test_depfile_has_the_modules_that_energies_import(
    linkwise: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "weights_of_mine.py").write_text("bob = 0.3\n")
    (tmp_path / "bob.py").write_text(
        "import sympy as sp\nfrom linkwise import Coordinate, LinkEnergy\nfrom weights_of_mine import bob\n"
        'x = Coordinate("x", "m")\ncoordinates = [x]\nlinks = [LinkEnergy("bob", bob * x.qd**2 / 2, x.q)]\n'
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    done = linkwise("generate", "bob.py", *C, "--depfile", "bob.d")
    assert done.returncode == 0, done.stderr
    assert "bob.py" in inputs_of(tmp_path / "bob.d")
    assert (tmp_path / "weights_of_mine.py").as_posix() in inputs_of(tmp_path / "bob.d")
    sys.modules.pop("weights_of_mine", None)


def test_names_that_make_has_no_way_to_say_are_refused() -> None:
    assert (
        depfile_text(["a b"], ["c#d", "e$f", "100%"])
        == "a\\ b: \\\n  c\\#d \\\n  e$$f \\\n  100%\nc\\#d:\ne$$f:\n"
    )
    for name in ("a\nb", "it's", "a&b", "a*", "~a", "ab:c", "a:b", "C:/arm", "a\\b", "a(b)"):
        with pytest.raises(LinkwiseError, match=" in it, which make and ninja cannot read; rename it, or"):
            depfile_text(["t"], [name])
        with pytest.raises(LinkwiseError):
            depfile_text([name], ["t"])


NAMES = ("plain", "two words", "number#1", "cash$", "a$(b)c", "percent%", "größe", "{x},~=@!+")


def make_is_up_to_date(folder: Path) -> bool:
    done = subprocess.run(["make", "-q"], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stderr
    return done.returncode == 0


def ninja_is_up_to_date(folder: Path) -> bool:
    done = subprocess.run(["ninja", "-n"], cwd=folder, capture_output=True, text=True, check=True)
    return "no work to do" in done.stdout


def set_up_make(folder: Path) -> None:
    (folder / "Makefile").write_text("all: the\\ target\nthe\\ target:\n\ttouch '$@'\ninclude the.d\n")
    subprocess.run(["make"], cwd=folder, check=True, capture_output=True)


def set_up_ninja(folder: Path) -> None:
    (folder / "build.ninja").write_text(
        "rule r\n  command = touch 'the target' && cp the.d read.d\n  depfile = read.d\n"
        "build the$ target: r\n"
    )
    subprocess.run(["ninja"], cwd=folder, check=True, capture_output=True)


TOOLS = {"make": (set_up_make, make_is_up_to_date), "ninja": (set_up_ninja, ninja_is_up_to_date)}


@pytest.mark.parametrize("tool", [pytest.param(tool, marks=needs(tool)) for tool in TOOLS])
def test_make_and_ninja_read_every_name(tool: str, tmp_path: Path) -> None:
    set_up, is_up_to_date = TOOLS[tool]

    def age(names: Iterable[str], seconds: int) -> None:
        for name in names:
            os.utime(tmp_path / name, (seconds, seconds))

    for name in NAMES:
        (tmp_path / name).touch()
    age(NAMES, 1_000_000_000)
    (tmp_path / "the.d").write_text(depfile_text(["the target"], NAMES))
    set_up(tmp_path)
    assert is_up_to_date(tmp_path)
    for name in NAMES:
        age([name], 4_000_000_000)
        assert not is_up_to_date(tmp_path), name
        age([name], 1_000_000_000)
        assert is_up_to_date(tmp_path), name
        (tmp_path / name).rename(tmp_path / "elsewhere")
        if not set("%=+!").intersection(name) or tool == "ninja":
            assert not is_up_to_date(tmp_path), f"{name} is gone"
        (tmp_path / "elsewhere").rename(tmp_path / name)


def test_the_stamp_is_the_target_and_as_new_as_the_last_run(linkwise: Run, tmp_path: Path) -> None:
    asked = ("generate", "planar1", *C, "--depfile", "arm.d", "--stamp", "made/arm.stamp")
    assert linkwise(*asked).returncode == 0
    assert (tmp_path / "arm.d").read_text().startswith("made/arm.stamp: \\\n")
    files = {path.relative_to(tmp_path).as_posix() for path in (tmp_path / "out").rglob("*.[hc]")}
    assert files <= set(inputs_of(tmp_path / "arm.d"))  # one that is gone is made again
    stamp, manifest = tmp_path / "made/arm.stamp", tmp_path / "out/planar1/manifest.json"
    for path in (stamp, manifest):
        os.utime(path, (1_000_000_000, 1_000_000_000))
    assert linkwise(*asked).returncode == 0
    assert stamp.stat().st_mtime > 1_000_000_000
    assert manifest.stat().st_mtime == 1_000_000_000
