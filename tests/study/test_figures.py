"""A study's figures for papers: whose curves, which band, and the tests that are about them."""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from linkwise.analysis.motion_words import MotionWords
from linkwise.errors import LinkwiseError
from linkwise.study.band_figure import figure_files
from linkwise.study.comparisons import Cluster, Compared
from linkwise.study.plan import Comparison, PaperFigure
from linkwise.study.spread import Spread
from linkwise.study.summary import STATISTICS, TrialSummary

LEVELS = {"slow": [[1.0, 2.0, 3.0], [3.0, 4.0, 8.0]], "fast": [[5.0, 5.0, 5.0], [6.0, 9.0, 5.0]]}
"""Curves of two subjects by condition."""


def trials(points: int = 3) -> list[TrialSummary]:
    """Each subject's trial in each condition; of one point, without cycles."""
    found = []
    for level, curves in LEVELS.items():
        for subject, curve in enumerate(curves):
            labels = {"subject": f"S{subject}", "condition": level, "day": f"{subject}"}
            of_mean = {"tau/hip": np.full(len(STATISTICS), np.mean(curve))}
            of_cycle = {"tau/hip": np.array(curve)} if points > 1 else {}
            found.append(
                TrialSummary(f"{level}-{subject}", labels, {"tau/hip": "N·m"}, of_mean, of_cycle, points > 1)
            )
    return found


def about(factor: str, column: str, start: float) -> Compared:
    """A test that found ten per cent of the cycle."""
    asked = Comparison(factor, ("slow", "fast"), (column,))
    sides = (Spread((), np.empty((0, 3)), np.empty((0, 3))),) * 2
    parts = (Cluster(start, start + 10, 0.01),)
    return Compared(asked, column, "N·m", sides, np.zeros(3), 2.0, float("nan"), parts)


@pytest.fixture
def drawn_of(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The axis of a figure of one panel, and the names of its files."""

    def drawn(figure: PaperFigure, of: Sequence[TrialSummary], tests: Sequence[Compared] = ()) -> Any:
        kept: list[Any] = []
        monkeypatch.setattr("linkwise.study.band_figure.saved", lambda one, kind: kept.append(one) or b"")
        names = [name for name, _ in figure_files(figure, of, tests)]
        return kept[0].axes[0], names

    return drawn


def band_of(axis: Any, number: int) -> np.ndarray:
    """Lower and upper edge of a band, by its corners."""
    corners = axis.collections[number].get_paths()[0].vertices
    return np.array(
        [[corners[corners[:, 0] == x, 1].min(), corners[corners[:, 0] == x, 1].max()] for x in (0, 50, 100)]
    ).T


@pytest.mark.parametrize(
    ("band", "of_slow"),
    [
        ("deviation", np.array([[2, 3, 5.5]]) + np.outer([-1, 1], np.sqrt([2, 2, 12.5]))),
        ("range", np.array([[1, 2, 3], [3, 4, 8]])),
        ("none", None),
    ],
)
def test_each_level_has_its_subjects_mean_and_band(drawn_of: Any, band: Any, of_slow: Any) -> None:
    axis, names = drawn_of(PaperFigure(("tau/hip",), "condition", band=band), trials())
    assert names == ["tau-hip.svg", "tau-hip.pdf"]
    assert [line.get_label() for line in axis.lines] == ["slow", "fast"]
    for line, curves in zip(axis.lines, LEVELS.values(), strict=True):
        np.testing.assert_allclose(line.get_xdata(), [0, 50, 100])
        np.testing.assert_allclose(line.get_ydata(), np.mean(curves, axis=0))
    if of_slow is None:
        assert not axis.collections
    else:
        np.testing.assert_allclose(band_of(axis, 0), of_slow)
    assert axis.get_ylabel() == "N·m"


def test_a_figure_has_its_own_words_order_unit_and_size(drawn_of: Any) -> None:
    names = {"tau/hip": "Load of the hip", "fast": "quickly", "condition": "pace"}
    asked = PaperFigure(
        ("tau/hip",),
        "condition",
        title="Two paces",
        names=names,
        order=("fast",),
        size="120 mm",
        unit="kN·m",
        formats=("eps",),
    )
    axis, files = drawn_of(asked, trials())
    assert files == ["tau-hip.eps"]
    assert axis.figure.get_suptitle() == "Two paces"
    assert axis.figure.get_figwidth() == pytest.approx(120 / 25.4)
    assert axis.figure.get_figheight() == pytest.approx(1.2 * 2.3 + 0.3), "a wide panel is not as much higher"
    assert (axis.get_title("left"), axis.get_ylabel()) == ("Load of the hip", "kN·m")
    assert axis.get_legend().get_title().get_text() == "pace"
    assert [line.get_label() for line in axis.lines] == ["quickly", "slow"]
    np.testing.assert_allclose(axis.lines[0].get_ydata(), np.mean(LEVELS["fast"], axis=0) / 1000)


def test_labels_are_words_with_signs_where_all_models_agree(drawn_of: Any) -> None:
    words = MotionWords("right hip", "flexion", "extension")
    told = [replace(trial, words={"hip": words}) for trial in trials()]
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition"), told)
    assert axis.get_title("left") == "right hip torque"
    assert axis.get_ylabel() == "N·m\nflexion +, extension −"
    other = replace(told[0], words={"hip": MotionWords("right hip", "extension", "flexion")})
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition"), [other, *told[1:]])
    assert (axis.get_title("left"), axis.get_ylabel()) == ("hip torque", "N·m")


def test_what_muscles_leave_of_a_torque_is_called_so(drawn_of: Any) -> None:
    muscled = [replace(trial, units={**trial.units, "tau_before_muscles/hip": "N·m"}) for trial in trials()]
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition"), muscled)
    assert axis.get_title("left") == "hip torque left by muscles"


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"unit": "deg"}, "what is in N·m cannot become it; it may be 'kN·m'"),
        ({"order": ("quick",)}, "'order' has 'quick', which no trial is; there are 'slow', 'fast'"),
    ],
)
def test_what_a_figure_cannot_have_is_refused(keys: dict[str, Any], told: str) -> None:
    with pytest.raises(LinkwiseError, match=re.escape(told)):
        list(figure_files(PaperFigure(("tau/hip",), "condition", **keys), trials(), ()))


@pytest.mark.parametrize("size", ["wide", "30 mm", "nan", "-90 mm"])
def test_a_size_is_a_width(size: str) -> None:
    with pytest.raises(LinkwiseError, match="give single or double, or a width of 40 to 500 mm"):
        PaperFigure(("tau/hip",), size=size)


def test_eps_has_opaque_bands_and_no_date() -> None:
    asked = PaperFigure(("tau/hip",), "condition", formats=("eps", "svg"))
    first, again = (dict(figure_files(asked, trials(), ())) for _ in range(2))
    assert list(first) == ["tau-hip.eps", "tau-hip.svg"]
    assert first == again
    assert b"CreationDate" not in first["tau-hip.eps"]
    assert b"fill-opacity: 0.2" in first["tau-hip.svg"]


def test_bars_are_the_tests_of_its_own_factor_and_column(drawn_of: Any) -> None:
    tests = [
        about("day", "tau/hip", 10),
        about("condition", "tau/knee", 30),
        about("condition", "tau/hip", 60),
    ]
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition"), trials(), tests)
    assert [(bar.get_x(), bar.get_width()) for bar in axis.patches] == [(60, 10)]


def test_means_without_cycles_are_dots_with_their_deviation(drawn_of: Any) -> None:
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition"), trials(points=1))
    dots = [line for line in axis.lines if line.get_label() in LEVELS]
    assert [tick.get_text() for tick in axis.get_xticklabels()] == list(LEVELS)
    for at, (line, curves) in enumerate(zip(dots, LEVELS.values(), strict=True)):
        means = np.mean(curves, axis=1)
        np.testing.assert_allclose(line.get_ydata(), means)
        np.testing.assert_array_equal(line.get_xdata(), at)
        (bar,) = axis.containers[at].lines[2][0].get_segments()
        np.testing.assert_allclose(bar[:, 1], means.mean() + np.array([-1, 1]) * means.std(ddof=1))


def with_deviations(deviation: float) -> list[TrialSummary]:
    """The trials, each of one cycle, with a deviation of so much beside the curve."""
    found = trials()
    for trial in found:
        trial.curves["sd/tau/hip"] = np.full(3, deviation)
    return found


@pytest.mark.parametrize(
    ("hatched", "of_slow", "said"),
    [
        ("within", np.full(3, 0.5), "± sd within a trial"),
        ("mean", np.sqrt(np.array([2, 2, 12.5]) / 2 + 0.25), "± sd of the mean"),
        ("new", np.sqrt(np.array([2, 2, 12.5]) * 1.5 + 0.25), "± sd of a new subject's truth"),
    ],
)
def test_what_is_uncertain_is_hatched_beside_the_spread(
    drawn_of: Any, hatched: Any, of_slow: Any, said: str
) -> None:
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition", hatched=hatched), with_deviations(0.5))
    filled, uncertain = axis.collections[:2]
    assert filled.get_hatch() is None
    assert uncertain.get_hatch() != axis.collections[3].get_hatch()
    np.testing.assert_allclose(band_of(axis, 1), np.array([[2, 3, 5.5]]) + np.outer([-1, 1], of_slow))
    (legend,) = axis.figure.legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts[0] == "filled: ± sd between subjects"
    assert said in texts[1]


def test_nothing_is_hatched_where_it_is_left_out(drawn_of: Any) -> None:
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition", hatched="none"), with_deviations(0.5))
    assert [band.get_hatch() for band in axis.collections] == [None, None]
    (legend,) = axis.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["filled: ± sd between subjects"]


def test_a_bar_of_a_test_is_told(drawn_of: Any) -> None:
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition"), trials(), [about("condition", "tau/hip", 10)])
    texts = [text.get_text() for text in axis.figure.legends[0].get_texts()]
    assert texts == [
        "filled: ± sd between subjects",
        "bar at the bottom: there the levels differ,\nby the test",
    ]


@pytest.mark.parametrize("columns", [("tau/hip", "peak/hip"), ("peak/hip", "tau/hip")])
def test_the_key_tells_of_dots_and_of_bands_whichever_comes_first(
    columns: tuple[str, ...], drawn_of: Any
) -> None:
    mixed = trials()
    for trial in mixed:
        trial.units["peak/hip"] = "N·m"
        trial.statistics["peak/hip"] = trial.statistics["tau/hip"]
    axis, _ = drawn_of(PaperFigure(columns, "condition"), mixed)
    assert [text.get_text() for text in axis.figure.legends[0].get_texts()] == [
        "dots: subjects; bars: ± sd over them",
        "filled: ± sd between subjects",
    ]


def of_one_subject(points: int = 3) -> list[TrialSummary]:
    """The trials, all of one subject."""
    return [replace(trial, labels=trial.labels | {"subject": "ann"}) for trial in trials(points)]


@pytest.mark.parametrize(
    ("band", "of_slow", "said"),
    [
        (
            "deviation",
            np.array([[2, 3, 5.5]]) + np.outer([-1, 1], np.sqrt([2, 2, 12.5])),
            "filled: ± sd over trials of one subject",
        ),
        ("range", np.array([[1, 2, 3], [3, 4, 8]]), "filled: range of trials of one subject"),
    ],
)
def test_the_band_of_one_subject_is_over_trials_and_says_so(
    drawn_of: Any, band: Any, of_slow: Any, said: str
) -> None:
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition", band=band), of_one_subject())
    np.testing.assert_allclose(band_of(axis, 0), of_slow)
    (legend,) = axis.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [said]


def test_means_of_one_subject_are_dots_of_trials_and_say_so(drawn_of: Any) -> None:
    axis, _ = drawn_of(PaperFigure(("tau/hip",), "condition"), of_one_subject(points=1))
    dots = [line for line in axis.lines if line.get_label() in LEVELS]
    for line, curves in zip(dots, LEVELS.values(), strict=True):
        np.testing.assert_allclose(line.get_ydata(), np.mean(curves, axis=1))
    (legend,) = axis.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "dots: trials of one subject; bars: ± sd over them"
    ]
