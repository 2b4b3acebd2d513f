"""Positions of a log in which ties close: joints that follow are where the independent ones leave them.

Columns of the log for joints that follow say where to look for them, within a tolerance. Where some are
missing, these joints start from zero at the first sample, and go on from sample to sample: ties that can
close in several ways stay in the one that leads from there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.constrained_model import ConstrainedModel
from linkwise.analysis.disk_rows import collected
from linkwise.analysis.samples import Samples
from linkwise.errors import LinkwiseError
from linkwise.package.load import Array
from linkwise.progress import Progress

BLOCK = 4096
"""Samples closed at once."""
APART = 16
"""Samples from one that the last leads to, to the next; those between are guessed on a line."""
NEAR = 0.1
"""In rad and m: farther from its guess, a joint may have come to another way to close."""
SHORTEST = 1e-6
"""Part of a way that is not halved any more."""


@dataclass(frozen=True)
class ClosedLog:
    """How far the log's own positions were off where it has all joints, and of which constraint."""

    largest: float | None
    row: str = ""

    def record(self) -> dict[str, Any]:
        """As plain data; m, rad or a coupling's unit."""
        return {"largest_violation": self.largest, "of": self.row}


def closed_samples(
    samples: Samples,
    there: Sequence[int],
    model: ConstrainedModel,
    tolerance: float,
    progress: Progress,
    buffer: Path | None = None,
) -> tuple[Samples, ClosedLog]:
    """Samples of all joints, of those of the joints `there` in the log, and how far they were off.

    Raises LinkwiseError, with the time, where ties cannot be closed or the log is off by more than the
    tolerance, in m and rad.
    """
    n, missing = len(model.joint_names), [k for k in range(len(model.joint_names)) if k not in there]
    worst = ClosedLog(None if missing else 0.0)

    def blocks() -> Iterator[Array]:
        nonlocal worst
        last = None
        for start in range(0, len(samples.time), BLOCK):
            time = samples.time[start : start + BLOCK]
            q = np.zeros((len(time), n))
            q[:, list(there)] = samples.q[start : start + BLOCK]
            if missing:
                q = _without_leaps(model, time, q, missing, last)
            else:
                worst = _larger(worst, _checked(model, time, q, tolerance))
                q = _closed(model, time, q)
            last = q[-1]
            progress("closing", min(start + BLOCK, len(samples.time)), len(samples.time))
            yield np.column_stack([time, q])

    whole = collected(blocks(), 1 + n, buffer)
    return replace(samples, time=whole[:, 0], q=whole[:, 1:]), worst


def _larger(one: ClosedLog, other: ClosedLog) -> ClosedLog:
    return other if (other.largest or 0.0) > (one.largest or 0.0) else one


def _checked(model: ConstrainedModel, time: Array, q: Array, tolerance: float) -> ClosedLog:
    violation = np.abs(np.asarray(model.constraints.violation(q)))
    if not violation.size:
        return ClosedLog(0.0)
    sample, row = np.unravel_index(int(violation.argmax()), violation.shape)
    largest, name = float(violation[sample, row]), str(model.constraints.rows[row])
    if not largest <= tolerance:
        raise LinkwiseError(
            f"time {time[sample]:.6g} s: {name} is open by {largest:.3g} (m, rad or a coupling's unit), more"
            f" than {tolerance:g}; mend the log, leave the columns of joints that follow out"
            f" ({', '.join(model.constraints.dependent)}), or say --loop-tolerance"
        )
    return ClosedLog(largest, name)


def _closed(model: ConstrainedModel, time: Array, q: Array) -> Array:
    try:
        return np.asarray(model.constraints.closed(q))
    except ValueError as error:
        raise LinkwiseError(f"between {time[0]:.6g} and {time[-1]:.6g} s: {error}") from None


def _without_leaps(
    model: ConstrainedModel, time: Array, q: Array, missing: Sequence[int], last: Array | None
) -> Array:
    """Closed positions, led on from the closed `last` sample, or from zero."""
    guess = _continued(model, time, q, missing, last, APART)
    found = _closed(model, time, guess)
    if np.abs(found - guess).max(initial=0.0) > NEAR:
        found = _closed(model, time, _continued(model, time, q, missing, last, 1))
    return found


def _continued(
    model: ConstrainedModel,
    time: Array,
    q: Array,
    missing: Sequence[int],
    last: Array | None,
    apart: int,
) -> Array:
    """Guesses (S, n) of the joints that are missing."""
    q, marks = q.copy(), np.unique([*range(0, len(q), apart), len(q) - 1])
    at = _start(model, q[0], float(time[0])) if last is None else last
    led = np.empty((len(marks), q.shape[1]))
    for row, mark in enumerate(marks):
        at = led[row] = _led(model, at, q[mark], float(time[mark]))
    for k in missing:
        q[:, k] = np.interp(np.arange(len(q)), marks, led[:, k])
    return q


def _start(model: ConstrainedModel, first: Array, time: float) -> Array:
    """A closed position for the first sample, in which what is missing is zero; or one for all zeros."""
    try:
        return np.asarray(model.constraints.closed(first))
    except ValueError as error:
        try:
            return np.asarray(model.constraints.closed(0.0 * first))
        except ValueError:
            missing = ", ".join(model.constraints.dependent)
            raise LinkwiseError(
                f"time {time:.6g} s: joints that follow cannot be found from zero ({error}); give the log"
                f" columns for them, {missing}"
            ) from None


def _led(model: ConstrainedModel, start: Array, wanted: Array, time: float) -> Array:
    """A closed position, by steps along G from a closed one to where the independent joints are wanted."""
    own, at, done, step = list(model.following.independent), start, 0.0, 1.0
    way = wanted[own] - start[own]
    while done < 1.0:
        step = min(step, 1.0 - done)
        try:
            guess = at + np.asarray(model.constraints.velocity(at, step * way))
            guess[own] = start[own] + (done + step) * way
            found = np.asarray(model.constraints.closed(guess))
        except ValueError as error:
            found, told = None, str(error)
        if found is not None and np.abs(found - guess).max() <= NEAR:
            at, done, step = found, done + step, 2.0 * step
            continue
        step /= 2.0
        if step < SHORTEST:
            why = told if found is None else "they would have to leap"
            raise LinkwiseError(
                f"time {time:.6g} s: the joints that follow cannot be led there ({why}); give the log their"
                f" columns: {', '.join(model.constraints.dependent)}"
            )
    return at
