"""Even sampling: a check of a log's times, up to the digits they are written in, and resampling."""

from bisect import bisect_left
from collections.abc import Iterator
from typing import Any

import numpy as np

from linkwise.analysis.disk_rows import let_go
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.extras import extra
from linkwise.progress import Progress, silent

TOLERANCE = 1e-3
"""Largest deviation of a time step from the mean step, as a fraction of it."""

GAP, GAP_BEFORE_RESAMPLING = 1.5, 10.0
"""Longest steps, in usual steps: a longer one is a gap in the log; splines bridge somewhat longer ones."""

OVERLAP = 64
"""Knots used past a window. A knot's influence on a cubic spline at least halves from one to the
next, so what is cut away is below 2⁻⁶⁴ of the signal."""

EXTREME = 1e100
"""Limit of times in s and of rates in Hz: no clock shows it, and what is computed from it overflows."""

AT_ONCE = 1 << 18
"""Samples that are looked at at once."""
MOST_STEPS = 1 << 20
"""About so many steps, evenly spread, make the usual one."""

MOST = 100
"""Largest ratio of a wanted rate to the log's own that is plausible, and not a slip of the finger."""


def usual_step(time: Array, first_row: int, gap: float = GAP) -> float:
    """Return the median step in s of `time` (S,), two samples or more, or that of some million steps.

    first_row: number in the log of the first sample's row

    Raises LinkwiseError that names the rows for time that does not increase, and for steps longer than `gap`
    usual ones; also for times beyond EXTREME.
    """
    largest = max(float(np.abs(some).max()) for _, some in _parts(time))
    if largest > EXTREME:
        raise LinkwiseError(f"time column: it comes to {largest:.3g} s; give seconds")
    every, worst, longest, some_steps = -(-len(time) // MOST_STEPS), 0, 0.0, []
    for at, steps in _steps(time):
        _refuse_backwards(time, at, steps, first_row)
        if (most := float(steps.max())) > longest:
            worst, longest = at + int(np.argmax(steps)), most
        some_steps.append(steps[::every])
    usual = float(np.median(np.concatenate(some_steps)))
    if longest > gap * usual:
        raise LinkwiseError(
            f"rows {first_row + worst} to {first_row + worst + 1}, time column: a gap of"
            f" {longest:.6g} s where steps are {usual:.6g} s; fill it or cut the log there"
        )
    return usual


def even_rate(
    time: Array, first_row: int, strict: bool, mend: str = "bring the log to an even rate with --resample"
) -> float:
    """Return the sampling rate in Hz of `time` (S,) in s.

    first_row: number in the log of the first sample's row
    mend: advice for messages, which a rate follows

    Raises LinkwiseError that names the rows for time that does not increase and for gaps that splines do not
    bridge; where `strict`, for uneven time and any gap too, which are otherwise left to `resampled`.
    """
    if len(time) < 2:
        raise LinkwiseError(f"{len(time)} samples; a movement needs 5 or more")
    usual = usual_step(time, first_row, GAP_BEFORE_RESAMPLING)
    mean = (time[-1] - time[0]) / (len(time) - 1)
    if mean < 1 / EXTREME:
        raise LinkwiseError(f"time column: steps of {mean:.3g} s; give seconds")
    at, off = 0, 0.0
    for start, steps in _steps(time):
        away = np.abs(steps - mean)
        if (most := float(away.max())) > off:
            at, off = start + int(np.argmax(away)), most
    if strict and off > TOLERANCE * mean:
        step = _rounded_step(time)
        if step is not None:
            return 1 / step
        worst = time[at + 1] - time[at]
        if worst > GAP * usual:
            raise LinkwiseError(
                f"rows {first_row + at} to {first_row + at + 1}, time column: a gap of"
                f" {worst:.6g} s where steps are {usual:.6g} s; fill it, or {mend} {1 / usual:.6g}"
            )
        raise LinkwiseError(
            f"row {first_row + at + 1}, time column: a step of {worst:.6g} s where the mean is"
            f" {mean:.6g} s; {mend} {1 / mean:.6g}"
        )
    return float(1 / mean)


def _splined(spline: Any, window: Array, at: Array) -> Array:
    """Return values (T, n) at the times `at` (T,) of splines through a window (S, 1 + n).

    Raises LinkwiseError for values that overflow.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            values: Array = spline(window[:, 0], window[:, 1:], axis=0)(at)
        except ValueError:  # slopes that overflow
            values = np.full((1, 1), np.nan)
    if not np.isfinite(values).all():
        raise LinkwiseError(
            f"--resample overflows between {window[0, 0]:.6g} s and {window[-1, 0]:.6g} s: the log's values"
            f" are too large there, up to {np.abs(window[:, 1:]).max():.3g}"
        )
    return values


def _parts(time: Array) -> Iterator[tuple[int, Array]]:
    """Yield the number of the first sample of each part of `time` (S,), and a copy of the part."""
    for at in range(0, len(time), AT_ONCE):
        yield at, np.array(time[at : at + AT_ONCE])
        let_go(time)


def _steps(time: Array) -> Iterator[tuple[int, Array]]:
    """Yield the number of the first sample of each part of `time` (S,), and the steps from its samples on."""
    for at in range(0, len(time) - 1, AT_ONCE):
        yield at, np.diff(time[at : at + AT_ONCE + 1])
        let_go(time)


def _refuse_backwards(time: Array, start: int, steps: Array, first_row: int) -> None:
    if steps.min() > 0:
        return
    at = start + int(np.argmax(steps <= 0))
    what = "repeats" if steps[at - start] == 0 else "runs back to"
    raise LinkwiseError(
        f"row {first_row + at + 1}, time column: time {what} {time[at + 1]:.12g} s; sort the rows"
        " and keep one for each time"
    )


def _rounded_step(time: Array) -> float | None:
    """Return the step in s of an even grid that gives these times when rounded to their last digit, or None.

    60 Hz in milliseconds has steps of 16 and 17 ms, and that is even time. Digits coarser than a third
    of a step would explain too much to count.
    """
    middle, first = (len(time) - 1) / 2, float(time[0])
    numbers = np.arange(min(len(time), AT_ONCE)) - middle
    slopes = sum(float((numbers[: len(some)] + at) @ (some - first)) for at, some in _parts(time))
    step = slopes / (len(time) * (len(time) ** 2 - 1) / 12)  # by least squares
    ends = np.array([_ends(some - first - step * (numbers[: len(some)] + at)) for at, some in _parts(time)])
    off = float(ends[:, 1].max() - ends[:, 0].min())
    for digit in 10.0 ** -np.arange(10):
        if digit < step / 3 and all(
            np.abs(some - np.round(some / digit) * digit).max() < 1e-3 * digit for _, some in _parts(time)
        ):
            return step if off < 1.1 * digit else None
    return None


def _ends(values: Array) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def resampled(samples: Array, rate: float, rows: int = 65536, progress: Progress = silent) -> Iterator[Array]:
    """Yield blocks (at most `rows`, 1 + n) of cubic splines through the samples at `rate` Hz.

    samples: (S, 1 + n), time in s first; the first time is kept. Splines are made window by window.
    Raises LinkwiseError for too few samples and for a rate far above the log's own.
    """
    spline = extra("scipy.interpolate").CubicSpline
    time = samples[:, 0]
    own = (len(time) - 1) / (time[-1] - time[0])
    if rate > MOST * own:
        raise LinkwiseError(
            f"--resample {rate:g} Hz is more than {MOST} times the log's own mean rate of {own:.6g} Hz;"
            " lower it"
        )
    count = int(np.floor((time[-1] - time[0]) * rate * (1 + 1e-12))) + 1
    if len(samples) < 4 or count < 5:
        raise LinkwiseError(f"{len(samples)} samples give {count} at {rate:g} Hz; 5 or more are needed")
    for start in range(0, count, rows):
        at = time[0] + np.arange(start, min(start + rows, count)) / rate
        # Not by NumPy's search, which copies times that do not follow each other in memory.
        low = max(0, bisect_left(time, at[0]) - OVERLAP)
        high = min(len(time), bisect_left(time, at[-1]) + OVERLAP)
        window = np.asarray(samples[low:high])
        values = _splined(spline, window, np.minimum(at, time[-1]))
        let_go(samples)
        yield np.column_stack([at, values])
        progress("resampling", start + len(at), count)
