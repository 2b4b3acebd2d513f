"""A whole log, block by block: each is differentiated, decomposed, checked, summed up and handed on."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
from linkwise_runtime.motion.tracer import TraceState

from linkwise.analysis.certain_signs import LargestTorques
from linkwise.analysis.disk_rows import let_go
from linkwise.analysis.even_time import TOLERANCE
from linkwise.analysis.filtering import derivatives
from linkwise.analysis.integrals import parted_integrals
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.result import Totals, WholeMovement, Work
from linkwise.analysis.result_quantities import POWER_OF, WORK_BY_SOURCE
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.samples import Samples
from linkwise.analysis.settings import Processing
from linkwise.analysis.torques import Decomposer
from linkwise.analysis.traced_rows import ExtendedBlock
from linkwise.analysis.verify import Closure, against_recursion
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.progress import Progress

Sink = Callable[[Array], None]
"""A sink is given one block (rows, samples) after the other; the block is the sink's own."""

INNER, LEAST = 4096, 1024
"""Most and fewest samples computed at once: intermediate values stay in the cache; fewer for wide results."""

BLOCK_BYTES = 48 << 20
"""Approximate size in bytes of a block handed on: some three of them are in memory at any time."""

LEAST_SAMPLES = 2
"""Fewest samples of a range of time: one has no duration."""


def span_of(samples: Samples, processing: Processing) -> tuple[int, int]:
    """Return the first sample analysed and the one after the last.

    Raises LinkwiseError if there are too few samples, of the log or in the range of time.
    """
    count, needed = len(samples.time), processing.span
    cut = needed // 2 if processing.edges == "trim" else 0
    if count < needed + 2 * cut:
        raise LinkwiseError(
            f"{count} samples, but the {processing.derivative} formula"
            f"{' with trimmed edges' if cut else ''} needs {needed + 2 * cut} or more"
        )
    start, stop = cut, count - cut
    slack = TOLERANCE / samples.rate  # times are rounded where they are written
    if processing.start is not None:
        start = max(start, int(np.searchsorted(samples.time, processing.start - slack)))
    if processing.stop is not None:
        stop = min(stop, int(np.searchsorted(samples.time, processing.stop + slack, side="right")))
    if stop - start < LEAST_SAMPLES:
        given = (("--from", processing.start), ("--to", processing.stop))
        flags = " ".join(f"{flag} {time:g}" for flag, time in given if time is not None)
        raise LinkwiseError(
            f"{flags}: {max(0, stop - start)} samples are there, and {LEAST_SAMPLES} are needed; the log runs"
            f" from {samples.time[0]:.6g} to {samples.time[-1]:.6g} s"
        )
    return start, stop


class MovementSums:
    """Totals, work and errors of a movement, added up block by block.

    Samples are evenly spaced, and work is summed by the trapezoidal rule: with Δt between them
    ∫ P dt = Δt Σ_s (P_s + P_(s+1))/2. A phase has the steps both of whose samples are in it.
    """

    def __init__(self, rows: ResultRows, robot: OpenedRobot, phases: Sequence[PlacedPhase] = ()) -> None:
        self.closure, self._rows, self._samples = Closure(), rows, 0
        self._robot, self._phases = robot, phases
        self._total, self._peak = np.zeros((2, len(rows)))
        self._power = rows.numbers(*POWER_OF.values(), *WORK_BY_SOURCE)
        self._energy = np.zeros((1 + len(phases), 2, len(self._power)))
        self._last: tuple[Array, Array] | None = None
        self._steps = np.zeros(1 + len(phases))
        self._search = LargestTorques(rows)

    def add(self, block: Array, closure: Closure) -> bool:
        """Add a block (rows, samples) and its errors; return whether all of its values are finite."""
        self.closure |= closure
        magnitude = np.abs(block)
        added = magnitude.sum(axis=1)
        if not np.isfinite(added).all():
            return False
        self._samples += block.shape[1]
        self._total += added
        np.maximum(self._peak, magnitude.max(axis=1), out=self._peak)
        self._search.add(block)
        power = block[self._power]
        on = np.stack([np.ones(block.shape[1]), *self._on(block)])
        if self._last is not None:  # the step from the last block to this one
            power, on = (np.concatenate(two, axis=1) for two in zip(self._last, (power, on), strict=True))
        steps = on[:, 1:] * on[:, :-1]
        self._steps += steps.sum(axis=1)
        self._energy += parted_integrals(power, steps)
        self._last = power[:, -1:].copy(), on[:, -1:].copy()
        return True

    def _on(self, block: Array) -> Iterator[Array]:
        """Yield for each phase 1 at samples in it, else 0, (S,)."""
        q = self._rows.dense("q", block) if self._phases else block
        contacts = block[self._rows["contact"].rows]
        for phase in self._phases:
            yield phase.on(self._robot, block[0], q, contacts).astype(float)

    def movement(self, step: float) -> WholeMovement:
        """Return what the whole movement comes to; samples are `step` s apart.

        Raises LinkwiseError for a phase that is over before any work is, where its work is told.
        """
        told = any(name in self._rows for name in WORK_BY_SOURCE)
        for phase, steps in zip(self._phases, self._steps[1:].tolist(), strict=True):
            if told and not steps:
                raise LinkwiseError(
                    f"--phase {phase.name}: no two samples follow each other in it, so that it has no work"
                )
        energy = np.zeros((1 + len(self._phases), 2, len(self._rows), 1))
        energy[:, :, self._power, 0] = step * self._energy
        kept = [*POWER_OF.values(), *(name for name in WORK_BY_SOURCE if name in self._rows)]
        whole, *phases = (
            {power: Work(*(self._rows.dense(power, way)[0] for way in part)) for power in kept}
            for part in energy
        )
        return WholeMovement(
            totals=Totals(self._total / self._samples, self._peak),
            closure=self.closure,
            total=self._samples,
            peaks=self._search.peaks(),
            cutoff_sweep=None,
            work_by_source={power: work for power, work in whole.items() if power in WORK_BY_SOURCE},
            work_in_phases=tuple(phases),
            **{name: whole[power] for name, power in POWER_OF.items()},
        )


def stream(
    samples: Samples,
    decomposer: Decomposer,
    processing: Processing,
    sink: Sink,
    progress: Progress,
    phases: Sequence[PlacedPhase] = (),
) -> WholeMovement:
    """Send every block to `sink`, which works in a thread beside the computation.

    Raises LinkwiseError for too few samples, results that overflow, and a robot whose torques do not add up.
    """
    (start, stop), rows = span_of(samples, processing), decomposer.rows
    sums, inner = MovementSums(rows, decomposer.robot, phases), _at_once(len(rows))
    traced = decomposer.traced
    with ThreadPoolExecutor(1) as writer, np.errstate(over="ignore", invalid="ignore"):
        pending: Future[None] | None = None
        state: TraceState | None = None
        for first, last in _blocks(start, stop, len(rows)):
            block = np.empty((len(rows), last - first))
            for at in range(first, last, inner):
                end = min(at + inner, last)
                low, high = (at, end) if traced is None else (max(start, at - 1), min(stop, end + 2))
                q, qd, qdd = derivatives(samples.q, samples.rate, low, high, processing)
                own = block[:, at - first : end - first]
                out = own if traced is None else np.empty((len(rows), high - low))
                time = samples.time[low:high]
                here = decomposer.at(time, samples.inputs[low:high])
                closure = here.fill(out, time, q, qd, qdd)
                if traced is not None:
                    extended = ExtendedBlock(low - start, at - start, end - start, stop - 1 - start)
                    error, state = here.trace(out, extended, state)
                    closure |= error
                    own[:] = out[:, extended.own]
                if not sums.add(own, closure):
                    raise _overflow(samples, decomposer, own, at)
            loads, times = decomposer.loads, decomposer.times
            sums.closure |= against_recursion(decomposer.robot, loads, times, rows, block)
            sums.closure.check()
            if pending is not None:
                pending.result()
            pending = writer.submit(sink, block)
            let_go(samples.q)
            progress("analysing", last - start, stop - start)
        if pending is not None:
            pending.result()
    return sums.movement(1 / samples.rate)


def _overflow(samples: Samples, decomposer: Decomposer, out: Array, start: int) -> LinkwiseError:
    """Return an error that says where the first result that is not finite stands, by time.

    Rows come cause before effect.
    """
    bad = ~np.isfinite(out)
    at = int(bad.any(axis=0).argmax())
    column = int(bad[:, at].argmax()) if bad.any() else int(np.abs(out).max(axis=1).argmax())
    row = "" if samples.first_row is None else f"row {samples.first_row + start + at}, "
    name = decomposer.rows.columns[column].name
    return LinkwiseError(
        f"{row}time {samples.time[start + at]:.6g} s: result column {name!r} is"
        f" {out[column, at]:.3g}; the log's values are too large{_largest(samples, decomposer, start + at)}"
    )


def _largest(samples: Samples, decomposer: Decomposer, at: int) -> str:
    """Return a phrase about the largest coordinate near a sample, for a message."""
    first = max(0, at - INNER)
    near = np.abs(samples.q[first : at + INNER])
    near[np.isnan(near)] = np.inf  # of a filter that overflowed
    row, joint = np.unravel_index(int(np.argmax(near)), near.shape)
    if np.isinf(near[row, joint]):
        return f": {decomposer.robot.joints[joint]!r} overflows in the filter"
    where = f"row {samples.first_row + first + row}" if samples.first_row is not None else "a sample nearby"
    return f": {decomposer.robot.joints[joint]!r} comes to {near[row, joint]:.3g} in {where}"


def _at_once(columns: int) -> int:
    return min(INNER, max(LEAST, BLOCK_BYTES // (8 * columns)))


def _blocks(start: int, stop: int, columns: int) -> Iterator[tuple[int, int]]:
    inner = _at_once(columns)
    rows = max(inner, BLOCK_BYTES // (8 * columns) // inner * inner)
    for at in range(start, stop, rows):
        yield at, min(at + rows, stop)
