"""Closing of a log's positions: dependent joints are moved to where the ties of the robot close.

Columns of the log for dependent joints serve as the initial guess, which must be right within a tolerance.
Where some are missing, these joints are led from the closed position of the package to the first sample, and
from sample to sample: ties that can close in several ways stay in the one that is reached from there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.constrained_model import ConstrainedModel
from linkwise.analysis.disk_rows import collected
from linkwise.analysis.filtering import derivatives
from linkwise.analysis.samples import Samples
from linkwise.analysis.settings import Processing
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.progress import Progress

BLOCK = 4096
"""Samples closed at once."""
APART = 16
"""Samples from one led position to the next; those between them are first guessed on a straight line."""
STEEP = 20.0
"""Largest velocity of a dependent joint by a unit of an independent one that is taken unsaid."""
SLIP = 0.05
"""Part of a velocity constraint's terms by which a log may break it unsaid: velocities are derived."""
NEAR = 0.1
"""Distance from its guess, in rad or m, beyond which a joint may have jumped to another way to close."""


@dataclass(frozen=True)
class ClosedLog:
    """Largest violation of a constraint by the log's own positions, and the name of that constraint.

    The violation is None where the log does not have all joints.
    """

    largest: float | None
    row: str = ""

    def record(self) -> dict[str, Any]:
        """Return this as plain data; the violation is in m, rad or a coupling's unit."""
        return {"largest_violation": self.largest, "of": self.row}


def closed_samples(
    samples: Samples,
    there: Sequence[int],
    model: ConstrainedModel | None,
    tolerance: float,
    progress: Progress,
    buffer: Path | None = None,
) -> tuple[Samples, ClosedLog | None]:
    """Return samples of all joints, and the largest violation by the log's own positions.

    Without a model no joints are tied: samples are returned as they are, and None.

    samples: those of the joints with the numbers `there`, which the log has

    Raises LinkwiseError, with the time, where ties cannot be closed or the log is off by more than the
    tolerance, in m and rad.
    """
    if model is None:
        return samples, None
    _refuse_lost_way(model, there)
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
                q, given = _without_leaps(model, time, q, there, last), q
                _refuse_far(model, time, q, given, there, tolerance)
            else:
                worst = _larger(worst, _checked(model, time, q, tolerance))
                q = _closed(model, time, q)
            last = q[-1]
            progress("closing", min(start + BLOCK, len(samples.time)), len(samples.time))
            yield np.column_stack([time, q])

    whole = collected(blocks(), 1 + n, buffer)
    return replace(samples, time=whole[:, 0], q=whole[:, 1:]), worst


def _refuse_lost_way(model: ConstrainedModel, there: Sequence[int]) -> None:
    """Raise LinkwiseError for columns that constraints of velocities cannot make up for."""
    written = model.structure.written
    missing = [name for k, name in enumerate(model.joint_names) if k not in there]
    if missing and written is not None and not all(written.holonomic):
        name = next(name for name, own in zip(written.names, written.holonomic, strict=True) if not own)
        raise LinkwiseError(
            f"no column for joint {listed(map(repr, missing))}: {name} is a constraint of velocities, from "
            "which positions of the other joints do not tell where these are; log all"
        )


def slip_warnings(samples: Samples, model: ConstrainedModel | None, processing: Processing) -> Iterator[str]:
    """Yield warnings about constraints of velocities, sum_k A_k qd_k = 0.

    A log's velocities may break them, which the motion that is analysed keeps: dependent joints move as
    independent ones want. And these may hardly tell how.
    """
    written = None if model is None else model.structure.written
    if model is None or written is None or all(written.holonomic):
        return
    moved = [row for row, holds in enumerate(written.holonomic) if not holds]
    (worst, sizes), steepest, when = np.zeros((2, len(moved))), 0.0, 0.0
    for at in range(0, len(samples.time), BLOCK):
        end = min(at + BLOCK, len(samples.time))
        q, qd, _ = derivatives(samples.q, samples.rate, at, end, processing)
        terms = np.asarray(model.constraints.jacobian(q))[:, moved] * qd[:, None, :]
        worst = np.maximum(worst, np.abs(terms.sum(-1)).max(0))
        sizes = np.maximum(sizes, np.abs(terms).sum(-1).max(0))
        slopes = np.abs(np.asarray(model.constraints.velocity_map(q))).max((1, 2))
        if slopes.max() > steepest:
            steepest, when = float(slopes.max()), float(samples.time[at + int(slopes.argmax())])
    if steepest > STEEP:
        yield (
            f"at {when:.6g} s {listed(model.constraints.dependent)} move {steepest:.3g} times as fast as "
            f"{listed(model.constraints.independent)}, of which torques are told: errors of the log grow by "
            "that; choose others as `independent` in the file"
        )
    for row, apart, size in zip(moved, worst, sizes, strict=True):
        if apart > SLIP * size:
            yield (
                f"{written.names[row]} is not kept by the log's own velocities, by up to {apart:.3g} where "
                f"its terms come to {size:.3g}: the motion that is analysed, of "
                f"{listed(model.constraints.dependent)}, is what the others want"
            )


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


def _refuse_far(
    model: ConstrainedModel, time: Array, q: Array, given: Array, there: Sequence[int], tolerance: float
) -> None:
    """Raise LinkwiseError for a dependent joint of the log that is not where ties close without it."""
    own = [k for k in there if k not in model.following.independent]
    apart = np.abs(q[:, own] - given[:, own])
    if apart.max(initial=0.0) > tolerance:
        sample, k = np.unravel_index(int(apart.argmax()), apart.shape)
        raise LinkwiseError(
            f"time {time[sample]:.6g} s: {model.joint_names[own[int(k)]]!r} is {apart[sample, k]:.3g} (m or "
            f"rad) from where {listed(model.constraints.names)} close, more than {tolerance:g}; mend the "
            "log, leave its column out, or say --loop-tolerance"
        )


def _closed(model: ConstrainedModel, time: Array, q: Array) -> Array:
    try:
        return np.asarray(model.constraints.closed(q))
    except ValueError as error:
        raise LinkwiseError(
            f"between {time[0]:.6g} and {time[-1]:.6g} s: {reason_of(error)}; mend the log's columns of"
            f" joints that follow, or leave them out: {', '.join(model.constraints.dependent)}"
        ) from None


def _without_leaps(
    model: ConstrainedModel, time: Array, q: Array, there: Sequence[int], last: Array | None
) -> Array:
    """Return closed positions (S, n), led on from the closed `last` sample.

    Without one, they are led from the closed position of the package.
    """
    guess = _continued(model, time, q, there, last, APART)
    found = _closed(model, time, guess)
    if np.abs(found - guess).max(initial=0.0) > NEAR:
        found = _closed(model, time, _continued(model, time, q, there, last, 1))
    return found


def _continued(
    model: ConstrainedModel,
    time: Array,
    q: Array,
    there: Sequence[int],
    last: Array | None,
    apart: int,
) -> Array:
    """Return positions (S, n) in which the joints that are not in the log are guesses."""
    q, marks = q.copy(), np.unique([*range(0, len(q), apart), len(q) - 1])
    at = _start(model, q[0], there, float(time[0])) if last is None else last
    led = np.empty((len(marks), q.shape[1]))
    for row, mark in enumerate(marks):
        at = led[row] = _led(model, at, q[mark], float(time[mark]))
    for k in set(range(q.shape[1])).difference(there):
        q[:, k] = np.interp(np.arange(len(q)), marks, led[:, k])
    return q


def _start(model: ConstrainedModel, first: Array, there: Sequence[int], time: float) -> Array:
    """Return a closed position (n,) for the first sample, near the log's dependent joints, if it has any."""
    own = list(model.following.independent)
    led = _led(model, None, first, time)
    if set(there) <= set(own):
        return led
    guess = led.copy()
    guess[list(there)] = first[list(there)]
    try:
        return np.asarray(model.constraints.closed(guess))
    except ValueError:
        return led


def _led(model: ConstrainedModel, start: Array | None, wanted: Array, time: float) -> Array:
    """Return a closed position (n,) with the independent joints of `wanted`.

    It is led there from the closed position `start`, or from the package's own where that is None.
    """
    try:
        return np.asarray(model.constraints.closed(wanted[list(model.following.independent)], start=start))
    except ValueError as error:
        raise LinkwiseError(
            f"time {time:.6g} s: {reason_of(error)}; give the log columns for them:"
            f" {', '.join(model.constraints.dependent)}"
        ) from None


def reason_of(error: ValueError) -> Any:
    """Return a package's message without the advice that is for its direct callers."""
    return getattr(error, "reason", error)
