"""SDFormat models: the robot that other formats describe, whichever way its poses are written."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers.shown_model import ShownModel
from linkwise import LinkwiseError, Options, generate, read_system, write_package
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.package.load import import_package
from linkwise.robot import effects
from linkwise.robot.read import read_robot

URDF = """<robot name="arm">
<link name="foot"/>
<link name="upper"><inertial><origin xyz="0.1 0 0.2" rpy="0.3 0 0"/><mass value="2"/>
  <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><origin xyz="0 0.1 0"/><mass value="1"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hip" type="revolute"><parent link="foot"/><child link="upper"/>
  <origin xyz="0 0.2 1" rpy="0 0 1.5707963267948966"/><axis xyz="0 1 0"/>
  <limit lower="0" upper="1" effort="1" velocity="1"/><dynamics damping="0.3" friction="0.1"/></joint>
<joint name="slide" type="prismatic"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.5"/>
  <axis xyz="0.6 0 0.8"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
<gazebo reference="hip"><springStiffness>7</springStiffness><springReference>0.4</springReference></gazebo>
</robot>"""

UPPER = """<inertial><pose>0.1 0 0.2 0.3 0 0</pose><mass>2</mass><inertia>
  <ixx>0.02</ixx><iyy>0.03</iyy><izz>0.04</izz><ixy>0.001</ixy></inertia></inertial>"""
LOWER = """<inertial><pose>0 0.1 0 0 0 0</pose><mass>1</mass><inertia>
  <ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></inertial>"""
HIP = """<dynamics><damping>0.3</damping><friction>0.1</friction>
  <spring_stiffness>7</spring_stiffness><spring_reference>0.4</spring_reference></dynamics>"""

# Both links are turned by a quarter from the model: 0.6 0 0.8 in their axes is 0 0.6 0.8 in the model's.
IN_THE_MODEL = f"""<sdf version="1.4"><model name="arm">
<link name="upper"><pose>0 0.2 1 0 0 1.5707963267948966</pose>{UPPER}</link>
<link name="lower"><pose>0 0.2 1.5 0 0 1.5707963267948966</pose>{LOWER}</link>
<joint name="hip" type="revolute"><parent>world</parent><child>upper</child>
  <axis><xyz>-1 0 0</xyz>{HIP}</axis></joint>
<joint name="slide" type="prismatic"><parent>upper</parent><child>lower</child>
  <axis><xyz>0 0.6 0.8</xyz></axis></joint>
</model></sdf>"""
IN_THE_JOINT = (
    IN_THE_MODEL.replace('version="1.4"', 'version="1.6"')
    .replace("<xyz>-1 0 0</xyz>", "<xyz>0 1 0</xyz>")
    .replace("<xyz>0 0.6 0.8</xyz>", "<xyz>0 0.6 0.8</xyz><use_parent_model_frame>1</use_parent_model_frame>")
)
RELATIVE = f"""<sdf version="1.11"><model name="arm">
<frame name="top" attached_to="upper"><pose>0 0 0.5 0 0 0</pose></frame>
<link name="lower"><pose relative_to="top"/>{LOWER}</link>
<link name="upper"><pose relative_to="hip"/>{UPPER}</link>
<joint name="hip" type="revolute"><pose relative_to="__model__" degrees="true">0 0.2 1 0 0 90</pose>
  <parent>world</parent><child>upper</child><axis><xyz expressed_in="lower">0 1 0</xyz>{HIP}</axis></joint>
<joint name="slide" type="prismatic"><pose rotation_format="quat_xyzw">0 0 0 0 0 1 0</pose>
  <parent>top</parent><child>lower</child><axis><xyz>-0.6 0 0.8</xyz></axis></joint>
</model></sdf>"""


def robot_of(folder: Path, text: str, suffix: str = "sdf", **options: Any) -> Any:
    path = folder / f"arm.{suffix}"
    path.write_text(text)
    return read_robot(path, Options(**options))


def numbers(robot: Any) -> Any:
    """Everything that the dynamics take from the links of a robot."""
    joints = [(link.joint.rotation, link.joint.translation) for link in robot.links]
    bodies = [(link.mass, link.com, link.inertia) for link in robot.links]
    parts = [*(p for joint in joints for p in joint), *(p for body in bodies for p in body), robot.gravity]
    return np.concatenate([np.ravel(np.array(part, dtype=float)) for part in parts])


@pytest.mark.parametrize("text", [IN_THE_MODEL, IN_THE_JOINT, RELATIVE], ids=["1.4", "1.6", "1.11"])
def test_poses_and_axes_of_every_version_make_the_robot_of_a_urdf_file(text: str, tmp_path: Path) -> None:
    ours, theirs = robot_of(tmp_path, text), robot_of(tmp_path, URDF, "urdf")
    np.testing.assert_allclose(numbers(ours), numbers(theirs), atol=1e-15)
    assert ours.passive == theirs.passive
    assert [c.name for c in ours.coordinates] == ["hip", "slide"]


def test_switches_are_read_in_capitals_too(tmp_path: Path) -> None:
    as_written = {"1.11": ('degrees="true"', 'degrees="True"'), "1.6": ("frame>1<", "frame>TRUE<")}
    for text, (old, new) in ((RELATIVE, as_written["1.11"]), (IN_THE_JOINT, as_written["1.6"])):
        assert old in text
        assert robot_of(tmp_path, text.replace(old, new)) == robot_of(tmp_path, text)


def test_the_world_of_the_file_has_its_gravity(tmp_path: Path) -> None:
    world = IN_THE_MODEL.replace("<model", "<world name='moon'><gravity>0 0 -1.6</gravity><model")
    moon = world.replace("</model>", "</model></world>")
    assert robot_of(tmp_path, moon).gravity == (0.0, 0.0, -1.6)
    old = re.sub("<gravity>.*?</gravity>", r"<physics type='ode'>\g<0></physics>", moon)
    assert robot_of(tmp_path, old).gravity == (0.0, 0.0, -1.6)


POSES = (DATA / "poses.sdf").read_text()
STAND = '<joint name="stand" type="fixed"><parent>world</parent><child>base</child></joint>'
AT = "<pose>0.3 -0.2 0.5 0.1 0.2 0.3</pose>"
PLACED = {
    "as it is": (POSES, {}),
    "without a pose of the model": (POSES.replace(AT, ""), {}),
    "placed by a frame": (POSES.replace("<model ", '<model placement_frame="edge" '), {}),
    "with a link called world": (POSES.replace(STAND, f'<link name="world"/>{STAND}'), {}),
    "held where the file shows it": (POSES.replace(STAND, ""), {"base": "fixed"}),
}


def loaded(folder: Path, text: str, **options: Any) -> Any:
    """A package of the model, on NumPy, and what was said of it."""
    folder.mkdir(exist_ok=True)
    (folder / "poses.sdf").write_text(text)
    system = read_system(folder / "poses.sdf", Options(**options))
    write_package(generate(system, ["numpy"]), folder / "poses")
    return import_package(folder / "poses").load("numpy"), effects(system.notes)


@pytest.mark.parametrize("place", PLACED)
def test_the_model_stands_in_the_world_where_its_poses_say(place: str, tmp_path: Path) -> None:
    text, options = PLACED[place]
    (robot, _), shown = loaded(tmp_path, text, **options), ShownModel(text)
    assert robot.joint_names == ("turn", "slide", "roll")
    rng, point, force = np.random.default_rng(0), np.array([0.1, -0.2, 0.3]), np.array([5.0, 7.0, -9.0])
    for q in (np.zeros(3), *rng.uniform(-1.0, 1.0, (3, 3))):
        for frame, pose in shown.poses(q).items():
            if frame in robot.kinematics.frames:
                np.testing.assert_allclose(robot.kinematics.pose(q, frame), pose, atol=1e-12)
                load = robot.kinematics.load_torque(q, frame, force, point=point)
                np.testing.assert_allclose(-load, shown.load_torque(q, frame, point, force), atol=1e-8)
        still = robot.inverse_dynamics(q, np.zeros(3), np.zeros(3))
        np.testing.assert_allclose(still, shown.gravity_torque(q), atol=1e-8)
    assert {"corner", "edge", "tip"} <= set(robot.kinematics.frames)


def test_a_model_on_joints_of_the_world_does_not_float(tmp_path: Path) -> None:
    (tmp_path / "stands.sdf").write_text(POSES)
    with pytest.raises(LinkwiseError, match="'world' is the world, which cannot float"):
        read_robot(tmp_path / "stands.sdf", Options(base="floating"))


def test_frames_of_a_model_stay_where_a_link_called_world_comes_first(tmp_path: Path) -> None:
    inertia = "".join(f"<{entry}>0.1</{entry}>" for entry in ("ixx", "iyy", "izz"))
    text = f"""<sdf version="1.9"><model name="m"><link name="world"/>
        <frame name="mark"><pose>0 0 .5 0 0 0</pose></frame>
        <link name="a"><pose>0 .1 0 0 0 0</pose>
        <inertial><mass>1</mass><inertia>{inertia}</inertia></inertial></link></model></sdf>"""
    robot, _ = loaded(tmp_path, text)
    expected = np.array([1.0, 2.0 - 0.1, 3.0 + 0.5])
    np.testing.assert_allclose(robot.kinematics.pose([1, 2, 3, 0, 0, 0], "mark")[:3, 3], expected)


def test_a_model_that_nothing_holds_falls_and_says_where_the_file_shows_it(tmp_path: Path) -> None:
    text = POSES.replace(STAND, "")
    robot, (told, *_) = loaded(tmp_path, text)
    assert "free to fall, as no joint of the file holds it to the world (--base fixed holds it): base" in told
    values = dict(re.findall(r"(base_\w+) = ([-0-9.e]+)", told))
    q = np.array([float(values.get(name, 0.0)) for name in robot.joint_names])
    for frame, pose in ShownModel(text).poses(q[6:]).items():
        np.testing.assert_allclose(robot.kinematics.pose(q, frame), pose, atol=1e-5)
    weight = robot.inverse_dynamics(q, 0 * q, 0 * q)[:3]
    np.testing.assert_allclose(weight, [0.0, 0.0, 9.81 * 7.5], atol=1e-12)
    (asked, _), (cut, _) = loaded(tmp_path, text, base="floating"), loaded(tmp_path, text, root="upper")
    assert asked.n == robot.n == 9
    assert cut.joint_names == ("slide", "roll"), "the frame of --root is the world's"


def test_a_mimic_has_the_offset_of_its_reference(tmp_path: Path) -> None:
    rule = (
        '<mimic joint="hip"><multiplier>2</multiplier><offset>0.5</offset><reference>0.1</reference></mimic>'
    )
    text = RELATIVE.replace("<xyz>-0.6 0 0.8</xyz>", f"<xyz>-0.6 0 0.8</xyz>{rule}")
    robot = robot_of(tmp_path, text)
    assert robot.links[1].joint.ratio == 2.0
    apart = np.array(robot.links[1].joint.translation) - np.array(
        robot_of(tmp_path, RELATIVE).links[1].joint.translation
    )
    assert np.linalg.norm(apart) == pytest.approx(0.3), "0.5 - 2 * 0.1 along the slide"


FOUR_BAR = """<sdf version="1.9"><model name="four_bar">
<link name="base">{inertial}</link>
<link name="crank"><pose>0 0 0 0 0 0</pose>{inertial}</link>
<link name="coupler"><pose>0 0 0.3 0 0 0</pose>{inertial}</link>
<link name="rocker"><pose>0.5 0 0 0 0 0</pose>{inertial}</link>
<joint name="turn" type="revolute"><parent>base</parent><child>crank</child>
  <axis><xyz>0 1 0</xyz></axis></joint>
<joint name="bend" type="revolute"><parent>crank</parent><child>coupler</child>
  <axis><xyz>0 1 0</xyz></axis></joint>
<joint name="close" type="{closing}"><pose>0 0 0.3 0 0 0</pose><parent>coupler</parent><child>rocker</child>
  <axis><xyz>0 1 0</xyz><dynamics><damping>{damping}</damping></dynamics></axis></joint>
<joint name="swing" type="revolute"><parent>base</parent><child>rocker</child>
  <axis><xyz>0 1 0</xyz></axis></joint>
</model></sdf>"""


@pytest.mark.parametrize(("closing", "kind"), [("ball", "point"), ("revolute", "hinge"), ("fixed", "frame")])
def test_a_joint_that_closes_a_loop_becomes_a_constraint_where_it_is(
    closing: str, kind: str, tmp_path: Path
) -> None:
    text = FOUR_BAR.format(inertial=LOWER, closing=closing, damping=0.2)
    if closing != "ball":  # which of two is cut is that which comes later
        first, last = text.index('<joint name="close"'), text.index('<joint name="swing"')
        text = (
            text[:first]
            + text[last : text.index("</model>")]
            + text[first:last]
            + text[text.index("</model>") :]
        )
    robot = robot_of(tmp_path, text)
    (tie,) = robot.ties
    assert (tie.name, tie.kind) == ("close", kind)
    ends = [robot.frames[end] for end in (tie.first, tie.second)]
    assert [robot.links[end.link].name for end in ends if end.link is not None] == ["coupler", "rocker"]
    assert "damping left out of the torques: close (0.2 on a joint that closes a loop)" in effects(
        robot.notes
    )
    # At q = 0 the links stand where the file shows them, and the loop is closed.
    places = [_place(robot, end) for end in ends]
    np.testing.assert_allclose(places, [[0.5, 0.0, 0.3]] * 2, atol=1e-15)


@pytest.mark.parametrize("closing", ["revolute", "fixed"])
def test_what_closes_a_loop_has_its_axes_from_links_that_stand_askew(closing: str, tmp_path: Path) -> None:
    """Pins of a planar loop all turn about y, so that what a ball closes a hinge leaves as it is."""
    text = FOUR_BAR.replace("<xyz>0 1 0</xyz>", '<xyz expressed_in="__model__">0 1 0</xyz>')
    text = text.replace("0 0 0.3 0 0 0</pose>{inertial}", "0 0 0.3 0.3 0.2 0.1</pose>{inertial}")
    text = text.replace("0.5 0 0 0 0 0</pose>{inertial}", "0.5 0 0 -0.2 0.4 0.6</pose>{inertial}")
    text = text.replace(
        "<pose>0 0 0.3 0 0 0</pose><parent>", "<pose relative_to='__model__'>{pin}</pose><parent>"
    )
    for name, place in (("bend", "0 0 0.3 0.5 0.4 0.3"), ("swing", "0.5 0 0 0.1 0.7 0.2")):
        end = f'name="{name}" type="revolute">'
        text = text.replace(end, f"{end}<pose relative_to='__model__'>{place}</pose>")
    first, last = text.index('<joint name="close"'), text.index('<joint name="swing"')
    end = text.index("</model>")
    text = text[:first] + text[last:end] + text[first:last] + text[end:]
    given = {"inertial": LOWER, "pin": "0.5 0 0.3 0.2 -0.4 0.5", "damping": 0}
    ball, _ = loaded(tmp_path / "ball", text.format(closing="ball", **given), base="fixed")
    base = {"base": "fixed"} if closing == "revolute" else {}  # welded bars do not turn
    robot, _ = loaded(tmp_path / closing, text.format(closing=closing, **given), **base)
    closed = [ball.constraints.closed(np.array([0.4, 0.1, 0.4]))] if base else []
    for q in (np.zeros(robot.n), *closed):
        np.testing.assert_allclose(robot.constraints.violation(q), np.zeros(5 if base else 6), atol=1e-12)


def _place(robot: Any, frame: Any) -> Any:
    """Return the place of a frame at q = 0."""
    x = np.array(frame.translation, dtype=float)
    for link in reversed(robot.chain(frame.link)):
        joint = robot.links[link].joint
        x = np.array(joint.rotation) @ x + np.array(joint.translation, dtype=float)
    return x


BAD = {
    "more models": (
        ("</model>", '</model><model name="other"/>'),
        "the file has 2 models ('arm', 'other'); keep one",
    ),
    "another file": (
        ('<link name="lower">', '<include/><link name="lower">'),
        "has a <include>; write all in one model",
    ),
    "static": (
        ('<link name="lower">', '<static>true</static><link name="lower">'),
        "is <static>, and never moves",
    ),
    "static in capitals": (
        ('<link name="lower">', '<static> True </static><link name="lower">'),
        "is <static>, and never moves",
    ),
    "no version": (('version="1.11"', ""), "<sdf version=None>; give the format's version, such as 1.9"),
    "no inertia": ((LOWER, ""), "link 'lower' has no <inertial>, which SDFormat takes for 1 kg and 1 kg m²"),
    "no axis": (
        ("<xyz>-0.6 0 0.8</xyz>", "<xyz>0 0 0</xyz>"),
        "has a zero axis; give its direction, such as",
    ),
    "no mass": (("<mass>1</mass>", ""), "link 'lower': <inertial> has no <mass>; write it out"),
    "no moment": (("<iyy>0.01</iyy>", ""), "link 'lower': <inertial> has no <iyy>; write it out"),
    "shapes": (
        ("<inertial><pose>0 0.1", "<inertial auto='true'><pose>0 0.1"),
        "is worked out of shapes by Gazebo",
    ),
    "no such frame": (
        ('attached_to="upper"', 'attached_to="uper"'),
        "frame 'top' names 'uper', which is no link",
    ),
    "a circle": (
        ('relative_to="hip"', 'relative_to="upper"'),
        "the pose of link 'upper' is relative to itself",
    ),
    "attached in a circle": (
        ('attached_to="upper"><pose>', 'attached_to="top"><pose relative_to="upper">'),
        "joint 'slide': frame 'top' is attached to itself, in a circle",
    ),
    "five numbers": (
        ("0 0.2 1 0 0 90", "0 0.2 1 0 90"),
        "joint 'hip': <pose> is '0 0.2 1 0 90'; it needs 6 numbers",
    ),
    "two axes": (
        ("<parent>top", "<axis2/><parent>top"),
        "joint 'slide' has two axes; write it as two joints",
    ),
    "relative to what else the world has": (
        ('<model name="arm">', '<model name="arm"><pose relative_to="hall">0 0 1 0 0 0</pose>'),
        "the pose of model 'arm' is relative to 'hall'; write it in the axes of the world",
    ),
    "no canonical link": (
        ('<model name="arm">', '<model name="arm" canonical_link="uper">'),
        "has the canonical_link 'uper', which is not a link; there are upper, lower",
    ),
    "carries the world": (
        ("<child>upper</child>", "<child>world</child>"),
        "joint 'hip' has the world for its child; make the world its parent",
    ),
    "no child": (("<child>lower</child>", ""), "joint 'slide' has no <child>; name the link"),
    "one name twice": (('frame name="top"', 'frame name="upper"'), "named 'upper'; rename one"),
    "zero quaternion": (
        ("0 0 0 0 0 1 0<", "0 0 0 0 0 0 0<"),
        "joint 'slide': <pose> has a quaternion of zeros",
    ),
    "inertia in another link": (
        ("<inertial><pose>0 0.1", "<inertial><pose relative_to='upper'>0 0.1"),
        "link 'lower': the pose of <inertial> is relative to 'upper', which SDFormat does not have; "
        "write it in the link's axes",
    ),
    "inertia in the model": (
        ("<inertial><pose>0 0.1", "<inertial><pose relative_to='__model__'>0 0.1"),
        "link 'lower': the pose of <inertial> is relative to '__model__'",
    ),
    "the way to say it of old": (
        ('<pose rotation_format="quat_xyzw">', '<pose frame="top">'),
        "joint 'slide': <pose frame='top'> is obsolete; write relative_to",
    ),
    "another order of a quaternion": (
        ("quat_xyzw", "quat_wxyz"),
        "joint 'slide': <pose rotation_format='quat_wxyz'> is not read; "
        "give the turn as euler_rpy or quat_xyzw",
    ),
    "another way of angles": (
        ("<inertial><pose>0 0.1", "<inertial><pose rotation_format='rpy'>0 0.1"),
        "link 'lower': <pose rotation_format='rpy'> is not read; give the turn as euler_rpy or quat_xyzw",
    ),
    "six numbers with a quaternion": (
        ("0 0 0 0 0 1 0<", "0 0 0 0 0 1<"),
        "joint 'slide': <pose> is '0 0 0 0 0 1'; it needs 7 numbers",
    ),
    "a quaternion in degrees": (
        ('rotation_format="quat_xyzw"', 'rotation_format="quat_xyzw" degrees="true"'),
        "joint 'slide': <pose> has a quaternion in degrees; remove degrees, or write euler_rpy",
    ),
    "neither degrees nor not": (
        ('degrees="true"', 'degrees="yes"'),
        "joint 'hip': <pose degrees> is 'yes'; write true or false",
    ),
    "neither static nor not": (
        ('<link name="lower">', '<static>on</static><link name="lower">'),
        "model 'arm': <static> is 'on'; write true or false",
    ),
    "neither of shapes nor not": (
        ("<inertial><pose>0 0.1", "<inertial auto='yes'><pose>0 0.1"),
        "link 'lower': <inertial auto> is 'yes'; write true or false",
    ),
    "an axis in the model as before 1.7": (
        ("-0.6 0 0.8</xyz>", "-0.6 0 0.8</xyz><use_parent_model_frame>true</use_parent_model_frame>"),
        "joint 'slide': <use_parent_model_frame> is no more from version 1.7 on; "
        'write <xyz expressed_in="__model__">',
    ),
}


@pytest.mark.parametrize("fault", BAD)
def test_what_is_no_robot_is_refused_in_one_line(fault: str, tmp_path: Path) -> None:
    (old, new), message = BAD[fault]
    assert old in RELATIVE
    with pytest.raises(LinkwiseError) as caught:
        robot_of(tmp_path, RELATIVE.replace(old, new))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


OLD = {
    "link": (
        ('<link name="lower"><pose>', '<link name="lower"><pose relative_to="upper">'),
        "link 'lower': <pose relative_to='upper'> is not read in a file older than version 1.7; "
        "raise its version, or write the pose without it",
    ),
    "joint": (
        ("<parent>upper", '<pose relative_to="upper">0 0 1 0 0 0</pose><parent>upper'),
        "joint 'slide': <pose relative_to='upper'> is not read in a file older than version 1.7",
    ),
    "axis": (
        ("<xyz>0 1 0", '<xyz expressed_in="__model__">0 1 0'),
        "joint 'hip': <xyz expressed_in='__model__'> is not read in a file older than version 1.7; "
        "raise its version, or write the axis without it",
    ),
}


@pytest.mark.parametrize("place", OLD)
def test_a_frame_that_an_old_file_names_is_refused_and_not_passed_over(place: str, tmp_path: Path) -> None:
    (old, new), message = OLD[place]
    assert IN_THE_JOINT.count(old) == 1
    with pytest.raises(LinkwiseError) as caught:
        robot_of(tmp_path, IN_THE_JOINT.replace(old, new))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


SAME = {
    "inertia in its own link": ("<inertial><pose>0 0.1", "<inertial><pose relative_to='lower'>0 0.1"),
    "inertia in no frame": ("<inertial><pose>0 0.1", "<inertial><pose relative_to=''>0 0.1"),
    "axis not in the model": (
        "-0.6 0 0.8</xyz>",
        "-0.6 0 0.8</xyz><use_parent_model_frame>0</use_parent_model_frame>",
    ),
    "angles": (' degrees="true"', ' degrees="true" rotation_format="euler_rpy"'),
}


@pytest.mark.parametrize("way", SAME)
def test_what_says_only_what_is_so_anyway_changes_nothing(way: str, tmp_path: Path) -> None:
    old, new = SAME[way]
    assert RELATIVE.count(old) == 1
    assert numbers(robot_of(tmp_path, RELATIVE.replace(old, new))).tolist() == (
        numbers(robot_of(tmp_path, RELATIVE)).tolist()
    )


@pytest.mark.parametrize("text", [IN_THE_MODEL, IN_THE_JOINT], ids=["1.4", "1.6"])
def test_an_axis_in_the_model_is_z_there_where_none_is_written(text: str, tmp_path: Path) -> None:
    turned = text.replace("<pose>0 0.2 1.5 0 0 1.57", "<pose>0 0.2 1.5 1 0 1.57")
    written = turned.replace("0 0.6 0.8", "0 0 1")
    assert "<xyz>0 0 1</xyz>" in written
    assert turned != text
    assert numbers(robot_of(tmp_path, written.replace("<xyz>0 0 1</xyz>", ""))).tolist() == (
        numbers(robot_of(tmp_path, written)).tolist()
    )


def test_a_slide_that_closes_a_loop_is_refused(tmp_path: Path) -> None:
    text = (
        FOUR_BAR.format(inertial=LOWER, closing="ball", damping=0)
        .replace('<joint name="swing" type="revolute">', '<joint name="swing" type="ball">')
        .replace('<joint name="close" type="ball">', '<joint name="close" type="prismatic">')
    )
    assert robot_of(tmp_path, text).ties[0].kind == "point"
    swapped = text.replace('type="ball"', 'type="revolute"').replace(
        'name="close" type="prismatic"', 'name="close" type="revolute"'
    )
    late = swapped.replace('<joint name="swing" type="revolute">', '<joint name="swing" type="prismatic">')
    with pytest.raises(
        LinkwiseError, match="joint 'swing' closes a loop and is prismatic; such a joint may be ball"
    ):
        robot_of(tmp_path, late)


def test_what_gazebo_does_besides_is_told(tmp_path: Path) -> None:
    text = RELATIVE.replace(
        '<link name="lower">', '<link name="lower"><gravity>false</gravity><visual name="v"/>'
    )
    robot = robot_of(tmp_path, text)
    assert any(
        "Gazebo's switch for gravity left out of the torques: lower" in line for line in effects(robot.notes)
    )
    assert any(note.kind == "ignored" and note.subject == "visual" for note in robot.notes)


def test_poses_that_hang_on_one_another_in_a_long_chain_are_each_worked_out_once(tmp_path: Path) -> None:
    """A chain of 8,000 has 32 million pairs."""
    links = "".join(
        f'<link name="l{k}"><pose relative_to="l{k - 1}">1 0 0 0 0 0</pose>{LOWER}</link>'
        f'<joint name="j{k}" type="{"revolute" if k > 7_998 else "fixed"}"><parent>l{k - 1}</parent>'
        f"<child>l{k}</child><axis><xyz>0 0 1</xyz></axis></joint>"
        for k in range(1, 8_001)
    )
    (tmp_path / "a.sdf").write_text(
        f'<sdf version="1.9"><model name="a"><link name="l0">{LOWER}</link>{links}</model></sdf>'
    )
    limits = ProcessLimits(seconds=30, memory=1 << 30)
    robot = in_own_process(lambda: read_robot(tmp_path / "a.sdf", Options(base="fixed")), limits)
    (hand,) = (frame for frame in robot.frames if frame.name == "l7998")
    assert hand.translation == (7998.0, 0, 0)


def test_frames_that_hang_on_one_another_in_a_long_chain_find_their_link_at_once(tmp_path: Path) -> None:
    frames = "".join(f'<frame name="f{k}" attached_to="f{k - 1}"/>' for k in range(1, 20_001))
    (tmp_path / "a.sdf").write_text(
        f'<sdf version="1.9"><model name="a"><link name="f0">{LOWER}</link>{frames}</model></sdf>'
    )
    limits = ProcessLimits(seconds=20, memory=1 << 30)
    robot = in_own_process(lambda: read_robot(tmp_path / "a.sdf"), limits)
    link = {frame.name: frame.link for frame in robot.frames}
    assert link["f0"] is not None
    assert {link[f"f{k}"] for k in range(20_001)} == {link["f0"]}
