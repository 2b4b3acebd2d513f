"""Figures and the stick figure."""

import json
import re
from dataclasses import replace
from itertools import pairwise

import matplotlib
import numpy as np
import pytest
from helpers import urdf_text
from helpers.motion_logs import JOINTS, PLANAR3, smooth, write_csv
from linkwise import generate, read_system, write_package
from linkwise.analysis import Load, Reading, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.show import figure_bytes
from linkwise.analysis.show.drawn_curves import largest_few
from linkwise.analysis.show.page import page_data, stick_figure
from linkwise.analysis.whole_movement import Totals
from linkwise.errors import LinkwiseError
from linkwise.escape import short
from matplotlib.figure import Figure


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


def test_links_and_loads_have_looks_of_their_own_in_the_paper_figure(pushed):
    path, push, _ = pushed
    loads = [push, Load("pull", "link3", (5.0, 0.0, 0.0))]
    figure = analyze(path, PLANAR3, Reading(ignore_extra=True), loads=loads).figure("paper:joint1")
    looks = [(line.get_color(), line.get_linestyle()) for line in figure.axes[2].lines[:-1]]
    assert len(looks) == len(set(looks)) == 5


def test_shares_fill_the_bars(analysis):
    figure = analysis.figure("shares")
    for axis in figure.axes:
        ends = np.zeros(3)
        for bar in axis.containers:
            ends += [patch.get_width() for patch in bar]
        np.testing.assert_allclose(ends, 100)
    figure.draw_without_rendering()


def test_shares_of_many_joints_are_their_own_the_largest_other_ones_and_the_rest(analysis, monkeypatch):
    monkeypatch.setattr("linkwise.analysis.show.shares_figure.MANY", 2)
    figure = analysis.figure("shares")
    assert [axis.get_title(loc="left") for axis in figure.axes[:2]] == [
        "everything,\ngravity too",
        "the movement alone,\nwithout gravity",
    ]
    widths = np.array([[patch.get_width() for patch in bar] for bar in figure.axes[1].containers])
    terms = np.stack([analysis.acceleration, analysis.velocity])  # (2, S, joint, link, cause)
    sizes = np.abs(terms.sum(axis=(0, 3))).mean(axis=0)
    apart = np.abs(terms).mean(axis=1).sum(axis=(0, 2))
    assert (apart > 1.01 * sizes)[0].all()  # links, acceleration and velocity pull against each other
    first = (sizes - np.diag(sizes.diagonal())).argmax(axis=1)
    beside = figure.axes[2]
    assert [text.get_text() for text in beside.get_yticklabels()] == [JOINTS[k] for k in first]
    assert beside.get_ylim() == figure.axes[1].get_ylim()
    others = np.sort(sizes[~np.eye(3, dtype=bool)].reshape(3, 2), axis=1)
    expected = np.array([sizes.diagonal(), others[:, 1], others[:, 0]])
    np.testing.assert_allclose(widths, 100 * expected / sizes.sum(axis=1))


def test_gravity_and_loads_stand_before_motions_in_the_shares(pushed):
    path, push, _ = pushed
    result = analyze(path, PLANAR3, Reading(ignore_extra=True), loads=[push])
    labels = [text.get_text() for text in result.figure("shares").legends[0].get_texts()]
    assert labels == ["gravity", "load push", *(f"{joint} motion" for joint in JOINTS)]


def test_pictures_and_the_page_leave_out_an_ending_that_all_joints_have(analysis):
    def shown(*joints):
        result = replace(analysis, robot=replace(analysis.robot, joints=joints))
        rows, _ = bars(result.figure(f"causes:{joints[1]}"))
        power, shares = result.figure("power").axes[0], result.figure("shares").axes[0]
        found = [text.get_text() for text in power.get_legend().get_texts()]
        assert [text.get_text() for text in shares.get_yticklabels()] == found
        assert {row for row in rows if row.endswith("motion")} == {f"{name} motion" for name in found}
        assert [joint["shown"] for joint in json.loads(page_data(result))["joints"]] == found
        return found

    assert shown("base_joint", "Boom_Joint", "tip-joint") == ["base", "Boom", "tip"]
    assert shown("base_joint", "boom_joint", "tip") == ["base_joint", "boom_joint", "tip"]
    assert shown("base_joint", "base-joint", "tip_joint") == ["base_joint", "base-joint", "tip_joint"]


def bars(figure):
    """Rows by name, then for each phase by name the means and the mean sizes."""
    means, sizes = figure.axes[1:]
    rows = [text.get_text() for text in means.get_yticklabels()]
    return rows, {
        bar.get_label(): tuple([patch.get_width() for patch in one] for one in (bar, beside))
        for bar, beside in zip(means.containers, sizes.containers, strict=True)
    }


@pytest.fixture(scope="module")
def pushed(tmp_path_factory):
    """An arm that is pushed at its hand in two spans of time; a column `grip` of the log is up meanwhile."""
    place = tmp_path_factory.mktemp("pushed")
    log = smooth(400, 3)
    on = (log[:, 0] % 2 < 0.8).astype(float)
    push = Load("push", "link3", 30 * on[:, None] * [0, 1, 0], time=log[:, 0])
    path = write_csv(place / "a.csv", np.column_stack([log, on]), [*JOINTS, "grip"])
    return path, push, on > 0


def causes_of(result, i):
    """Curves of causes from the result's arrays."""
    moved = (result.acceleration + result.velocity)[:, i].sum(axis=1)
    return {
        "all causes together": result.torque[:, i],
        "gravity": result.gravity[:, i].sum(axis=-1),
        "load push": result.load_torque[:, i, 0],
        **{f"{joint} motion": moved[:, k] for k, joint in enumerate(JOINTS)},
    }


def test_causes_in_each_phase_are_numpys_and_add_up(pushed):
    path, push, on = pushed
    phases = ["stance/swing=push", "grip=grip", "half=0..1.995", "ends=1..2"]
    result = analyze(path, PLANAR3, loads=[push], phases=phases)
    figure = result.figure("causes:joint2")
    rows, shown = bars(figure)
    masks = {"stance": on, "swing": ~on, "grip": on, "half": result.time < 1.996}
    masks["ends"] = (result.time > 0.995) & (result.time < 2.005)
    curves = causes_of(result, 1)
    assert set(rows) == set(curves)
    assert list(shown) == list(masks)
    for name, (means, sizes) in shown.items():
        mask = masks[name]
        np.testing.assert_allclose(means, [curves[row][mask].mean() for row in rows], atol=1e-12)
        np.testing.assert_allclose(sizes, [np.abs(curves[row][mask]).mean() for row in rows])
        assert sum(means[1:]) == pytest.approx(means[0], rel=1e-12)
    sizes = [np.abs(curves[row]).mean() for row in rows[1:]]
    assert sizes == sorted(sizes, reverse=True)
    assert result.record()["phases"][::2] == ["stance: force of push above 20 N", "half: from 0 to 1.995 s"]
    assert "half: from 0 to 1.995 s" in " ".join(figure.get_supxlabel().split())
    whole = analyze(path, PLANAR3, Reading(ignore_extra=True), phases=["all=0..99"]).figure("causes:joint2")
    assert "all: from 0 to 99 s" in " ".join(whole.get_supxlabel().split())
    figure.draw_without_rendering()


def test_bars_of_phases_stand_side_by_side(pushed):
    path, push, _ = pushed
    figure = analyze(path, PLANAR3, loads=[push], phases=["on/off=push", "grip=grip"]).figure("causes:joint1")
    for panel in figure.axes[1:]:
        ends = sorted(
            (bar.get_y(), bar.get_y() + bar.get_height()) for one in panel.containers for bar in one
        )
        assert len(ends) == 3 * len(figure.axes[1].get_yticklabels())
        assert all(below[1] < above[0] for below, above in pairwise(ends))


def test_a_joint_that_bears_one_load_has_the_phases_of_that_load(pushed, analysis):
    path, push, on = pushed
    result = analyze(path, PLANAR3, Reading(ignore_extra=True), loads=[push])
    _, shown = bars(result.figure("causes:joint1"))
    assert list(shown) == ["load push acts", "load push does not act"]
    assert shown["load push acts"][0][0] == pytest.approx(result.torque[on, 0].mean())
    _, shown = bars(analysis.figure("causes:joint1"))
    assert list(shown) == ["the whole movement"]


def test_a_panel_says_what_it_shows_and_in_which_unit(analysis):
    over_time, means, sizes = analysis.figure("causes:joint1").axes
    titles = [panel.get_title() or panel.get_title(loc="left") for panel in (over_time, means, sizes)]
    assert titles == ["all causes together", "mean (N·m)", "mean size (N·m)"]
    assert over_time.get_ylabel() == "N·m"


def test_the_users_own_settings_of_matplotlib_change_no_figure(analysis):
    expected = figure_bytes(analysis, "paper")
    with matplotlib.rc_context({"axes.facecolor": "red", "lines.marker": "o"}):
        assert figure_bytes(analysis, "paper") == expected


def test_the_figure_of_causes_has_room_for_every_cause(analysis):
    figure = analysis.figure("causes:joint1")
    figure.draw_without_rendering()
    places = [text.get_window_extent() for text in figure.axes[1].get_yticklabels()]
    places.sort(key=lambda place: place.y0)
    assert len(places) == 5
    assert all(below.y1 < above.y0 for below, above in pairwise(places))


def test_figures_are_shown_in_a_notebook(analysis, monkeypatch):
    loaded = []
    monkeypatch.setattr("linkwise.analysis.job.extra", loaded.append)
    analysis.figure("paper")
    assert loaded == ["matplotlib.pyplot"]


def test_many_causes_are_named_by_size_and_the_rest_is_one(analysis, monkeypatch):
    monkeypatch.setattr("linkwise.analysis.show.cause_numbers.MOST", 1)
    rows, shown = bars(analysis.figure("causes:joint1"))
    assert rows[-1] == "motion of 2 others"
    means, _ = shown["the whole movement"]
    assert sum(means[1:]) == pytest.approx(means[0], rel=1e-12)


@pytest.mark.parametrize("joint", range(3))
def test_numbers_beside_bars_stay_within_their_panel(analysis, joint):
    names = tuple(f"{joint}_{'a' * 22}" for joint in "123")
    for sign in (1, -1):
        result = replace(analysis, values=sign * analysis.values, robot=replace(analysis.robot, joints=names))
        figure = result.figure(f"causes:{names[joint]}")
        figure.draw_without_rendering()
        for panel in figure.axes[1:]:
            inside = panel.get_window_extent()
            for label in panel.texts:
                assert inside.x0 < label.get_window_extent().x0
                assert label.get_window_extent().x1 < inside.x1


@pytest.mark.parametrize(
    ("phase", "message"),
    [
        ("stance=shove", "--phase stance=shove: no load, contact or column 'shove'; there are push, time"),
        ("stance", "write it as NAME=LOAD"),
        ("stance/=push", "write it as NAME=LOAD"),
        ("stance=push>hard", "write it as NAME=LOAD"),
        ("late=9..12", "--phase: late has no sample between 0 and 3.99 s"),
        ("still=push>31", "--phase: still has no sample"),
    ],
)
def test_phases_that_are_not_there_are_named(pushed, phase, message):
    path, push, _ = pushed
    with pytest.raises(LinkwiseError, match=re.escape(message)):
        analyze(path, PLANAR3, Reading(ignore_extra=True), loads=[push], phases=[phase]).figure("causes")


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
    assert curves.get_ylabel() == "W"
    figure.draw_without_rendering()


def test_power_of_many_joints_names_the_largest_and_adds_up_the_rest(analysis, monkeypatch):
    monkeypatch.setattr("linkwise.analysis.show.power_figure.MOST", 1)
    monkeypatch.setattr("linkwise.analysis.show.power_figure.LINKS", 1)
    curves, bars = analysis.figure("power").axes
    work = analysis.joint_work
    most = int((work.given + work.taken).argmax())
    order = [most, *(i for i in range(3) if i != most)]
    drawn = curves.lines[:-1]
    np.testing.assert_array_equal([line.get_ydata() for line in drawn], analysis.joint_power.T[order])
    assert len({line.get_color() for line in drawn}) == 2
    assert [text.get_text() for text in curves.get_legend().get_texts()] == [JOINTS[most], "2 others"]
    sizes = analysis.work.given + analysis.work.taken
    link = int((sizes / sizes.sum(axis=1, keepdims=True)).sum(axis=0).argmax())
    named = ["net", f"link{link + 1}", "2 others"]
    assert [text.get_text() for text in bars.get_legend().get_texts()] == named
    given = np.array([[patch.get_width() for patch in bar] for bar in bars.containers[:2]])
    rest = np.delete(analysis.work.given, link, axis=1).sum(axis=1)
    np.testing.assert_allclose(given, [analysis.work.given[:, link], rest], rtol=1e-14)


def test_others_are_never_one_alone():
    assert largest_few([3, 1, 2], 1) == ([0], [1, 2])
    assert largest_few([3, 1, 2], 2) == ([0, 1, 2], [])


def test_unknown_figures_are_named(analysis):
    with pytest.raises(LinkwiseError, match="--figure shares:joint1"):
        analysis.figure("shares:joint1")


def test_poses_of_the_planar_arm():
    q = smooth(10, 3)[:, 1:]
    origins, centres = stick_figure(load_robot(PLANAR3), q)
    angle = np.cumsum(q, axis=1)
    steps = 0.25 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    joints = np.concatenate([np.zeros((10, 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    np.testing.assert_allclose(origins, joints[:, :-1], atol=1e-15)
    np.testing.assert_allclose(centres, (joints[:, :-1] + joints[:, 1:]) / 2, atol=1e-15)


def test_poses_of_a_slide_on_a_turned_frame(tmp_path):
    turned = {"rpy": f"{np.pi / 2} 0 {np.pi / 2}"}  # its z axis is the parent's x
    slide = urdf_text.joint("a", "base", "a", type="prismatic", xyz="0 1 0", axis="0 0 1", **turned)
    crank = urdf_text.joint("b", "a", "b", xyz="0 0 1", rpy="0 0 0", axis="0 0 -1")
    places = {"base": "0 0 0", "a": "0 0 3", "b": "1 0 0"}
    links = [urdf_text.link(name).replace("0.1 -0.02 0.05", place) for name, place in places.items()]
    (tmp_path / "slide.urdf").write_text(urdf_text.robot(*links, slide, crank))
    write_package(generate(read_system(tmp_path / "slide.urdf"), ["numpy"]), tmp_path / "slide")
    origins, centres = stick_figure(load_robot(tmp_path / "slide"), np.array([[1.0, np.pi / 2]]))
    np.testing.assert_allclose(origins[0], [[1, 1, 0], [2, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(centres[0], [[4, 1, 0], [2, 1, -1]], atol=1e-15)


def many(analysis, count=14):
    """Return the same numbers with as many names as asked for, one of 80 letters."""
    joints = tuple(f"joint{i}" if i else f"{'a_name_from_a_drawing_' * 4}0" for i in range(count))
    robot = replace(analysis.robot, joints=joints, links=joints, units=("rad",) * count, tree=None)
    own = [("q", (i,)) for i in range(count)] + [("tau", (i,)) for i in range(count)]
    rows = ResultRows.of(robot, [*own, *(("tau_link", (0, j)) for j in range(count))])
    values = analysis.values[1 + np.arange(3 * count) % 9] * np.linspace(1, 2, 3 * count)[:, None]
    sizes = np.abs(values)
    totals = Totals(sizes.mean(axis=1), sizes.max(axis=1), np.sqrt((values**2).mean(axis=1)))
    return replace(analysis, robot=robot, rows=rows, values=values, totals=totals)


def test_many_joints_get_a_legend_that_fits(analysis):
    figure = replace(many(analysis), values=np.abs(many(analysis).values)).figure("paper")
    figure.draw_without_rendering()
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
    assert 7 <= len(set(texts)) <= 8  # the most loaded joints, and the one that is drawn
    assert max(map(len, texts)) == 24
    assert f"thin: {14 - len(texts)} others" in figure.axes[5].get_legend().get_title().get_text()
    looks = {(line.get_color(), line.get_linestyle()) for line in figure.axes[0].lines[:-1]}
    assert len(looks) == len(texts) + 1


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
