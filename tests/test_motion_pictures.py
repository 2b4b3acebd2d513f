"""Figures and the stick figure."""

import numpy as np
import pytest
from linkwise.errors import LinkwiseError
from linkwise.motion import analyze
from linkwise.motion.robot import load_robot
from linkwise.motion.skeleton import Body, poses
from matplotlib.figure import Figure
from motion_logs import PLANAR3, smooth, write_csv


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    return analyze(write_csv(tmp_path_factory.mktemp("a") / "a.csv", smooth(80, 3)), PLANAR3)


def test_paper_figure_draws_the_numbers(analysis):
    figure = analysis.figure("paper:joint2")
    assert isinstance(figure, Figure)
    assert len(figure.axes) == 5
    drawn = [[line.get_ydata() for line in axis.lines[:-1]] for axis in figure.axes]
    np.testing.assert_array_equal(drawn[0], analysis.q.T)
    np.testing.assert_array_equal(drawn[1], analysis.torque.T)
    np.testing.assert_array_equal(drawn[2], analysis.partial_torque[:, 1, 1:].T)
    own = [
        [analysis.velocity[:, 1, j, j] for j in (1, 2)],
        [analysis.acceleration[:, 1, j, j] for j in (1, 2)],
    ]
    np.testing.assert_array_equal(drawn[3:], own)
    figure.canvas.draw()


def test_shares_fill_the_bars(analysis):
    figure = analysis.figure("shares")
    for axis in figure.axes:
        ends = np.zeros(3)
        for bar in axis.containers:
            ends += [patch.get_width() for patch in bar]
        np.testing.assert_allclose(ends, 100)
    figure.canvas.draw()


def test_unknown_figures_are_named(analysis):
    with pytest.raises(LinkwiseError, match="--figure shares:joint1"):
        analysis.figure("shares:joint1")


def test_poses_of_the_planar_arm():
    q = smooth(10, 3)[:, 1:]
    bodies = load_robot(PLANAR3).skeleton
    origins, centres = poses(bodies, q)
    angle = np.cumsum(q, axis=1)
    steps = 0.25 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    joints = np.concatenate([np.zeros((10, 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    np.testing.assert_allclose(origins, joints[:, :-1], atol=1e-15)
    np.testing.assert_allclose(centres, (joints[:, :-1] + joints[:, 1:]) / 2, atol=1e-15)


def test_poses_of_a_slide_on_a_turned_frame():
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # its z axis is the parent's x
    slide = Body("a", None, True, 0, 2.0, turn, np.array([0.0, 1, 0]), np.array([0.0, 0, 3]))
    crank = Body("b", 0, False, 1, -1.0, np.eye(3), np.array([0.0, 0, 1]), np.array([1.0, 0, 0]))
    origins, centres = poses([slide, crank], np.array([[0.5, np.pi / 2]]))
    np.testing.assert_allclose(origins[0], [[1, 1, 0], [2, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(centres[0], [[4, 1, 0], [2, 1, -1]], atol=1e-15)
