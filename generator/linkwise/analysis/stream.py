"""A whole log, block by block: each is differentiated, decomposed, checked, summed up and handed on."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import cast

import numpy as np
from linkwise_runtime.motion.tracer import TraceState
from linkwise_runtime.native.memory import memory

from linkwise.analysis.disk_rows import let_go
from linkwise.analysis.even_time import TOLERANCE
from linkwise.analysis.filtering import derivatives
from linkwise.analysis.movement_sums import MovementSums, PartSums
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.samples import Samples
from linkwise.analysis.settings import Processing
from linkwise.analysis.torques import Decomposer
from linkwise.analysis.traced_rows import ExtendedBlock
from linkwise.analysis.turned_rows import scratch
from linkwise.analysis.verify import SAMPLES, Closure
from linkwise.analysis.whole_movement import WholeMovement
from linkwise.analysis.worker_threads import worker_threads
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.progress import Progress

Sink = Callable[[Array], None]
"""A sink is given one block (rows, samples) after the other; the block is the sink's own."""

INNER, LEAST, LEAST_SLOW = 4096, 512, 1024
"""Most and fewest samples computed at once: intermediate values stay in the cache; fewer for wide results.
The last is the fewest where each call costs much, as of ties."""
CACHED = 2 << 20
"""Approximate size in bytes of what is computed at once."""

MOST_THREADS = 8
"""Most threads that compute: more of them would wait for Python's lock."""

BLOCK_BYTES = 36 << 20
"""Approximate size in bytes of a block handed on: some four of them are in memory at any time."""

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


def beyond_log(samples: Samples, processing: Processing) -> Iterator[str]:
    """Yield a warning for each end of the range of time that lies a sample or more outside the log."""
    first, last, step = samples.time[0], samples.time[-1], 1 / samples.rate
    if processing.start is not None and processing.start <= first - step:
        yield f"--from {processing.start:g} is before the log, which begins at {first:.6g} s"
    if processing.stop is not None and processing.stop >= last + step:
        yield f"--to {processing.stop:g} is after the log, which ends at {last:.6g} s"


Filled = tuple[PartSums, Closure]
"""Sums over a part of a block, and how well it closes."""


@dataclass
class Parts:
    """Fills parts of blocks, some samples each, whose values stay in the cache, on several threads.

    The parts of a trace, each of which goes on from the one before, are filled one after the other.
    """

    samples: Samples
    decomposer: Decomposer
    processing: Processing
    sums: MovementSums
    span: tuple[int, int]
    """First sample analysed, and the one after the last."""
    state: TraceState | None = None
    """State of the trace behind the last part."""

    @property
    def threads(self) -> int:
        """Number of threads that fill parts: one where most of the work is Python's own, or a trace."""
        return min(worker_threads(), MOST_THREADS) if self.decomposer.is_quick else 1

    def blocks(self, pool: Executor, inner: int) -> Iterator[tuple[int, Array, Iterator[Filled]]]:
        """Yield the first sample of each block, the block (rows, samples) and what its parts come to.

        The next block is begun before, so that threads have work meanwhile.
        inner: samples of a part
        """
        begun: list[tuple[int, Array, Iterator[Filled]]] = []
        count = len(self.decomposer.rows)
        for first, last in _blocks(*self.span, count, inner):
            block = cast(Array, memory((count, last - first), np.dtype(np.float64)))
            found = pool.map(partial(self.fill, block, first, inner), range(first, last, inner))
            begun.append((first, block, found))
            if len(begun) > 1:
                yield begun.pop(0)
        yield from begun

    def fill(self, block: Array, first: int, inner: int, at: int) -> Filled:
        """Fill a part of a block (rows, samples) that begins at `first`, from the sample `at` on."""
        own = block[:, at - first : at - first + inner]
        end = at + own.shape[1]
        with np.errstate(over="ignore", invalid="ignore"):
            closure = self._traced(own, at, end) if self.decomposer.traced else self._filled(own, at, end)
            return self.sums.of_part(own), closure

    def _filled(self, out: Array, low: int, high: int) -> Closure:
        """Fill `out` (rows, high - low) but for a trace."""
        samples = self.samples
        motion = derivatives(samples.q, samples.rate, low, high, self.processing)
        time = samples.time[low:high]
        return self.decomposer.at(time, samples.inputs[low:high]).fill(out, time, *motion)

    def _traced(self, own: Array, at: int, end: int) -> Closure:
        """Fill the part and its trace, which looks at the samples beside."""
        start, stop = self.span
        low, high = max(start, at - 1), min(stop, end + 2)
        out = np.empty((len(own), high - low))
        closure = self._filled(out, low, high)
        extended = ExtendedBlock(low - start, at - start, end - start, stop - 1 - start)
        here = self.decomposer.at(self.samples.time[low:high], self.samples.inputs[low:high])
        error, self.state = here.trace(out, extended, self.state)
        own[:] = out[:, extended.own]
        return closure | error


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
    sums, inner = MovementSums(rows, decomposer.robot, phases), _at_once(decomposer)
    parts = Parts(samples, decomposer, processing, sums, (start, stop))
    quiet = np.errstate(over="ignore", invalid="ignore")
    with ThreadPoolExecutor(parts.threads) as pool, ThreadPoolExecutor(1) as writer, quiet, scratch:
        pending: Future[None] | None = None
        for first, block, found in parts.blocks(pool, inner):
            last = first + block.shape[1]
            for at, (own, closure) in zip(range(first, last, inner), found, strict=True):
                part = block[:, at - first : at - first + inner]
                if not sums.add(part, own, closure):
                    raise _overflow(samples, decomposer, part, at)
            looked = np.unique(np.linspace(0, last - first - 1, SAMPLES).astype(int))
            sums.closure |= decomposer.checked(block[:, looked], samples.inputs[first:last][looked])
            sums.closure.check()
            if pending is not None:
                pending.result()
            pending = writer.submit(sink, block)
            let_go(samples.q)
            let_go(samples.time)
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


def _at_once(decomposer: Decomposer) -> int:
    """Return the number of samples computed at once."""
    if decomposer.is_quick:
        return min(INNER, max(LEAST, CACHED // (8 * len(decomposer.rows)) // LEAST * LEAST))
    return min(INNER, max(LEAST_SLOW, BLOCK_BYTES // (8 * len(decomposer.rows))))


def _blocks(start: int, stop: int, columns: int, inner: int) -> Iterator[tuple[int, int]]:
    """Yield the first sample of each block and the one after its last.

    An odd number of parts of a power of two: rows then lie apart in the sets of a cache.
    """
    rows = (max(1, BLOCK_BYTES // (8 * columns) // inner) - 1 | 1) * inner
    for at in range(start, stop, rows):
        yield at, min(at + rows, stop)
