"""A name that a format does not have: refused where it is near one that is read, told where it is not."""

from pathlib import Path
from xml.etree.ElementTree import fromstring

import pytest
from conftest import DATA
from helpers.command_line import run_linkwise
from helpers.urdf_text import chain, joint, link, robot
from linkwise import LinkwiseError, kept_package, read_robot
from linkwise.robot import effects
from linkwise.robot.readers.osim.document import as_xml, refuse_misspelt_names

URDF = chain(joint("ab", "a", "b"), joint("bc", "b", "c", inner='<dynamics damping="1"/>'))
SDF = (DATA / "poses.sdf").read_text()
OSIM = (DATA / "knee.osim").read_text()
MISSPELT = {
    "inertia of a link": (
        URDF,
        ("inertial>", "inertal>"),
        "link 'a' has <inertal>, which is not read; did you mean <inertial>?",
    ),
    "axis": (URDF, ("<axis", "<axes"), "joint 'ab' has <axes>, which is not read; did you mean <axis>?"),
    "capital": (
        URDF,
        ("<mass", "<Mass"),
        "link 'a', <inertial> has <Mass>, which is not read; did you mean <mass>?",
    ),
    "attribute": (
        URDF,
        ('ixz="', 'izx="'),
        "link 'a', <inertial>, <inertia> has izx=…, which is not read; did you mean ixz=…?",
    ),
    "two letters exchanged": (
        URDF,
        ('<axis xyz="', '<axis xzy="'),
        "<axis> has xzy=…, which is not read; did you mean xyz=…?",
    ),
    "two wrong letters of six": (
        URDF,
        ("<origin", "<oregen"),
        "has <oregen>, which is not read; did you mean <origin>?",
    ),
    "turn as a quaternion": (
        URDF,
        (' rpy="', ' quat_xyzw="0 0 0.6 0.8" rpy="'),
        "link 'a': <origin> has quat_xyzw=…, which is not read; write the turn as rpy",
    ),
    "second inertia": (
        URDF,
        ("</link>", "<inertial/></link>"),
        "link 'a' has <inertial> 2 times; keep one",
    ),
    "SDFormat": (
        SDF,
        ("<ixy>0.002</ixy>", "<iyx>0.002</iyx>"),
        "link 'upper', <inertial>, <inertia> has <iyx>, which is not read; did you mean <ixy>?",
    ),
    "pose": (
        SDF,
        ("relative_to=", "relativ_to="),
        "<pose> has relativ_to=…, which is not read; did you mean relative_to=…?",
    ),
    "OpenSim": (
        OSIM,
        ("<mass_center>", "<mass_centre>"),
        "has <mass_centre>, which is not read; did you mean <mass_center>?",
    ),
    "axis of OpenSim": (
        OSIM,
        ("<axis>", "<axes>"),
        "TransformAxis 'rotation1' has <axes>, which is not read; did you mean <axis>?",
    ),
    "place of an offset": (
        OSIM,
        ("<translation>", "<traslation>"),
        "PhysicalOffsetFrame 'thigh_top' has <traslation>, which is not read; did you mean <translation>?",
    ),
    "function": (
        OSIM,
        ("<coefficients>", "<coeficients>"),
        "LinearFunction 'function' has <coeficients>, which is not read; did you mean <coefficients>?",
    ),
    "gravity": (
        OSIM,
        ("<gravity>", "<gravty>"),
        "has <gravty>, which is not read; did you mean <gravity>?",
    ),
}


@pytest.mark.parametrize("case", MISSPELT)
def test_a_name_near_one_that_is_read_is_refused_with_that_one(case: str, tmp_path: Path) -> None:
    text, (right, wrong), message = MISSPELT[case]
    path = tmp_path / ("arm.sdf" if text is SDF else "arm.osim" if text is OSIM else "arm.urdf")
    path.write_text(text)
    assert not [line for line in effects(read_robot(path).notes) if "no such name" in line]
    assert right in text
    path.write_text(text.replace(right, wrong).replace(f"</{right[1:]}", f"</{wrong[1:]}"))
    with pytest.raises(LinkwiseError) as caught:
        read_robot(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_name_of_opensims_own_components_is_taken_for_a_misspelt_one() -> None:
    opensim = pytest.importorskip("opensim")
    registered = opensim.ArrayStr()
    opensim.OpenSimObject.getRegisteredTypenames(registered)
    opensim.OpenSimObject.setSerializeAllDefaults(True)
    try:
        classes = [registered.get(i) for i in range(registered.getSize())]
        texts = [opensim.OpenSimObject.newInstanceOfType(name).dump() for name in classes]
    finally:
        opensim.OpenSimObject.setSerializeAllDefaults(False)
    assert len(texts) > 200
    for text in texts:
        refuse_misspelt_names(fromstring(as_xml(text.encode())))


EXTENDED = robot(
    *map(link, "abcd"),
    *(joint(f"{a}{b}", a, b) for a, b in ("ab", "bc", "ad")),
    '<material name="grey"/><link_group name="arm"/>',
    '<loop_joint name="close" type="fixed"><link1 link="c"/><link2 link="d"/></loop_joint>',
    '<loop_joint name="still" type="fixed"><link1 link="a"/><link2 link="a"/></loop_joint>',
    '<drake:linear_bushing_rpy><drake:bushing_frameA name="left"/></drake:linear_bushing_rpy>',
    '<gazebo><joint name="rod" type="ball"><parent>d</parent><child>b</child></joint></gazebo>',
    '<gazebo><link name="weight"><inertial><mass>1</mass></inertial></link></gazebo>',
    '<drake:joint name="screw" type="screw"/>',
).replace("<robot", '<robot xmlns:drake="http://drake.mit.edu"')
TOLD = (
    "ignored, as URDF has no such name there: joint of http://drake.mit.edu (1 × in robot 'test'), "
    "link_group (1 × in robot 'test')",
    "joint that closes a loop left out of the torques: close (c to d)",
    "bushing left out of the torques: linear_bushing_rpy",
    "Gazebo's joint left out of the torques: rod (d to b)",
    "Gazebo's link left out of the torques: weight",
)


def test_generate_and_a_kept_package_say_what_was_ignored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LINKWISE_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "arm.urdf"
    path.write_text(EXTENDED)
    done = run_linkwise("generate", "arm.urdf", "--out", "out", "--backend", "numpy", folder=tmp_path)
    assert [line for line in done.stderr.splitlines() if line.startswith("warning")] == [
        f"warning: arm.urdf: {line}" for line in TOLD
    ]
    assert kept_package(path, "numpy").warnings == tuple(f"{path}: {line}" for line in TOLD)


LOST = '<inertial><mass value="3"/></inertial>'
STRAYS = {
    "in a shape": (
        URDF,
        ("</link>", f'<visual name="v"><geometry><box/>{LOST}</geometry></visual></link>'),
        "URDF has no such name there: inertial (3 × first in <visual> of link 'a')",
    ),
    "in a shape once": (
        URDF,
        ('<link name="b">', f'<link name="b"><collision>{LOST}</collision>'),
        "URDF has no such name there: inertial (1 × in <collision> of link 'b')",
    ),
    "in a joint": (
        URDF,
        ('<parent link="b"/>', f'<parent link="b"/>{LOST}'),
        "URDF has no such name there: inertial (1 × in joint 'bc')",
    ),
    "beside the inertia": (
        URDF,
        ('<link name="b">', '<link name="b"><mass value="3"/>'),
        "URDF has no such name there: mass (1 × in link 'b')",
    ),
    "a joint in a link": (
        URDF,
        ('<link name="b">', '<link name="b"><visual><joint name="j"/></visual><joint name="k"/>'),
        "URDF has no such name there: joint (2 × first in link 'b')",
    ),
    "an attribute": (
        URDF,
        ('<mass value="1.5"/>', '<mass value="1.5" unit="g"/>'),
        "URDF has no such name there: unit of <mass> (3 × first in <inertial> of link 'a')",
    ),
    "an attribute of a link": (
        URDF,
        ('<link name="c">', '<link name="c" weight="3">'),
        "URDF has no such name there: weight of <link> (1 × in link 'c')",
    ),
    "centre of mass": (
        SDF,
        ("</mass>", "</mass><com>0 0 1</com>"),
        "SDFormat has no such name there: com (4 × first in <inertial> of link 'upper')",
    ),
    "SDFormat's shape": (
        SDF,
        ('<link name="tip">', '<link name="tip"><collision name="c"><inertial/></collision>'),
        "SDFormat has no such name there: inertial (1 × in <collision> of link 'tip')",
    ),
    "SDFormat's mass": (
        SDF,
        ("</ixx>", "<mass>1</mass></ixx>"),
        "SDFormat has no such name there: "
        "mass (4 × first in <ixx> of <inertia> of <inertial> of link 'upper')",
    ),
}


@pytest.mark.parametrize("case", STRAYS)
def test_what_stands_where_nothing_reads_it_is_told_with_its_place(case: str, tmp_path: Path) -> None:
    text, (old, new), message = STRAYS[case]
    path = tmp_path / ("arm.sdf" if text is SDF else "arm.urdf")
    path.write_text(text)
    before = effects(read_robot(path).notes)
    assert old in text
    path.write_text(text.replace(old, new))
    assert effects(read_robot(path).notes) == (f"ignored, as {message}", *before)


FOREIGN = {
    "transmission": '<transmission name="t"><joint name="ab"/><actuator name="m"/></transmission>',
    "control": '<ros2_control name="c" type="system"><joint name="ab"/></ros2_control>',
    "plugin": '<link name="z"><visual><plugin><link>a</link><mass>1</mass></plugin></visual></link>',
}


@pytest.mark.parametrize("case", FOREIGN)
def test_what_means_something_else_elsewhere_is_not_told(case: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    fixed = '<joint name="az" type="fixed"><parent link="a"/><child link="z"/></joint>'
    added = FOREIGN[case] + (fixed if "<link" in FOREIGN[case][:5] else "")
    path.write_text(URDF.replace("</robot>", f"{added}</robot>"))
    assert not [line for line in effects(read_robot(path).notes) if "no such name" in line]


def test_a_line_on_many_places_stays_short(tmp_path: Path) -> None:
    path, count = tmp_path / "arm.urdf", 200
    names = [f"a_link_of_a_very_long_name_{k}" for k in range(count + 1)]
    links = (link(name).replace("</link>", "<com/></link>") for name in names)
    joints = (joint(f"j{k}", names[k], names[k + 1]) for k in range(count))
    path.write_text(robot(*links, *joints))
    (line,) = (note for note in read_robot(path).notes if note.subject == "com")
    assert line.detail == "201 × first in link 'a_link_of_a…ong_name_0'"


def test_what_an_sdformat_file_has_that_loads_joints_is_told(tmp_path: Path) -> None:
    path = tmp_path / "arm.sdf"
    text = SDF.replace("<sdf", '<sdf xmlns:drake="http://drake.mit.edu"').replace(
        "<child>tip</child>", "<child>tip</child><drake:rotor_inertia>0.1</drake:rotor_inertia>"
    )
    path.write_text(
        text.replace(
            '<link name="tip">', '<link name="tip"><velocity_decay><linear>2</linear></velocity_decay>'
        )
    )
    assert effects(read_robot(path).notes) == (
        "damping of a link's velocity left out of the torques: tip (2)",
        "armature left out of the torques: roll (0.1)",
    )
