"""A log brought to evenly spaced joint coordinates in SI units, checked row by row."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linkwise.analysis import units
from linkwise.analysis.log import Array, Log, open_log
from linkwise.analysis.resample import resample
from linkwise.analysis.selection import Selection, select
from linkwise.analysis.settings import Reading
from linkwise.analysis.spool import Spool
from linkwise.errors import LinkwiseError, within
from linkwise.progress import Progress

TOLERANCE = 1e-3
"""How far a time step may be from the mean one, as a share of it."""

SLOW = 5.0
"""Hz; hardly any movement is recorded so slowly, and milliseconds taken for seconds look like it."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Evenly spaced samples: `time` (S,) in s, `q` (S, n) in rad or m, `rate` in Hz."""

    time: Array
    q: Array
    rate: float
    ignored: tuple[str, ...]
    warnings: tuple[str, ...]
    first_row: int | None = None
    """Number of the first sample's row in the log; None where they were resampled."""


def read_samples(
    path: Path,
    joints: tuple[str, ...],
    joint_units: tuple[str, ...],
    reading: Reading,
    progress: Progress,
    spool: Path | None = None,
) -> Samples:
    """Read, convert to SI and check a log; `spool` is a directory for the samples, else memory."""
    log = open_log(path)
    with within(str(path)):
        selection = select(log.columns, joints, reading)
    angles = [at for at, unit in enumerate(joint_units, 1) if unit == "rad"]
    scale = units.scale(log, reading)
    unsaid = units.unsaid(log, path, reading) if angles else ()
    reach = np.zeros(1 + len(joints))
    row = log.first_row
    with Spool(1 + len(joints), spool) as table:
        for block, done in log.read(selection.columns):
            _check_finite(block, path, row, log, selection)
            reach = np.maximum(reach, np.abs(block).max(axis=0, initial=0.0))
            block[:, angles] *= scale
            table.append(block)
            row += len(block)
            progress("reading", done, log.size)
        samples = table.finish()
    with within(str(path)):
        rate = _check_time(samples[:, 0], log.first_row, reading)
        slow = _doubts(rate)
        if reading.resample is not None:
            rate = reading.resample
            samples = resample(samples, rate, spool, progress=progress)
    names = [log.columns[at] for at in selection.joints]
    peaks = [(names[at - 1], float(reach[at])) for at in angles]
    return Samples(
        samples[:, 0],
        samples[:, 1:],
        rate,
        selection.ignored,
        (*log.doubts, *slow, *unsaid, *units.doubts(peaks, scale)),
        log.first_row if reading.resample is None else None,
    )


def _check_finite(block: Array, path: Path, row: int, log: Log, selection: Selection) -> None:
    if np.isfinite(block).all():
        return
    at, column = np.argwhere(~np.isfinite(block))[0]
    name = log.columns[selection.columns[column]]
    raise LinkwiseError(
        f"{path}: row {row + at}, column {name!r}: {block[at, column]} is no sample; fill the gap"
    )


def _check_time(time: Array, first: int, reading: Reading) -> float:
    """Sampling rate in Hz of the (roughly) even `time`; `first` is the number of its first row."""
    if len(time) < 2:
        raise LinkwiseError(f"{len(time)} samples; a movement needs 5 or more")
    steps = np.diff(time)
    if steps.min() <= 0:
        at = int(np.argmax(steps <= 0))
        what = "repeats" if steps[at] == 0 else "runs back to"
        raise LinkwiseError(
            f"row {first + at + 1}, time column: time {what} {time[at + 1]:.12g} s; sort the rows"
            " and keep one a time"
        )
    usual = float(np.median(steps))
    worst = int(np.argmax(steps))
    if steps[worst] > (10 if reading.resample is not None else 1.5) * usual:
        raise LinkwiseError(
            f"rows {first + worst} to {first + worst + 1}, time column: a gap of"
            f" {steps[worst]:.6g} s where steps are {usual:.6g} s; fill it or cut the log there"
        )
    mean = (time[-1] - time[0]) / (len(time) - 1)
    off = np.abs(steps - mean)
    if reading.resample is None and off.max() > TOLERANCE * mean:
        step = _rounded(time)
        if step is not None:
            return 1 / step
        at = int(np.argmax(off))
        raise LinkwiseError(
            f"row {first + at + 1}, time column: a step of {steps[at]:.6g} s where the mean is"
            f" {mean:.6g} s; bring the log to an even rate with --resample {1 / mean:.6g}"
        )
    return float(1 / mean)


def _rounded(time: Array) -> float | None:
    """Step of the even grid that the times are, rounded to the last digit they are given in, if they are.

    60 Hz in milliseconds has steps of 16 and 17 ms, and that is even time. Digits coarser than a third
    of a step explain too much to count.
    """
    at = np.arange(len(time))
    step, start = np.polyfit(at, time - time[0], 1)
    off = np.ptp(time - time[0] - start - step * at)
    for unit in 10.0 ** -np.arange(10):
        if unit < step / 3 and np.abs(time - np.round(time / unit) * unit).max() < 1e-3 * unit:
            return float(step) if off < 1.1 * unit else None
    return None


def _doubts(rate: float) -> tuple[str, ...]:
    if rate >= SLOW:
        return ()
    return (f"{rate:.4g} samples a second are few: if time is in ms, divide it by 1000",)
