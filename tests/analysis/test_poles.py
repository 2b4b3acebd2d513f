"""Distance of a log from the pole of three turns, and when: long logs, and turns by a ratio of a joint's."""

from pathlib import Path

import numpy as np
from helpers import urdf_text
from helpers.motion_logs import write_csv
from linkwise import Options, generate, read_system, write_package
from linkwise.analysis import analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.poles import pole_warnings
from linkwise.analysis.samples import Samples


def package(folder: Path, text: str, options: Options | None = None) -> Path:
    """The robot of a URDF file."""
    (folder / "robot.urdf").write_text(text)
    write_package(
        generate(read_system(folder / "robot.urdf", options or Options()), ["numpy"]), folder / "robot"
    )
    return folder / "robot"


def test_the_instant_nearest_to_a_pole_is_told_of_a_log_of_any_length(tmp_path: Path) -> None:
    box = load_robot(package(tmp_path, urdf_text.robot(urdf_text.link("box")), Options(base="floating")))
    time = np.arange(150_000) / 1000
    q = np.zeros((len(time), len(box.joints)))
    pitch = q[:, box.joints.index("base_pitch")]
    pitch[[20_000, 69_000, 140_000]] = np.radians([88.0, 89.0, 87.0])
    (told,) = pole_warnings(box.tree, box.joints, Samples(time, q, 1000.0, (), ()))
    assert "'base_pitch' is 1 degrees from where" in told
    assert "one axis, at 69 s:" in told


def test_a_turn_by_a_ratio_of_a_joints_is_near_its_pole_where_it_stands_itself(tmp_path: Path) -> None:
    """The pitch is twice the angle of the joint that it follows."""
    light = (f'<link name="{name}"/>' for name in "cd")
    turns = (
        urdf_text.joint("drive", "a", "b"),
        urdf_text.joint("yaw", "a", "c", axis="0 0 1"),
        urdf_text.joint(
            "pitch", "c", "d", axis="0 1 0", xyz="0 0 0", rpy="0 0 0", inner=urdf_text.mimic("drive", 2.0)
        ),
        urdf_text.joint("roll", "d", "e", axis="1 0 0", xyz="0 0 0", rpy="0 0 0"),
    )
    robot = package(tmp_path, urdf_text.robot(*map(urdf_text.link, "abe"), *light, *turns))
    time = np.arange(101) / 100
    for nearest, degrees in ((30.0, None), (44.5, 1)):
        table = np.zeros((len(time), 4))
        table[:, 0], table[:, 1] = time, np.radians(nearest - 20.0 * (time - 0.4) ** 2)
        warnings = analyze(write_csv(tmp_path / "a.csv", table, ["drive", "yaw", "roll"]), robot).warnings
        near = [text for text in warnings if "turn about one axis" in text]
        assert len(near) == (degrees is not None)
        if near:
            assert (
                f"is {degrees} degrees from where 'yaw' and 'roll' turn about one axis, at 0.4 s" in near[0]
            )
