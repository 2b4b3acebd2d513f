"""Closing sums of rows: all at once what each is alone, also where a movement begins from rest."""

import numpy as np
import pytest
from helpers.motion_logs import PUMA560
from linkwise.analysis.closing_sums import SIZED, ClosingSums
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.result_rows import ResultRows, torque_places
from linkwise.analysis.term_rows import term_rows

SAMPLES = 4 * SIZED


@pytest.fixture(scope="module")
def rows() -> ResultRows:
    robot = load_robot(PUMA560, "numpy")
    return ResultRows.of(robot, torque_places(robot, term_rows(robot.model.layout)))


@pytest.mark.parametrize("rest", [0.0, 1e-13, 1.0])
@pytest.mark.parametrize("error", [0.0, 1e-14, 1e-3])
def test_errors_and_sizes_are_those_of_each_sum(rows: ResultRows, rest: float, error: float) -> None:
    parts = ("tau_qdd", "tau_qd", "tau_gravity")
    sums = ClosingSums(["rad"] * 6, rows, "tau_link", *parts)
    out = np.random.default_rng(3).normal(size=(len(rows), SAMPLES))
    out[:, :SIZED] *= rest
    for row, (i, j) in rows["tau_link"].listed():
        out[row] = out[rows.numbers(*parts, joint=i, link=j)].sum(axis=0)
        out[row, -1] += error
    errors, sizes = sums.residuals(out)
    assert len(sums.sums) == len(rows["tau_link"].numbers)
    magnitudes = [np.abs(out[list(one.parts)]).sum(axis=0) for one in sums.sums]
    for one, found in zip(sums.sums, errors, strict=True):
        apart = out[list(one.parts)].sum(axis=0) - out[one.whole]
        assert found == pytest.approx(np.abs(apart).max(), abs=1e-14)
    # Sizes of a few samples are too small only where that calls no error large.
    seen = SIZED if error <= 1e-13 * rest else SAMPLES
    np.testing.assert_allclose(sizes, [most[:seen].max() for most in magnitudes], rtol=1e-12)
    assert (errors <= max(1e-12, 2 * error) * sizes).all()


def test_an_error_that_is_not_a_number_is_told(rows: ResultRows) -> None:
    sums = ClosingSums(["rad"] * 6, rows, "tau_link", "tau_gravity")
    out = np.ones((len(rows), SAMPLES))
    out[rows["tau_link"].numbers[0], 5] = np.nan
    errors, _ = sums.residuals(out)
    assert np.isnan(errors).sum() == 1
