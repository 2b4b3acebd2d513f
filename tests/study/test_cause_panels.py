"""Look of a study's figures of causes: words, bands of one subject, journal widths, marks of tests."""

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

CURVES = {"gravity": [1.0, 2.0, 3.0], "hip_r": [-4.0, 5.0, 6.0], "load:plate": [0.5, 0.0, 0.5]}
WORDS = {
    "knee_r": MotionWords("right knee", "flexion", "extension"),
    "hip_r": MotionWords("right hip", "flexion", "extension"),
}


def trials(subjects: tuple[str, ...], words: dict[str, MotionWords] | None = None) -> list[TrialSummary]:
    """Two trials in each of two conditions, the second one twice the first."""
    found = []
    for level in ("slow", "fast"):
        for number, subject in enumerate(subjects, 1):
            curves = {f"tau_by/knee_r/{by}": number * np.array(one) for by, one in CURVES.items()}
            curves["tau/knee_r"] = np.sum(list(curves.values()), axis=0)
            means = {name: np.full(len(STATISTICS), one.mean()) for name, one in curves.items()}
            labels = {"subject": subject, "condition": level}
            units = dict.fromkeys(curves, "N·m")
            name = f"{level}-{number}"
            found.append(TrialSummary(name, labels, units, means, curves, 1, words=words or {}))
    return found


@pytest.fixture
def drawn_of(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the figure of causes of `knee_r` that is drawn of trials, tests and keys."""

    def drawn(of: list[TrialSummary], tests: tuple[Compared, ...] = (), **keys: Any) -> Any:
        kept: list[Any] = []
        monkeypatch.setattr("linkwise.study.band_figure.saved", lambda one, kind: kept.append(one) or b"")
        list(figure_files(PaperFigure(("causes:knee_r",), "condition", **keys), of, tests))
        return kept[0]

    return drawn


def test_a_persons_joints_and_causes_are_words_and_names_go_before_them(drawn_of: Any) -> None:
    axes = drawn_of(trials(("ann", "bob"), WORDS)).axes
    assert [axis.get_title("left") for axis in axes] == ["right knee · slow", "right knee · fast"]
    assert axes[0].get_ylabel() == "N·m\nflexion +, extension −"
    own = axes[0].get_legend_handles_labels()[1]
    assert own == ["all causes together", "right hip motion", "gravity", "load plate"]
    names = {"tau_by/knee_r/hip_r": "swing of the thigh", "tau/knee_r": "moment", "knee_r": "Knee"}
    axes = drawn_of(trials(("ann", "bob"), WORDS), names=names).axes
    assert axes[0].get_title("left") == "Knee · slow"
    own = axes[0].get_legend_handles_labels()[1]
    assert own == ["moment", "swing of the thigh", "gravity", "load plate"]


def test_bands_of_one_subject_are_over_trials_and_say_so(drawn_of: Any) -> None:
    several, one = (drawn_of(trials(who)) for who in (("ann", "bob"), ("ann", "ann")))
    assert "Filled: ± sd between subjects." in several.get_supxlabel().replace("\n", " ")
    assert "Filled: ± sd over trials of one subject." in one.get_supxlabel().replace("\n", " ")
    corners = one.axes[0].collections[1].get_paths()[0].vertices
    curve = np.outer([1, 2], CURVES["hip_r"])
    for at, place in enumerate((0, 50, 100)):
        here = corners[corners[:, 0] == place, 1]
        middle, spread = curve[:, at].mean(), curve[:, at].std(ddof=1)
        np.testing.assert_allclose([here.min(), here.max()], [middle - spread, middle + spread])


def test_in_one_column_of_a_journal_nothing_covers_anything(drawn_of: Any) -> None:
    figure = drawn_of(trials(("ann", "bob"), WORDS), size="single")
    figure.draw_without_rendering()
    first, second = figure.axes
    boxes = [axis.get_tightbbox() for axis in (first, second)]
    assert boxes[0].y0 >= boxes[1].y1 - 1  # below each other, axes' labels and the legend included
    assert first.get_ylim() == second.get_ylim()
    note = figure._supxlabel.get_window_extent()
    assert note.y1 <= second.get_legend().get_window_extent().y0
    for box in (*boxes, note):
        assert box.x0 >= -1
        assert box.x1 <= figure.bbox.x1 + 1


def of_test(column: str, *parts: Cluster) -> Compared:
    asked = Comparison("condition", ("slow", "fast"), (column,))
    sides = (Spread((), np.empty((0, 3)), np.empty((0, 3))),) * 2
    return Compared(asked, column, "N·m", sides, np.zeros(3), 2.0, 0.5, parts)


def test_marks_stand_on_the_floor_and_below_all_curves(drawn_of: Any) -> None:
    tests = (
        of_test("tau_by/knee_r/gravity"),
        of_test("tau_by/knee_r/hip_r", Cluster(10, 30, 0.01)),
        of_test("tau/knee_r", Cluster(40, 50, 0.01)),
    )
    figure = drawn_of(trials(("ann", "bob")), tests, band="none")
    assert "Bars below" in figure.get_supxlabel()
    for axis in figure.axes:
        marks = [(bar.get_x(), bar.get_y()) for bar in axis.patches]
        assert [at for at, _ in marks] == [10, 40]
        assert marks[0][1] == 0.0
        low, high = axis.get_ylim()
        top = low + (high - low) * max(bar.get_y() + bar.get_height() for bar in axis.patches)
        assert top < min(np.min(line.get_ydata()) for line in axis.lines)
    assert "Bars below" not in drawn_of(trials(("ann", "bob")), tests[:1]).get_supxlabel()


@pytest.mark.parametrize("hatched", ["mean", "new"])
def test_hatched_bands_of_causes_are_refused(hatched: Any) -> None:
    with pytest.raises(LinkwiseError, match="figures of causes have no hatched bands; draw columns such as"):
        PaperFigure(("causes:knee_r",), hatched=hatched)


def test_titles_fit_their_panels_and_tell_forces_and_causes(monkeypatch: pytest.MonkeyPatch) -> None:
    words = {"knee_r": MotionWords("ipsilateral knee", "flexion", "extension")}
    words["hip_r"] = MotionWords("pelvis", "posterior tilt", "anterior tilt")
    words["up"] = MotionWords("pelvis", "up", "down")
    several = trials(("ann", "bob"), words)
    several = [
        replace(one, units={**one.units, "tau/up": "N/kg"}, curves={**one.curves, "tau/up": np.ones(3)})
        for one in several
    ]
    kept: list[Any] = []
    monkeypatch.setattr("linkwise.study.band_figure.saved", lambda one, kind: kept.append(one) or b"")
    list(figure_files(PaperFigure(("tau_by/knee_r/*", "tau/up"), formats=("png",)), several, ()))
    kept[0].draw_without_rendering()
    axes = [axis for axis in kept[0].axes if axis.lines]
    titles = [axis.get_title("left") for axis in axes]
    assert [one.replace("\n", " ") for one in titles] == [
        "ipsilateral knee torque by gravity",
        "ipsilateral knee torque by pelvis posterior tilt motion",
        "ipsilateral knee torque by load plate",
        "pelvis up force",
    ]
    for axis in axes:
        assert axis._left_title.get_window_extent().width < axis.get_window_extent().width * 1.1
