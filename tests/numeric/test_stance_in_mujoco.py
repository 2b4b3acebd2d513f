"""The picture of a quadruped on three feet in docs/control.md: what it says, as MuJoCo moves the robot."""

from pathlib import Path

import numpy as np
import pytest
from conftest import needs_compiler

pytest.importorskip("mujoco")
pytest.importorskip("matplotlib")

from tools import control_stance
from tools.control_stance import PUSHED, SOLO, THROWN

pytestmark = [
    needs_compiler,
    pytest.mark.skipif(not SOLO.is_file(), reason="needs real robots: pip install example-robot-data"),
]


def test_a_trunk_gives_way_to_a_push_alone_where_its_leg_is_cancelled(tmp_path: Path) -> None:
    robot, package = control_stance.solo(tmp_path)
    runs = control_stance.both(robot, package)
    turns, pushed = [], []
    for run in runs:
        angle = control_stance.turned(robot, run)
        thrown = (run.time >= THROWN[0]) & (run.time < THROWN[1])
        turns.append(np.ptp(angle[thrown]))
        began = run.q[run.time < PUSHED[0]][-1]
        pushed.append(np.linalg.norm((run.q - began)[run.time >= PUSHED[0], :3], axis=1).max())
        assert run.slipped < 2e-3, "feet stay, but for rolling and what is soft"
        hip = robot.joint_names.index("FR_HFE")
        assert np.ptp(run.q[:, hip]) > 1.5, "the leg is thrown"
    assert turns[0] > 2.0, "degrees, where nothing is cancelled"
    assert turns[1] < 0.1 * turns[0]
    assert 0.8 * pushed[0] < pushed[1] < 1.2 * pushed[0]
    assert control_stance.picture(robot, runs).startswith(b"\x89PNG")
