"""A study's figures of causes: means of net torques as pandas has them, conditions side by side."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from helpers.studies import CHOICES, CYCLES, HEAD, TRIALS, Here, write_study
from linkwise import LinkwiseError
from linkwise.study import run_study
from linkwise.study.file import read_study

FIGURE = '\n[[figure]]\ncolumns = ["causes:joint1"]\nby = "condition"\n'
TESTED = '\n[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\ncolumns = ["tau_by/joint1/*"]\n'


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Figures that are saved."""
    kept: list[Any] = []
    monkeypatch.setattr("linkwise.study.band_figure.saved", lambda one, kind: kept.append(one) or b"")
    return kept


def test_curves_are_pandas_means_of_what_all_links_and_orders_sum_to(
    drawn: list[Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("spm1d")
    monkeypatch.setattr("linkwise.study.causes_figure.MOST", 2)
    kept = 'pages = false\ncolumns = ["tau_qdd/joint1/**", "tau_qd/joint1/**", "tau_gravity/joint1/*"]\n'
    study = write_study(tmp_path, HEAD, kept, CHOICES, CYCLES, FIGURE, TESTED, TRIALS, subjects=3)
    outcome = run_study(study, tmp_path / "out", Here())
    assert not outcome.broken
    assert {"causes-joint1.svg", "tests.parquet"} <= {file.name for file in outcome.files}
    table = pd.read_parquet(tmp_path / "out" / "trials")
    assert not any(name.startswith("tau_by") for name in table)
    parts = {
        "gravity": table.filter(like="tau_gravity/").sum(axis=1),
        **{
            f"joint{k} motion": table.filter(regex=f"tau_q(?:dd|d)/.*/joint{k}$").sum(axis=1)
            for k in (1, 2, 3)
        },
    }
    by = ["condition", "subject", "trial", "percent"]
    means = pd.concat([table[["condition", "subject", "trial", "percent"]], pd.DataFrame(parts)], axis=1)
    for over in (by, by[:2] + by[3:], by[:1] + by[3:]):
        means = means.groupby(over, observed=True)[list(parts)].mean().reset_index()
    sizes = means[list(parts)].abs().mean().sort_values(ascending=False)
    first, rest = list(sizes.index[:2]), list(sizes.index[2:])
    panels = [axis for axis in drawn[0].axes if axis.get_title(loc="left") or axis.get_title()]
    titles = [axis.get_title(loc="left") or axis.get_title() for axis in panels]
    assert titles == ["joint1 · fast", "joint1 · slow"]
    for axis, level in zip(panels, ("fast", "slow"), strict=True):
        lines = {line.get_label(): line.get_ydata() for line in axis.lines[:-1]}
        assert list(lines) == ["all causes together", *first, "all others together"]
        own = means[means.condition == level].sort_values("percent")
        expected = {"all causes together": list(parts), "all others together": rest} | {c: [c] for c in first}
        for label, names in expected.items():
            np.testing.assert_allclose(lines[label], own[names].sum(axis=1), rtol=0, atol=1e-5)
        assert len(axis.collections) == 4  # a band about each
        assert axis.patches  # where the test finds a difference
    tests = pd.read_parquet(tmp_path / "out" / "tests.parquet")
    assert set(tests.column) == {
        "tau_by/joint1/gravity",
        *(f"tau_by/joint1/joint{k}" for k in (1, 2, 3)),
    }


@pytest.mark.parametrize("cycles", [CYCLES, ""])
def test_bands_of_one_subject_are_over_its_trials_and_say_so(
    cycles: str, drawn: list[Any], tmp_path: Path
) -> None:
    kept = 'pages = false\ncolumns = ["tau/joint1"]\n'
    study = write_study(tmp_path, HEAD, kept, CHOICES, cycles, FIGURE, TRIALS, subjects=1)
    assert not run_study(study, tmp_path / "out", Here()).broken
    assert "Filled: ± sd over trials of one subject." in drawn[0].get_supxlabel().replace("\n", " ")
    table = pd.read_parquet(tmp_path / "out" / "trials")
    trials = table.groupby(["condition", "trial", *(["percent"] if cycles else [])], observed=True)
    spread = trials["tau/joint1"].mean().loc["slow"].groupby("percent" if cycles else lambda _: 0)
    edges = drawn[0].axes[1].collections[0].get_paths()[0].vertices[:, 1]  # slow, all causes together
    expected = (spread.mean() - spread.std()).min(), (spread.mean() + spread.std()).max()
    np.testing.assert_allclose((edges.min(), edges.max()), expected, rtol=0, atol=1e-6)


def test_without_cycles_means_stand_beside_each_other(drawn: list[Any], tmp_path: Path) -> None:
    study = write_study(tmp_path, HEAD, "pages = false\n", CHOICES, FIGURE, TRIALS)
    assert not run_study(study, tmp_path / "out", Here()).broken
    labels = drawn[0].axes[0].get_legend_handles_labels()[1]
    assert labels[0] == "all causes together"
    assert {"gravity", "joint2 motion"} <= set(labels)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (
            '["causes:joint9"]',
            r"trial 'S1-fast-1': \[\[figure\]\]: 'columns' has 'causes:joint9', and the robot has no such"
            r" joint; nearest are 'joint1'",
        ),
        (
            '["causes:joint1", "tau/*"]',
            "'columns' has causes:joint1 beside others; draw causes in a figure of",
        ),
    ],
)
def test_a_joint_that_is_not_there_and_a_mixture_are_refused(
    columns: str, message: str, tmp_path: Path
) -> None:
    figure = f'\n[[figure]]\ncolumns = {columns}\nby = "condition"\n'
    study = write_study(tmp_path, HEAD, "pages = false\n", CHOICES, CYCLES, figure, TRIALS)
    with pytest.raises(LinkwiseError, match=message):
        run_study(study, tmp_path / "out", Here())


def test_trials_compute_what_the_study_tells_of_and_no_more(tmp_path: Path) -> None:
    narrow = '\n[analysis]\nignore_extra = true\ncolumns = ["sums"]\n'
    study = write_study(tmp_path, HEAD, "pages = false\n", narrow, CYCLES, FIGURE, TRIALS)
    computed = {trial.choices.outputs.columns for trial in read_study(study).trials}
    assert computed == {("sums", "tau_by/joint1/*")}
    without = write_study(tmp_path, HEAD, "pages = false\n", narrow, CYCLES, TRIALS)
    assert {trial.choices.outputs.columns for trial in read_study(without).trials} == {("sums",)}
