"""A robot that cannot be: one line that names the joint or link, and the remedy."""

import time
from pathlib import Path
from typing import Any

import pytest
from helpers.urdf_text import chain, joint, link, mimic, robot
from linkwise import LinkwiseError, Options, read_system
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.robot import effects, read_robot

HUGE = "1" * 400
POINT = '<inertial><mass value="2"/><origin xyz="0 0 0.5"/></inertial>'
AB = joint("ab", "a", "b")
BC = joint("bc", "b", "c")


def moments(xx: float, yy: float, zz: float) -> str:
    """Link b of 1 kg with these principal moments."""
    inertia = f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="b"><inertial><mass value="1"/>{inertia}</inertial></link>'


BAD = {
    "empty": (robot(), "<robot> is empty: the file has no <link>"),
    "still": (robot(link("a")), "no joint moves; give one a moving type, or let the base move with --base"),
    "all fixed": (chain(joint("ab", "a", "b", type="fixed")), "no joint moves"),
    "unknown type": (chain(joint("ab", "a", "b", type="screw")), "joint 'ab' has the unknown type 'screw'"),
    "no type": (chain(joint("ab", "a", "b", type="")), "joint 'ab' has the unknown type ''; use one of"),
    "zero axis": (chain(joint("ab", "a", "b", axis="0 0 0")), "joint 'ab' has a zero axis"),
    "zero normal": (chain(joint("ab", "a", "b", axis="0 0 0", type="planar")), "joint 'ab' has a zero axis"),
    "nan axis": (chain(joint("ab", "a", "b", axis="nan 0 1")), "joint 'ab' has NaN or infinity in its axis"),
    "infinite origin": (
        chain(joint("ab", "a", "b", xyz="0 inf 0")),
        "'ab' has NaN or infinity in its origin",
    ),
    "nan turn": (chain(joint("ab", "a", "b", rpy="0 nan 0")), "'ab' has NaN or infinity in its origin"),
    "infinite turn": (chain(joint("ab", "a", "b", rpy="0 inf 0")), "'ab' has NaN or infinity in its origin"),
    "nan mass": (robot(link("a"), link("b", "nan"), AB), "link 'b' has NaN or infinity in its mass"),
    "negative": (robot(link("a"), link("b", "-1"), AB), "link 'b' has negative mass -1 kg"),
    "triangle": (
        robot(link("a"), moments(0.2, 0.3, 0.6), AB),
        "link 'b' has an inertia that breaks the triangle inequality (0.6 > 0.2 + 0.3 kg·m²) by 20 %",
    ),
    "two moments alike": (
        robot(link("a"), moments(0.1, 0.1, 0.5), AB),
        "(0.5 > 0.1 + 0.1 kg·m²) by 1.5e+02 %; correct it",
    ),
    "one moment": (
        robot(link("a"), moments(0, 0, 0.6), AB),
        "(0.6 > 0 + 0 kg·m²), as it has one moment alone: a thin rod along x has yy = zz; correct it",
    ),
    "long digits": (robot(link("a"), link("b", HUGE), AB), "link 'b' has NaN or infinity in its mass"),
    "longer digits": (
        chain(joint("ab", "a", "b", xyz=f"0 {'1' * 5000} 0")),
        "'ab' has NaN or infinity in its",
    ),
    "far origin": (
        chain(joint("ab", "a", "b", xyz="0 0 1e13")),
        "'ab' has a number beyond 1e+12 in its orig",
    ),
    "long axis": (
        chain(joint("ab", "a", "b", axis="0 0 1e308")),
        "'ab' has a number beyond 1e+12 in its axis",
    ),
    "huge mimic": (
        chain(AB, joint("bc", "b", "c", inner=mimic("ab", 1e200))),
        "joint 'bc' has a number beyond 1e+12 in its mimic; give numbers",
    ),
    "deep": (
        "<robot>" + "<a>" * 300,
        "malformed XML: elements more than 256 deep, which no robot's file needs",
    ),
    "macro": (
        robot('<xacro:macro xmlns:xacro="http://wiki.ros.org/xacro" name="m"/>', link("a")),
        "this is xacro, a language of macros; expand it first: xacro FILE > robot.urdf",
    ),
    "macro unbound": (
        robot('<xacro:include filename="a"/>', link("a")),
        "this is xacro, a language of macro",
    ),
    "value of a macro": (
        chain(joint("ab", "a", "b", xyz="0 0 ${length}")),
        "this is xacro, a language of ma",
    ),
    "several that cannot be": (
        robot(link("a"), link("b", "-1"), link("c", "-2"), AB, BC),
        "2 links cannot exist; correct them, or pass --allow-unphysical: 'b' has negative mass -1 kg, "
        "'c' has negative mass -2 kg",
    ),
    "two numbers": (
        chain(joint("ab", "a", "b", xyz="1 2")),
        "joint 'ab': <origin xyz='1 2'> needs 3 numbers",
    ),
    "empty link name": (robot(link("a"), link(""), AB), "a link has an empty name"),
    "empty joint name": (chain(joint("", "a", "b")), "a joint has an empty name"),
    "double link": (robot(link("a"), link("b"), link("b"), AB), "2 links are named 'b'; rename all but one"),
    "double joint": (chain(AB, joint("ab", "b", "c")), "2 joints are named 'ab'; rename all but one"),
    "made name": (
        chain(joint("x", "a", "b", type="ball"), joint("x_yaw", "b", "c")),
        "2 joints are named 'x_yaw', one of them made from a joint's type",
    ),
    "unknown link": (
        chain(AB, joint("bz", "b", "z")),
        "joint 'bz' has the child 'z', which is not a link; correct it or add",
    ),
    "two parents": (
        chain(AB, BC, joint("ac", "a", "c")),
        "link 'c' has 2 parents (joints 'bc', 'ac'); keep one, and close loops by constraints",
    ),
    "cycle": (
        robot(*map(link, "abc"), AB, BC, joint("ca", "c", "a")),
        "the joints form a loop through link 'a'; no link is the root",
    ),
    "several roots": (
        robot(link("a"), link("b"), link("c"), AB),
        "there are several roots ('a', 'c'); connect them, or choose one with --root",
    ),
    "unreachable": (
        robot(*map(link, "abcd"), AB, joint("cd", "c", "d"), joint("dc", "d", "c")),
        "link 'c' cannot be reached from the root 'a': its joints form a loop",
    ),
    "mimic of itself": (
        chain(AB, joint("bc", "b", "c", inner=mimic("bc"))),
        "joint 'bc' mimics 'bc', which is itself; name the joint that moves, or hold it with --lock bc=0",
    ),
    "mimic of a mimic": (
        chain(AB, joint("bc", "b", "c", inner=mimic("ab")), joint("cd", "c", "d", inner=mimic("bc"))),
        "joint 'cd' mimics 'bc', which is a mimic too; name the joint that moves",
    ),
    "mimics in a ring": (
        chain(joint("ab", "a", "b", inner=mimic("bc")), joint("bc", "b", "c", inner=mimic("ab"))),
        "joint 'ab' mimics 'bc', which is a mimic too",
    ),
    "mimic of nothing": (
        chain(AB, joint("bc", "b", "c", inner=mimic("moon"))),
        "joint 'bc' mimics 'moon', which is not a moving joint here; hold it with --lock bc=0, or let such",
    ),
    "mimic of many axes": (
        chain(AB, joint("bc", "b", "c", type="planar", inner=mimic("ab"))),
        "joint 'bc' is planar and mimics 'ab'; only a joint of one axis can",
    ),
    "nan mimic": (
        chain(AB, joint("bc", "b", "c", inner=mimic("ab", float("nan")))),
        "joint 'bc' has NaN or infinity in its mimic",
    ),
    "point on the axis": (
        robot(link("a"), f'<link name="b">{POINT}</link>', joint("ab", "a", "b", axis="0 0 1")),
        "joint 'ab' moves no inertia at all; give a link beyond it inertia, hold it with --lock ab=0, or",
    ),
    "coaxial": (
        robot(
            *(link("a"), '<link name="b"/>', link("c"), joint("ab", "a", "b", axis="0 0 1")),
            joint("bc", "b", "c", xyz="0 0 0.3", rpy="0 0 1", axis="0 0 -1"),
        ),
        "the joints 'ab', 'bc' can move together without moving any mass; give link 'b' between them mass "
        "and inertia, hold one with --lock bc=0, or pass --allow-unphysical",
    ),
    "massless tip": (
        robot(link("a"), link("b"), '<link name="c"/>', AB, BC),
        "joint 'bc' moves no mass at all; give a link beyond it mass, hold it with --lock bc=0, or pass",
    ),
}

ROD = (
    '[[link]]\nname = "rod"\nmass = {mass}\n{more}[[joint]]\nname = "hinge"\nparent = "base"\nchild = "rod"\n'
)


def toml(mass: str = "1.0", more: str = "", head: str = "schema = 1") -> str:
    return f"{head}\n" + ROD.format(mass=mass, more=more)


PARAMETER = "schema = 1\nparameters = {{ l1 = {} }}"
BAD_TOML = {
    "nan gravity": (toml(head="schema = 1\ngravity = [0, nan, 0]"), "gravity has NaN or infinity in it"),
    "infinite gravity": (toml(head="schema = 1\ngravity = [0, 0, -inf]"), "gravity has NaN or infinity"),
    "huge gravity": (
        toml(head="schema = 1\ngravity = [1e308, 0, 0]"),
        "gravity has a number beyond 1e+12 in it; give three numbers, in m/s²",
    ),
    "mass beyond": (toml("-2e12"), "link 'rod' has a number beyond 1e+12 in its mass, com or inertia; give"),
    "nan parameter": (toml(head=PARAMETER.format("nan")), "parameter 'l1' has NaN or infinity for a value;"),
    "big parameter": (
        toml(head=PARAMETER.format("1e13")),
        "'l1' has a number beyond 1e+12 for a value; give",
    ),
    "huge mass": (toml(HUGE), "link 'rod': 'mass' is too large a number"),
    "huge parameter": (toml(head=PARAMETER.format(HUGE)), "parameter 'l1' is too large a number"),
    "endless number": (
        toml("-1_" + "1" * 5000, head='schema = 1\nname = """\n"""'),
        "line 6 has a number of 5001 digits; 1e308 is about the largest",
    ),
    "endless schema": ("schema = 0x" + "f" * 5000, "line 1 has a number of 5000 digits; 1e308 is about"),
    "zero over": (
        toml('"1/(l1-l1)"', head=PARAMETER.format(0.3)),
        "'1/(l1-l1)' has no value: division by zero",
    ),
    "value over": (
        toml('"1/(l1-0.3)"', head=PARAMETER.format(0.3)),
        "link 'rod', mass: '1/(l1-0.3)' has no value: division by zero",
    ),
    "not a number": (
        toml('"1/(l1-0.3) - 1/(l1-0.3)*2"', head=PARAMETER.format(0.3)),
        "has no value: division by zero",
    ),
    "huge power": (
        toml('"(l1**8)**4"', head=PARAMETER.format(1e10)),
        "has no value: the result is too large",
    ),
    "schema true": (toml(head="schema = true"), "the schema is True; write schema = 1 at the top"),
    "schema 1.0": (toml(head="schema = 1.0"), "the schema is 1.0; write schema = 1 at the top"),
    "number for link": ("schema = 1\nlink = [3]", "entry 1 of link must be a table"),
    "number for joint": ("schema = 1\njoint = [{}, 3]", "entry 2 of joint must be a table"),
    "deep": (
        "schema = 1\n[[link]]\nmass = " + "[" * 5000,
        "malformed TOML: brackets 5000 deep; no robot's file needs",
    ),
    "deep tables": (
        "schema = 1\nlink = " + "{a=" * 300,
        "malformed TOML: brackets 300 deep; no robot's file",
    ),
    "long key": (
        "schema = 1\n" + ".".join(["a"] * 40_000) + " = 1",
        "malformed TOML: a dotted key 40000 deep; no robot's file needs more than 16",
    ),
    "long quoted key": (
        "schema = 1\n[" + " . ".join(["'a.b'", '"#c"'] * 200) + "]",
        "malformed TOML: a dotted key 400 deep",
    ),
    "long key behind a string": (
        'schema = 1\nname = ["""a"""", {' + ".".join(["a"] * 40_000) + " = 1}]",
        "malformed TOML: a dotted key 40000 deep",
    ),
    "a name that is a number": (
        toml().replace('name = "rod"', "name = 3", 1),
        "link 3 needs 'name', a string",
    ),
    "large": (
        "#" * (2**20 + 1),
        "the file is larger than 1 MiB, which no robot's description is; give one",
    ),
}


@pytest.mark.parametrize("parameters", ["numeric", "symbolic"])
@pytest.mark.parametrize("case", BAD_TOML)
def test_defect_of_a_toml_file_is_named(case: str, parameters: Any, tmp_path: Path) -> None:
    text, message = BAD_TOML[case]
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(LinkwiseError) as caught:
        read_system(tmp_path / "bad.toml", Options(parameters))
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{tmp_path / 'bad.toml'}: ")
    assert "\n" not in str(caught.value)


def test_a_description_may_have_four_mebibytes_of_xml(tmp_path: Path) -> None:
    arm = chain(joint("ab", "a", "b"))
    whole = f"{arm}<!--{' ' * (4 * 2**20 - len(arm) - 7)}-->"
    (tmp_path / "arm.urdf").write_text(whole)
    assert read_robot(tmp_path / "arm.urdf").coordinates
    (tmp_path / "arm.urdf").write_text(whole + " ")
    with pytest.raises(LinkwiseError, match="the file is larger than 4 MiB"):
        read_robot(tmp_path / "arm.urdf")


@pytest.mark.parametrize("opening", ['"', '"""'])
def test_string_that_does_not_end_takes_no_time(opening: str, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(f"schema = 1\nname = {opening}" + r"\"" * 40_000)
    start = time.process_time()
    with pytest.raises(LinkwiseError, match="malformed TOML: Unterminated string"):
        read_system(tmp_path / "bad.toml")
    assert time.process_time() - start < 2.0


def test_toml_may_start_with_a_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "good.toml").write_text(toml(more="com = [0.1, 0, 0]\n"), encoding="utf-8-sig")
    assert [c.name for c in read_system(tmp_path / "good.toml").coordinates] == ["hinge"]


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (
            "planar1001",
            "planar1001: planarN takes N from 1 to 1000, as the number of coefficients grows with",
        ),
        ("planar99999999999", "planar99999999999: planarN takes N from 1 to 1000, as the number of"),
        ("planar" + "9" * 5000, ": planarN takes N from 1 to 1000"),
        ("planar0", "no such file or built-in robot; the built-ins are planar3, planarN (N from 1 to 1000)"),
        (
            " ",
            "the robot's name is empty; give planar3, planarN (N from 1 to 1000), puma560, torso, or a .toml",
        ),
        (".", ".: this is a directory; give the robot's file"),
        ("a" * 300 + ".toml", ".toml: cannot be read: File name too long"),
    ],
    ids=lambda text: text[:20],
)
def test_what_is_not_a_robot_is_told_apart(spec: str, message: str) -> None:
    with pytest.raises(LinkwiseError) as caught:
        read_system(spec)
    assert message in str(caught.value)


def test_planar_arms_are_read_up_to_the_limit() -> None:
    assert len(read_robot("planar1000").links) == 1000


def test_entities_are_refused_in_plain_words(tmp_path: Path) -> None:
    (tmp_path / "bad.urdf").write_text('<!DOCTYPE robot [<!ENTITY a "aaaa">]><robot name="&a;"/>')
    with pytest.raises(
        LinkwiseError, match="malformed XML: it defines entities or refers to other files; write"
    ):
        read_system(tmp_path / "bad.urdf")


def notes_of(path: Path | str, options: Options | None = None) -> set[tuple[str, str, str]]:
    return {(note.kind, note.subject, note.detail) for note in read_robot(path, options).notes}


def test_massless_names_links_of_the_file_only(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(robot(link("a"), '<link name="b"/>', link("c"), AB, joint("bc", "b", "c", type="planar")))
    assert [note[1:] for note in notes_of(path) if note[0] == "massless"] == [("b", "")]
    floating = notes_of(path, Options(base="floating"))
    assert [note[1:] for note in floating if note[0] == "massless"] == [("b", "")]


def test_root_on_the_ground_is_noted_with_its_mass(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(robot(link("a", "2.5"), link("b"), AB))
    merged = ("merged", "a", "into the ground, with its 2.5 kg")
    assert merged in notes_of(path)
    assert merged in notes_of(path, Options("symbolic"))
    assert merged not in notes_of(path, Options(base="floating"))


@pytest.mark.parametrize(
    ("ratio", "offset", "detail"),
    [(1.0, 0.0, "= ab"), (-1.0, 0.0, "= -ab"), (0.5, -0.25, "= 0.5 ab - 0.25"), (1.0, 2.0, "= ab + 2")],
)
def test_mimic_is_written_as_one_would(ratio: float, offset: float, detail: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(chain(AB, joint("bc", "b", "c", inner=mimic("ab", ratio, offset))))
    assert ("mimic", "bc", detail) in notes_of(path)


def test_promoted_parameters_come_with_units_and_their_frame(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(chain(AB, BC))
    promoted = {
        subject: detail for kind, subject, detail in notes_of(path, Options("symbolic")) if kind == "promoted"
    }
    assert promoted["m_…"] == "mass in kg"
    assert promoted["p_…"] == (
        "place of the joint that moves the link in m, in the frame of its parent in the file; on the ground "
        "it moves no torque and is no parameter"
    )
    assert not [note for note in notes_of("planar3", Options("symbolic")) if note[0] == "promoted"]
    assert not [note for note in notes_of(path) if note[0] == "promoted"]


MJCF = """<mujoco>{option}<worldbody><body name="arm">
<joint name="a" axis="0 0 1" armature="0.1"/><joint name="b" axis="0 1 0"/><geom size="0.1"/>
<body><joint name="c" axis="0 1 0"/><geom size="0.1"/></body></body></worldbody>
<equality><joint joint1="{one}" joint2="b" polycoef="0 2 0 0 0"/><joint active="false" joint1="b"/></equality>
</mujoco>"""


def test_coupled_joints_of_mjcf_move_together_unless_freed(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    path = tmp_path / "hand.xml"
    path.write_text(MJCF.format(option="", one="c"))
    assert [(c.name, c.terms) for c in read_robot(path).couplings] == [
        ("joint1", ((1, (0.0, -2.0, 0.0, 0.0, 0.0)), (2, (0.0, 1.0))))
    ]
    locked = read_robot(path, Options(lock={"c": 0.0}))
    assert (len(locked.coordinates), locked.couplings) == (2, ())
    assert ("freed", "c", "locked, though coupled to 'b' by an equality") in notes_of(
        path, Options(lock={"c": 0.0})
    )
    notes = notes_of(path, Options(free_mimic=True))
    assert ("freed", "c", "coupled to 'b' by an equality") in notes
    assert ("passive", "a", "0.1 kg·m²") in notes
    touched = effects(read_robot(path, Options(free_mimic=True)).notes)
    assert "armature apart from the links' torques, by passive_torque: a (0.1 kg·m²)" in touched
    assert any("coupling left out of the torques: c (coupled to 'b' by an equality)" in t for t in touched)
    assert not [note for note in notes if note[0] == "massless" or note[1] == "geom"]


def test_nan_gravity_of_mjcf_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)  # MuJoCo logs its own doubts there
    path = tmp_path / "hand.xml"
    path.write_text(MJCF.format(option='<option gravity="0 0 nan"/>', one="c"))
    with pytest.raises(LinkwiseError, match="gravity has NaN or infinity in it"):
        read_robot(path, Options(free_mimic=True))


@pytest.mark.parametrize("case", BAD)
def test_defect_of_the_file_is_named(case: str, tmp_path: Path) -> None:
    text, message = BAD[case]
    (tmp_path / "bad.urdf").write_text(text)
    with pytest.raises(LinkwiseError) as caught:
        read_system(tmp_path / "bad.urdf")
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{tmp_path / 'bad.urdf'}: ")
    assert "\n" not in str(caught.value)


OPTIONS: dict[str, tuple[dict[str, Any], str]] = {
    "lock": ({"lock": {"elbow": 0.0}}, "--lock 'elbow' is not a moving joint; the joints are ab, bc"),
    "tip": ({"tip": "hand"}, "--tip 'hand' is not a link; the links are a, b, c"),
    "root": ({"root": "hip"}, "--root 'hip' is not a link; the links are a, b, c"),
    "tip before root": ({"root": "c", "tip": "a"}, "--tip 'a' is not below --root 'c'"),
    "root at the end": ({"root": "c"}, "no joint moves"),
    "far lock": ({"lock": {"ab": 1e300}}, "--lock 'ab' has a number beyond 1e+12 for a value; give rad or m"),
    "lock in degrees": (
        {"lock": {"ab": 30.0}},
        "--lock ab=30 is outside of the joint's limits, -9 to 9; give rad or m, or change the limits",
    ),
    "lock of all": ({"lock": {"ab": 0.0, "bc": 1.0}}, "no joint moves; free at least one"),
}


@pytest.mark.parametrize("case", OPTIONS)
def test_unknown_name_in_an_option_is_named(case: str, tmp_path: Path) -> None:
    options, message = OPTIONS[case]
    (tmp_path / "good.urdf").write_text(chain(AB, BC))
    with pytest.raises(LinkwiseError) as caught:
        read_system(tmp_path / "good.urdf", Options(**options))
    assert message in str(caught.value)


def test_a_robot_whose_moving_links_weigh_nothing_is_refused_whatever_is_allowed(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(robot(link("a"), '<link name="b"/>', AB))
    with pytest.raises(
        LinkwiseError, match=r"robot.urdf: no moving link has mass, so no torque is to be had"
    ):
        read_system(path, Options(allow_unphysical=True))


def test_named_options_get_past(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(BAD["negative"][0])
    assert read_system(path, Options(allow_unphysical=True)).links
    path.write_text(BAD["massless tip"][0])
    system = read_system(path, Options(allow_unphysical=True))
    assert [link.name for link in system.links] == ["b"]
    assert [c.name for c in system.coordinates] == ["ab", "bc"]
    path.write_text(BAD["mimic of nothing"][0])
    assert len(read_system(path, Options(free_mimic=True)).coordinates) == 2
    path.write_text(BAD["mimic of a mimic"][0])
    assert len(read_system(path, Options(lock={"bc": 0.0})).coordinates) == 1
    path.write_text(BAD["still"][0])
    assert len(read_system(path, Options(base="floating")).coordinates) == 6
    path.write_text(BAD["several roots"][0])
    assert len(read_system(path, Options(root="a")).coordinates) == 1


def test_point_mass_with_rounding_in_its_inertia_is_not_a_defect(tmp_path: Path) -> None:
    noise = '<inertia ixx="0" iyy="4e-18" izz="0" ixy="0" ixz="2.4e-35" iyz="0"/>'
    head = f'<link name="b"><inertial><mass value="1.3"/><origin xyz="0.1 0 0"/>{noise}</inertial></link>'
    (tmp_path / "point.urdf").write_text(robot(link("a"), head, AB))
    assert not [n for n in read_system(tmp_path / "point.urdf").robot.notes if n.kind == "unphysical"]


INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
LITTLE = ProcessLimits(seconds=30, memory=512 << 20)


def urdf_chain(count: int, more: str = "") -> str:
    links = "".join(f'<link name="l{k}">{INERTIAL}</link>' for k in range(count + 1))
    joints = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/>'
        f"{more if k else ''}</joint>"
        for k in range(count)
    )
    return robot(links, joints)


def energies(count: int) -> str:
    return (
        "from linkwise import Coordinate, LinkEnergy\n"
        f"coordinates = [Coordinate(f'q{{k}}', 'rad') for k in range({count})]\n"
        "links = [LinkEnergy(c.name, c.qd**2 / 2, 0) for c in coordinates]\n"
    )


@pytest.mark.parametrize(
    ("name", "text", "count", "mend"),
    [
        ("chain.urdf", urdf_chain(15_000), "15,000", "hold some by --lock, or leave some out by --root"),
        ("chain.urdf", urdf_chain(5_000, '<mimic joint="j0"/>'), "5,000", "hold some by --lock"),
        ("chain.urdf", urdf_chain(1_001), "1,001", "hold some by --lock"),
        ("chain.py", energies(1_001), "1,001", "leave some out"),
    ],
    ids=["chain", "followers", "one too many", "energies"],
)
def test_more_joints_than_can_be_generated_are_refused_at_once_wherever_they_come_from(
    name: str, text: str, count: str, mend: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(LinkwiseError) as caught:
        in_own_process(lambda: read_system(tmp_path / name), LITTLE)
    told = f"{count} joints move, and 1,000 are the most, as the number of coefficients grows with N³; {mend}"
    assert str(caught.value).startswith(f"{tmp_path / name}: {told}")


def test_a_part_of_a_chain_may_be_read_however_long_that_is(tmp_path: Path) -> None:
    (tmp_path / "chain.urdf").write_text(urdf_chain(1_500))
    system = read_system(tmp_path / "chain.urdf", Options(root="l700", tip="l703"))
    assert [c.name for c in system.coordinates] == ["j700", "j701", "j702"]
