"""Figures and the stick figure."""

from dataclasses import replace

import numpy as np
import pytest
from linkwise.analysis import analyze
from linkwise.analysis.loaded_robot import load_robot
from linkwise.analysis.result_columns import Column
from linkwise.analysis.show.poses import poses
from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.package.manifest import BodyEntry
from matplotlib.figure import Figure
from motion_logs import JOINTS, PLANAR3, smooth, write_csv


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    return analyze(write_csv(tmp_path_factory.mktemp("a") / "a.csv", smooth(80, 3)), PLANAR3)


def test_paper_figure_draws_the_numbers(analysis):
    figure = analysis.figure("paper:joint2")
    assert isinstance(figure, Figure)
    panels, legends = figure.axes[:5], figure.axes[5:]
    assert [axis.get_legend().get_title().get_text() for axis in legends] == ["Joints", "Links"]
    drawn = [[line.get_ydata() for line in axis.lines[:-1]] for axis in panels]
    np.testing.assert_array_equal(drawn[0], analysis.q.T)
    np.testing.assert_array_equal(drawn[1], analysis.torque.T)
    np.testing.assert_array_equal(drawn[2], analysis.partial_torque[:, 1, 1:].T)
    own = [
        [analysis.velocity[:, 1, j, j] for j in (1, 2)],
        [analysis.acceleration[:, 1, j, j] for j in (1, 2)],
    ]
    np.testing.assert_array_equal(drawn[3:], own)
    figure.draw_without_rendering()


def test_shares_fill_the_bars(analysis):
    figure = analysis.figure("shares")
    for axis in figure.axes:
        ends = np.zeros(3)
        for bar in axis.containers:
            ends += [patch.get_width() for patch in bar]
        np.testing.assert_allclose(ends, 100)
    figure.draw_without_rendering()


def test_power_figure_draws_joint_power_and_work_by_link(analysis):
    figure = analysis.figure("power")
    curves, bars = figure.axes
    np.testing.assert_array_equal([line.get_ydata() for line in curves.lines[:-1]], analysis.joint_power.T)
    widths = np.array([[patch.get_width() for patch in bar] for bar in bars.containers])
    np.testing.assert_allclose(widths[:3].T, analysis.work.given, rtol=1e-14)
    np.testing.assert_allclose(widths[3:].T, -analysis.work.taken, rtol=1e-14)
    ends = widths[:3].sum(axis=0) + widths[3:].sum(axis=0)
    np.testing.assert_allclose(bars.lines[0].get_xdata(), ends, atol=1e-12)
    assert [text.get_text() for text in bars.get_legend().get_texts()] == ["net", "link1", "link2", "link3"]
    figure.draw_without_rendering()


def test_unknown_figures_are_named(analysis):
    with pytest.raises(LinkwiseError, match="--figure shares:joint1"):
        analysis.figure("shares:joint1")


def test_poses_of_the_planar_arm():
    q = smooth(10, 3)[:, 1:]
    bodies = load_robot(PLANAR3).bodies
    origins, centres = poses(bodies, q)
    angle = np.cumsum(q, axis=1)
    steps = 0.25 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    joints = np.concatenate([np.zeros((10, 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    np.testing.assert_allclose(origins, joints[:, :-1], atol=1e-15)
    np.testing.assert_allclose(centres, (joints[:, :-1] + joints[:, 1:]) / 2, atol=1e-15)


def test_poses_of_a_slide_on_a_turned_frame():
    zero = (0.0, 0.0, 0.0)
    turned = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # its z axis is the parent's x
    upright = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    bulk = (zero, zero, zero)
    slide = BodyEntry(
        "a", None, "a", "prismatic", 0, 2.0, turned, (0.0, 1.0, 0.0), 1.0, (0.0, 0.0, 3.0), bulk
    )
    crank = BodyEntry("b", 0, "b", "revolute", 1, -1.0, upright, (0.0, 0.0, 1.0), 1.0, (1.0, 0.0, 0.0), bulk)
    origins, centres = poses([slide, crank], np.array([[0.5, np.pi / 2]]))
    np.testing.assert_allclose(origins[0], [[1, 1, 0], [2, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(centres[0], [[4, 1, 0], [2, 1, -1]], atol=1e-15)


def many(analysis, count=14):
    """The same numbers with as many names as asked for, one of 80 letters."""
    joints = tuple(f"joint{i}" if i != 4 else f"{'a_name_from_a_drawing_' * 4}4" for i in range(count))
    robot = replace(analysis.robot, joints=joints, links=joints, units=("rad",) * count, bodies=None)
    columns = tuple(Column("q", f"q/{i}", "rad", i) for i in range(count))
    return replace(analysis, robot=robot, columns=columns, values=analysis.values[1 + np.arange(count) % 9])


def test_many_joints_get_a_legend_that_fits(analysis):
    figure = replace(many(analysis), values=np.abs(many(analysis).values)).figure("paper")
    figure.draw_without_rendering()
    assert figure.get_figheight() > analysis.figure("paper").get_figheight()
    inside = figure.bbox
    lowest = figure._supxlabel.get_window_extent().y1
    boxes = [axis.get_legend().get_window_extent() for axis in figure.axes[5:]]
    for box in boxes:
        assert box.x0 >= inside.x0
        assert box.x1 <= inside.x1
    assert figure.axes[4].xaxis.label.get_window_extent().y0 > boxes[0].y1
    assert boxes[0].y0 >= boxes[1].y1 - 1
    assert boxes[1].y0 >= lowest - 1
    texts = [text.get_text() for text in figure.axes[5].get_legend().get_texts()]
    assert len(set(texts)) == 14
    assert max(map(len, texts)) == 24
    looks = {(line.get_color(), line.get_linestyle()) for line in figure.axes[0].lines[:-1]}
    assert len(looks) == 14


def test_joints_that_the_last_panels_lack_are_named(analysis):
    robot = replace(analysis.robot, joints=(*JOINTS, "pelvis_ty"), units=("rad", "rad", "rad", "m"))
    figure = replace(analysis, robot=robot).figure("paper")
    assert "they carry no link with mass directly: pelvis_ty." in " ".join(
        figure._supxlabel.get_text().split("\n")
    )
    assert "Not in them" not in analysis.figure("paper")._supxlabel.get_text()
    assert figure.axes[3].get_title(loc="left").endswith("each link's own joint only, velocity")
    assert figure.axes[4].get_title(loc="left").endswith("each link's own joint only, acceleration")


def test_long_names_keep_both_ends():
    assert short("hip_flexion_r") == "hip_flexion_r"
    assert short("abcdefghijklmnop_12", 11) == "abcde…op_12"
