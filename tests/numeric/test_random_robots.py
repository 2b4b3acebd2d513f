"""Small random robots against Pinocchio; `make random` runs 200 of up to 15 joints."""

from collections import Counter
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

pytest.importorskip("pinocchio")

from fuzz.valid_robots import OFTEN, JointData, LinkData, RobotData, random_robot

from numeric.random_robots import LIMIT, drawn, features, largest_error


# Making a failing robot smaller takes minutes; the message has its file.
@settings(
    max_examples=15,
    derandomize=True,
    deadline=None,
    database=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
@given(st.randoms(use_true_random=False), st.integers(1, 5))
def test_decomposition_of_a_random_robot_is_pinocchios(rng: Random, joints: int) -> None:
    robot = random_robot(rng, joints, 10)
    with TemporaryDirectory() as folder:
        assert largest_error(robot, Path(folder)) <= LIMIT, robot.text


def test_random_robots_have_everything_that_a_robot_may_have() -> None:
    seen = sum((features(drawn(seed)) for seed in range(200)), Counter())
    assert all(seen[what] >= 20 for what in (*OFTEN, "toml", "urdf", "branch", "mimic", "massless link"))


@pytest.mark.parametrize("tilt", [6e-8, 1e-6, 1e-3])
@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0)])
def test_an_axis_a_little_off_the_frames_is_not_taken_for_it(
    axis: tuple[int, int, int], tilt: float, tmp_path: Path
) -> None:
    x, y, z = axis
    tilted = x + tilt * (y + z), y + tilt * z, z + tilt * x
    body = LinkData(
        "arm", 1.0, (0.3, 0.2, 0.1), ((0.02, 0.001, 0.0), (0.001, 0.03, 0.002), (0.0, 0.002, 0.04))
    )
    joint = JointData("hinge", "revolute", "base", "arm", (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), tilted)
    robot = RobotData("toml", (1.0, 2.0, -9.0), (LinkData("base"), body), (joint,))
    assert largest_error(robot, tmp_path) <= 1e-11  # rotations are rounded at 1e-12
