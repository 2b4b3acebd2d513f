"""p corrected for several columns, effect sizes, and what a comparison calls different by its own p."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from linkwise.study.comparisons import compared, left_out_lines
from linkwise.study.corrections import corrected
from linkwise.study.effect_sizes import EffectSize
from linkwise.study.plan import Comparison
from linkwise.study.summary import TrialSummary
from linkwise.study.t_tests import told_p
from linkwise.study.tested_rows import rows_of_tests
from scipy import stats
from scipy.ndimage import gaussian_filter1d
from scipy.special import gammaln

P = [0.021, 0.001, 0.011, 0.2, 0.013, 0.04]
STATSMODELS = {
    "none": P,
    "bonferroni": [0.126, 0.006, 0.066, 1.0, 0.078, 0.24],
    "holm": [0.063, 0.006, 0.055, 0.2, 0.055, 0.08],
    "fdr-bh": [0.0315, 0.006, 0.026, 0.2, 0.026, 0.048],
}
"""Adjusted P by `multipletests` of statsmodels 0.15."""


@pytest.mark.parametrize("correction", STATSMODELS)
@pytest.mark.parametrize("alpha", [0.005, 0.05, 0.06, 0.07, 0.5])
def test_adjusted_p_are_those_of_statsmodels_and_each_own_p_is_held_to_its_level(
    correction: Any, alpha: float
) -> None:
    adjusted, levels = corrected(correction, P, alpha)
    np.testing.assert_allclose(adjusted, STATSMODELS[correction], rtol=1e-12)
    assert (np.less(P, levels) == (adjusted < alpha)).all()
    assert (levels <= alpha).all()


@pytest.mark.parametrize("is_paired", [True, False])
@pytest.mark.parametrize("d", [0.0, 0.8, -2.0])
def test_intervals_of_effects_hold_the_true_one_as_often_as_they_say(is_paired: bool, d: float) -> None:
    draw, inside, unbiased = np.random.default_rng(4), [], []
    for _ in range(1500):
        first, second = draw.normal(size=(2, 9))
        if is_paired:
            second = first - (d + draw.normal(size=9))
        else:
            first, second = first + d, second[:6]
        effect = EffectSize.of(first, second, is_paired, 0.9)
        is_g_inside = effect.effect_low < d * effect_scale(is_paired) < effect.effect_high
        inside.append([is_g_inside, effect.difference_low < d < effect.difference_high])
        unbiased.append(effect.effect)
    np.testing.assert_allclose(np.mean(inside, axis=0), 0.9, atol=0.025)
    np.testing.assert_allclose(np.mean(unbiased), d, atol=0.06)


def effect_scale(is_paired: bool) -> float:
    """Hedges' factor, exact: its interval is that of d, times the factor."""
    freedom = 8 if is_paired else 13
    return float(np.exp(gammaln(freedom / 2) - gammaln((freedom - 1) / 2)) / np.sqrt(freedom / 2))


def test_an_effect_is_known_from_its_t() -> None:
    """d = t / √n of paired subjects, t √(1/n1 + 1/n2) of others, by Student's t."""
    first, second = np.random.default_rng(2).normal(size=(2, 7)) + np.array([[1.0], [0.2]])
    paired = EffectSize.of(first, second, True, 0.95)
    d = stats.ttest_rel(first, second).statistic / np.sqrt(7)
    assert paired.effect == pytest.approx(d * 0.8686, rel=1e-4), "J of 6, Γ(3) / √3 Γ(2.5)"
    others = EffectSize.of(first, second[:5], False, 0.95)
    d = stats.ttest_ind(first, second[:5]).statistic * np.sqrt(1 / 7 + 1 / 5)
    assert others.effect == pytest.approx(d * 0.9228, rel=1e-4), "J of 10, Γ(5) / √5 Γ(4.5)"
    for effect, test in (
        (paired, stats.ttest_rel(first, second)),
        (others, stats.ttest_ind(first, second[:5], equal_var=False)),
    ):
        low, high = test.confidence_interval(0.95)
        assert (effect.difference_low, effect.difference_high) == pytest.approx((low, high), rel=1e-12)


COLUMNS = {"hip": 1.3, "knee": 0.75, "ankle": 0.72, "toe": 0.0}
"""Mean difference of each column, in standard deviations."""


def trials(points: int = 1, lone: Sequence[str] = ()) -> list[TrialSummary]:
    """Ten subjects, slow and fast, and others who were only fast."""
    draw, found = np.random.default_rng(12), []
    who = [f"S{at}" for at in range(10)]
    for level, subjects in (("slow", who), ("fast", [*who, *lone])):
        for subject in subjects:
            curves = {
                f"tau/{name}": gaussian_filter1d(draw.standard_normal(points), 8) * (3 if points > 1 else 1)
                + (level == "slow") * shift
                for name, shift in COLUMNS.items()
            }
            means = {name: np.full(5, curve.mean()) for name, curve in curves.items()}
            units = dict.fromkeys(curves, "N·m")
            own = curves if points > 1 else {}
            labels = {"subject": subject, "pace": level}
            found.append(TrialSummary(f"{level}{subject}", labels, units, means, own, 1))
    return found


@pytest.mark.parametrize("correction", STATSMODELS)
def test_means_differ_by_the_corrected_p_of_their_family(correction: Any) -> None:
    some, rest = (
        Comparison("pace", ("slow", "fast"), names, correct=correction, alpha=0.1, family="all")
        for names in (("tau/hip", "tau/knee"), ("tau/ankle", "tau/toe"))
    )
    tests, told = compared([some, rest], trials())
    assert told == ()
    own = {
        name: stats.ttest_rel(*(sides(trials(), level, name) for level in ("slow", "fast"))).pvalue
        for name in (f"tau/{name}" for name in COLUMNS)
    }
    assert {test.column: test.p for test in tests} == pytest.approx(own, rel=1e-9)
    expected = corrected(correction, list(own.values()), 0.1)
    assert [test.adjusted for test in tests] == pytest.approx(expected.adjusted.tolist(), rel=1e-9)
    assert [bool(test.clusters) for test in tests] == [p < 0.1 for p in expected.adjusted]
    rows = list(rows_of_tests(tests))
    assert [row["differs"] for row in rows] == [p < 0.1 for p in expected.adjusted]
    assert {(row["correction"], row["columns_corrected_for"]) for row in rows} == {(correction, 4)}


def sides(every: Sequence[TrialSummary], level: str, name: str) -> list[float]:
    return [one.statistics[name][0] for one in every if one.labels["pace"] == level]


def test_curves_are_held_to_the_level_of_their_correction_by_spm1d() -> None:
    spm = pytest.importorskip("spm1d").stats
    asked = Comparison("pace", ("slow", "fast"), ("tau/*",), correct="bonferroni")
    tests, told = compared([asked], trials(101))
    assert (told, len(tests)) == ((), 4)
    for test in tests:
        first, second = (
            np.array([one.curves[test.column] for one in trials(101) if one.labels["pace"] == level])
            for level in ("slow", "fast")
        )
        field = spm.ttest_paired(first, second)
        inferred = field.inference(0.05 / 4, two_tailed=True)
        assert test.threshold == pytest.approx(inferred.zstar, rel=1e-9)
        parts = [c.endpoints for c in inferred.clusters if c.P < 0.05 / 4]
        found = [(c.start, c.end) for c in test.clusters]
        np.testing.assert_allclose(np.reshape(found, (-1, 2)), np.reshape(parts, (-1, 2)))
        # The field-wide p of the largest |t| is the level whose threshold that is.
        if 1e-6 < test.p < 0.9:
            assert field.inference(test.p, two_tailed=True).zstar == pytest.approx(
                np.abs(field.z).max(), rel=1e-4
            )
        at, effect = test.effect(test.clusters[0] if test.clusters else None)
        there = round(at)
        assert effect.difference == pytest.approx(first[:, there].mean() - second[:, there].mean())
    assert [bool(test.clusters) for test in tests] == [test.adjusted < 0.05 for test in tests]
    assert 0 < sum(bool(test.clusters) for test in tests) < 4


def test_what_exceeds_the_threshold_too_briefly_is_told_and_not_called_different() -> None:
    pytest.importorskip("spm1d")
    noise = np.random.default_rng(7)
    first, second = (gaussian_filter1d(noise.standard_normal((10, 101)), 1, axis=1) for _ in range(2))
    every = [
        TrialSummary(
            f"{level}{at}", {"subject": f"S{at}", "pace": level}, {"tau": "N·m"}, {}, {"tau": one}, 1
        )
        for level, curves in (("slow", first + 0.3), ("fast", second))
        for at, one in enumerate(curves)
    ]
    ((test,), _) = compared([Comparison("pace", ("slow", "fast"), ("tau",))], every)
    assert test.brief
    rows = {(row["start"], row["end"]): row for row in rows_of_tests([test])}
    assert len(rows) == len(test.brief) + len(test.clusters)
    for part in test.brief:
        row = rows[part.start, part.end]
        assert (row["differs"], row["p"]) == (False, part.p)
        assert part.p >= 0.05 or part.start == part.end
        place = np.linspace(0, 100, 101)
        assert np.abs(test.statistic[(place >= part.start) & (place <= part.end)]).max() > test.threshold


def test_subjects_on_one_side_only_are_named() -> None:
    tests, _ = compared([Comparison("pace", ("slow", "fast"), ("tau/*",))], trials(lone=("eve", "gus")))
    assert {test.left_out for test in tests} == {("eve", "gus")}
    (line,) = left_out_lines(tests)
    assert "'eve', 'gus' left out, who have not both 'slow' and 'fast'" in line
    assert {row["left_out"] for row in rows_of_tests(tests)} == {"eve, gus"}


@pytest.mark.parametrize(
    ("p", "level", "said"),
    [
        (0.0, 0.05, "< 0.001"),
        (0.00099, 0.05, "< 0.001"),
        (0.001, 0.05, "0.001"),
        (0.0462, 0.05, "0.046"),
        (0.04996, 0.05, "0.04996"),
        (0.0004, 0.0005, "< 0.0005"),
        (0.0009, 0.0005, "0.0009"),
        (np.nan, 0.05, ""),
    ],
)
def test_no_p_is_told_as_zero_nor_as_its_level(p: float, level: float, said: str) -> None:
    assert told_p(p, level) == said
