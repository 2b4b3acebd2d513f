"""Statistics over blocks are those of all samples, however these are cut."""

import numpy as np
import pytest
from linkwise.study.summary import STATISTICS, RunningMoments

ROWS = np.random.default_rng(0).normal(size=(3, 1500)) * [[1.0], [1e-3], [20.0]] + [[0.5], [1e4], [-3.0]]
EXPECTED = {
    "mean": ROWS.mean(axis=1),
    "std": ROWS.std(axis=1),
    "min": ROWS.min(axis=1),
    "max": ROWS.max(axis=1),
    "rms": np.sqrt((ROWS**2).mean(axis=1)),
}


@pytest.mark.parametrize("size", [1, 700, 1500])
def test_they_are_those_of_all_samples_a_small_deviation_on_a_large_mean_too(size: int) -> None:
    moments = RunningMoments(len(ROWS))
    moments(ROWS[:, :0])
    for at in range(0, ROWS.shape[1], size):
        moments(ROWS[:, at : at + size])
    assert moments.count == ROWS.shape[1]
    for found, (name, expected) in zip(moments.table, EXPECTED.items(), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9, err_msg=name)
    assert tuple(EXPECTED) == STATISTICS
