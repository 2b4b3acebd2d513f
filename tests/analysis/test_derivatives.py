"""Differentiation and filtering: right, exactly zero at rest, and the same for every block length."""

import numpy as np
import pytest
from helpers.motion_logs import smooth
from linkwise.analysis.filtering import FIRST, SECOND, derivatives, lowpass, padding_length
from linkwise.analysis.settings import Lowpass, Processing
from linkwise.errors import LinkwiseError
from scipy import signal

FIVE = Processing()
SAVGOL = Processing("savitzky-golay", window=9, degree=4)
SPLINE = Processing("spline")


def test_five_point_weights_are_those_of_taylor():
    for p in range(5):
        offsets = np.arange(5) - p
        powers = offsets ** np.arange(5)[:, None]
        np.testing.assert_array_equal(powers @ FIRST[p], [0, 12, 0, 0, 0])
        np.testing.assert_array_equal(powers @ SECOND[p], [0, 0, 24, 0, 0])


@pytest.mark.parametrize(("processing", "tolerance"), [(FIVE, 2e-4), (SAVGOL, 2e-2), (SPLINE, 1e-3)])
def test_derivatives_of_a_sine(processing, tolerance):
    t = np.arange(400) / 100
    q, qd, qdd = derivatives(np.sin(3 * t)[:, None], 100.0, 0, 400, processing)
    inner = slice(5, -5)
    np.testing.assert_allclose(q[inner, 0], np.sin(3 * t)[inner], atol=tolerance)
    np.testing.assert_allclose(qd[inner, 0], 3 * np.cos(3 * t)[inner], atol=tolerance)
    np.testing.assert_allclose(qdd[inner, 0], -9 * np.sin(3 * t)[inner], atol=tolerance)


def test_rest_is_exactly_zero():
    q = np.full((40, 2), [0.1, -0.7])
    q[25:, 1] += 0.3
    _, qd, qdd = derivatives(q, 100.0, 0, 40, FIVE)
    assert not qd[:, 0].any()
    assert not qdd[:, 0].any()
    assert not qd[:23, 1].any()
    assert not qdd[:23, 1].any()
    assert qd[23, 1] != 0


@pytest.mark.parametrize("processing", [FIVE, SAVGOL])
@pytest.mark.parametrize("rows", [1, 2, 7, 64])
def test_blocks_give_what_the_whole_gives(processing, rows):
    q = smooth(101, 3)[:, 1:]
    whole = derivatives(q, 100.0, 0, 101, processing)
    for start in range(0, 101, rows):
        stop = min(start + rows, 101)
        for part, full in zip(derivatives(q, 100.0, start, stop, processing), whole, strict=True):
            np.testing.assert_array_equal(part, full[start:stop])


@pytest.mark.parametrize("padding", ["odd", "even", "none"])
@pytest.mark.parametrize("rows", [1, 7, 100, 300])
def test_blocks_of_a_spline_give_what_the_whole_gives(padding: str, rows: int) -> None:
    how = Processing("spline", lowpass=Lowpass(6.0, 3, padding))
    q = smooth(301, 2)[:, 1:]
    whole = derivatives(q, 100.0, 0, 301, how)
    for start in range(0, 301, rows):
        stop = min(start + rows, 301)
        for part, full in zip(derivatives(q, 100.0, start, stop, how), whole, strict=True):
            np.testing.assert_allclose(part, full[start:stop], atol=1e-9 * np.abs(full).max())


def test_a_spline_goes_through_what_the_filter_continued_the_log_by() -> None:
    """A long log, of which the filter takes each end for the middle, and its spline there."""
    half = smooth(301, 2)[:, 1:]
    how = Processing("spline", lowpass=Lowpass(6.0, 3, "odd"))
    turned = np.concatenate([2.0 * half[0] - half[:0:-1], half])
    expected = [part[300:] for part in derivatives(turned, 100.0, 0, len(turned), SPLINE)]
    for part, full in zip(derivatives(half, 100.0, 0, 301, how), expected, strict=True):
        np.testing.assert_allclose(part[:200], full[:200], atol=1e-9 * np.abs(full).max())


@pytest.mark.parametrize("padding", ["odd", "even", "constant", "none"])
@pytest.mark.parametrize("order", [1, 2, 5])
@pytest.mark.parametrize("rows", [1, 13, 10_000])
def test_lowpass_is_sosfiltfilt(padding, order, rows):
    q = smooth(300, 2)[:, 1:]
    q += np.random.default_rng(0).normal(scale=0.01, size=q.shape)
    sos = signal.butter(order, 6.0, fs=100.0, output="sos")
    kind = None if padding == "none" else padding
    expected = signal.sosfiltfilt(sos, q, axis=0, padtype=kind, padlen=padding_length(sos, len(q)))
    lowpass(q, 100.0, Lowpass(6.0, order, padding), rows)
    np.testing.assert_allclose(q, expected, atol=1e-13)


@pytest.mark.parametrize("samples", [10, 30])
def test_a_log_shorter_than_the_filter_remembers_is_padded_by_all_but_one_of_it(samples):
    q = smooth(samples, 2)[:, 1:]
    sos = signal.butter(2, 6.0, fs=100.0, output="sos")
    expected = signal.sosfiltfilt(sos, q, axis=0, padlen=samples - 1)
    lowpass(q, 100.0, Lowpass(6.0))
    np.testing.assert_allclose(q, expected, atol=1e-13)


@pytest.mark.parametrize(("cutoff", "rate"), [(6.0, 100.0), (6.0, 1000.0), (1.0, 60.0)])
def test_a_straight_ramp_passes_to_its_ends(cutoff, rate):
    ramp = 1.3 * np.arange(601)[:, None] / rate
    q = ramp.copy()
    lowpass(q, rate, Lowpass(cutoff))
    np.testing.assert_allclose(q, ramp, atol=1e-6 * 1.3)


def test_lowpass_refuses_what_it_cannot():
    with pytest.raises(LinkwiseError, match="--cutoff 50 Hz is not below half the sampling rate"):
        lowpass(np.zeros((100, 1)), 100.0, Lowpass(50.0))
    with pytest.raises(LinkwiseError, match="9 samples are too few for the filter's padding of 9"):
        lowpass(np.zeros((9, 1)), 100.0, Lowpass(5.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Lowpass(-1.0), "--cutoff -1"),
        (lambda: Lowpass(1.0, 0), "--filter-order 0"),
        (lambda: Processing("savitzky-golay", window=10), "--window 10: give an odd number"),
        (lambda: Processing("savitzky-golay", window=5, degree=5), "above the degree 5"),
        (lambda: Processing("savitzky-golay", degree=1), "--degree 1"),
    ],
)
def test_settings_that_cannot_be(make, message):
    with pytest.raises(LinkwiseError, match=message):
        make()
