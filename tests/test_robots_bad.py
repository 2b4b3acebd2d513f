"""A robot that cannot be: one line that names the joint or link, and the mend."""

from pathlib import Path
from typing import Any

import pytest
from linkwise import LinkwiseError, Options, read_system
from urdf_text import chain, joint, link, mimic, robot

AB = joint("ab", "a", "b")
BC = joint("bc", "b", "c")
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
        "joint 'bz' names 'z' as its child, but there is no such",
    ),
    "two parents": (
        chain(AB, BC, joint("ac", "a", "c")),
        "link 'c' has 2 parents (joints 'bc', 'ac'); loops are not supported, keep one",
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
        "joint 'bc' mimics 'moon', which is no moving joint here; hold it with --lock bc=0, or let such",
    ),
    "mimic of many axes": (
        chain(AB, joint("bc", "b", "c", type="planar", inner=mimic("ab"))),
        "joint 'bc' is planar and mimics 'ab'; only a joint of one axis can",
    ),
    "nan mimic": (
        chain(AB, joint("bc", "b", "c", inner=mimic("ab", float("nan")))),
        "joint 'bc' has NaN or infinity in its mimic",
    ),
    "massless tip": (
        robot(link("a"), link("b"), '<link name="c"/>', AB, BC),
        "joint 'bc' moves no mass at all; give a link beyond it mass, hold it with --lock bc=0, or pass",
    ),
}


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
    "lock": ({"lock": {"elbow": 0.0}}, "--lock names no moving joint 'elbow'; the joints are ab, bc"),
    "tip": ({"tip": "hand"}, "--tip names no link 'hand'; the links are a, b, c"),
    "root": ({"root": "hip"}, "--root names no link 'hip'; the links are a, b, c"),
    "tip before root": ({"root": "c", "tip": "a"}, "--tip 'a' does not hang on --root 'c'"),
    "root at the end": ({"root": "c"}, "no joint moves"),
    "lock of all": ({"lock": {"ab": 0.0, "bc": 1.0}}, "no joint moves; free at least one"),
}


@pytest.mark.parametrize("case", OPTIONS)
def test_unknown_name_in_an_option_is_named(case: str, tmp_path: Path) -> None:
    options, message = OPTIONS[case]
    (tmp_path / "good.urdf").write_text(chain(AB, BC))
    with pytest.raises(LinkwiseError) as caught:
        read_system(tmp_path / "good.urdf", Options(**options))
    assert message in str(caught.value)


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


def test_point_mass_with_rounding_in_its_inertia_is_no_defect(tmp_path: Path) -> None:
    noise = '<inertia ixx="0" iyy="4e-18" izz="0" ixy="0" ixz="2.4e-35" iyz="0"/>'
    head = f'<link name="b"><inertial><mass value="1.3"/><origin xyz="0.1 0 0"/>{noise}</inertial></link>'
    (tmp_path / "point.urdf").write_text(robot(link("a"), head, AB))
    assert not [n for n in read_system(tmp_path / "point.urdf").robot.notes if n.kind == "unphysical"]
