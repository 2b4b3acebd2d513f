"""Words of joints: which motion is positive is what Pinocchio shows of the model, whatever names promise."""

from collections.abc import Sequence
from pathlib import Path

import linkwise
import numpy as np
import pinocchio as pin
import pytest
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.motion_words import MotionWords, words_of
from tools.corpus import ROBOTS

G1 = ROBOTS / "g1_description/urdf/g1_29dof_rev_1_0.urdf"
ICUB = ROBOTS / "icub_description/robots/icub.urdf"
needs_robots = pytest.mark.skipif(not ROBOTS.is_dir(), reason="needs example-robot-data")
UP = np.array([0.0, 0.0, 1.0])


def words_by_name(file: Path) -> dict[str, MotionWords]:
    robot = load_robot(linkwise.kept_package(file).directory)
    return {name: words for name, words in zip(robot.joints, robot.words, strict=True) if words is not None}


def seen(model: pin.Model, joint: str, behind: str, moved: float) -> np.ndarray:
    """Place of a joint, or the centre of mass of the foot, after another joint was moved."""
    q, data = pin.neutral(model), model.createData()
    q[model.joints[model.getJointId(joint)].idx_q] += moved
    pin.forwardKinematics(model, data, q)
    number = model.getJointId(behind)
    is_foot = "ankle" in behind
    return np.array(
        data.oMi[number].act(model.inertias[number].lever) if is_foot else data.oMi[number].translation
    )


@needs_robots
@pytest.mark.parametrize(
    ("file", "hip", "knee", "ankle", "spread"),
    [
        (
            G1,
            "{}_hip_pitch_joint",
            "{}_knee_joint",
            ("{}_ankle_pitch_joint", "{}_ankle_roll_joint"),
            "{}_hip_roll_joint",
        ),
        (ICUB, "{}_hip_pitch", "{}_knee", ("{}_ankle_pitch", "{}_ankle_roll"), "{}_hip_roll"),
    ],
    ids=["forward is x", "forward is against x"],
)
def test_what_is_positive_is_read_off_the_model(
    file: Path, hip: str, knee: str, ankle: Sequence[str], spread: str
) -> None:
    model, words = pin.buildModelFromUrdf(str(file)), words_by_name(file)
    sides = ("left", "right") if file == G1 else ("l", "r")
    for side, other in (sides, sides[::-1]):
        at = seen(model, hip.format(side), ankle[0].format(side), 0.0)
        foot = seen(model, hip.format(side), ankle[1].format(side), 0.0)
        forward = (foot - at) * (1.0 - UP)
        inward = seen(model, hip.format(side), hip.format(other), 0.0) - seen(
            model, hip.format(side), hip.format(side), 0.0
        )
        for joint, behind, way, positive in (
            (hip, knee, forward, "flexion"),
            (knee, ankle[0], -forward, "flexion"),
            (ankle[0], ankle[1], UP, "dorsiflexion"),
            (spread, knee, inward, "adduction"),
        ):
            name = joint.format(side)
            went = seen(model, name, behind.format(side), 0.1) - seen(model, name, behind.format(side), 0.0)
            assert (went @ way > 0.0) == (words[name].positive == positive), name
            assert positive in words[name].signs


def test_models_whose_knees_bend_to_either_side_have_their_own_words(tmp_path: Path) -> None:
    for axis, told in (("0 0 1", "extension +, flexion −"), ("0 0 -1", "flexion +, extension −")):
        file = tmp_path / "leg.osim"
        file.write_text(LEG.replace("AXIS", axis))
        words = words_by_name(file)
        assert str(words["knee_angle_r"]) == f"right knee, {told}"
        assert str(words["hip_flexion_r"]) == "right hip, flexion +, extension −"


def test_joints_that_would_have_the_same_words_keep_their_names(tmp_path: Path) -> None:
    file = tmp_path / "leg.osim"
    text = LEG.replace("AXIS", "0 0 1")
    file.write_text(text.replace("knee_angle_r", "hip_back_flexion_r"))
    assert words_by_name(file) == {}
    file.write_text(text)
    assert len(words_by_name(file)) == 2


def test_robots_that_are_no_persons_have_no_words() -> None:
    tree = load_robot(linkwise.kept_package("puma560").directory).tree
    assert words_of(["shoulder", "elbow", "wrist1", "wrist2", "wrist3", "wrist4"], tree, UP) == (None,) * 6


LEG = """<OpenSimDocument Version="40500"><Model name="leg"><gravity>0 -9.80665 0</gravity>
<BodySet><objects>
<Body name="femur_r">
<mass>7</mass><mass_center>0 -0.2 0</mass_center><inertia>0.1 0.1 0.1 0 0 0</inertia></Body>
<Body name="tibia_r">
<mass>3</mass><mass_center>0 -0.2 0</mass_center><inertia>0.1 0.1 0.1 0 0 0</inertia></Body>
</objects></BodySet>
<JointSet><objects>
<PinJoint name="hip"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>/bodyset/femur_r</socket_child_frame>
<coordinates><Coordinate name="hip_flexion_r"/></coordinates></PinJoint>
<CustomJoint name="knee"><socket_parent_frame>at</socket_parent_frame>
<socket_child_frame>/bodyset/tibia_r</socket_child_frame>
<coordinates><Coordinate name="knee_angle_r"/></coordinates>
<frames><PhysicalOffsetFrame name="at"><socket_parent>/bodyset/femur_r</socket_parent>
<translation>0 -0.4 0</translation></PhysicalOffsetFrame></frames>
<SpatialTransform><TransformAxis name="rotation1"><coordinates>knee_angle_r</coordinates><axis>AXIS</axis>
<LinearFunction name="function"><coefficients>1 0</coefficients></LinearFunction></TransformAxis>
</SpatialTransform></CustomJoint>
</objects></JointSet></Model></OpenSimDocument>
"""
