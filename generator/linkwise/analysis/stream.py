"""A whole log, block by block: each is differentiated, decomposed, checked, summed up and handed on."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from linkwise.analysis.disk_rows import let_go
from linkwise.analysis.filtering import derivatives
from linkwise.analysis.result import Totals, WholeMovement
from linkwise.analysis.samples import Samples
from linkwise.analysis.settings import Processing
from linkwise.analysis.torques import Decomposer
from linkwise.analysis.verify import Closure, against_recursion
from linkwise.analysis.work import WorkSum
from linkwise.errors import LinkwiseError
from linkwise.package.load import Array
from linkwise.progress import Progress

Sink = Callable[[Array], None]
"""A sink is given one block (rows, samples) after the other; the block is the sink's own."""

INNER, LEAST = 4096, 1024
"""Most and fewest samples computed at once: intermediate values stay in the cache; fewer for wide results."""

BLOCK_BYTES = 48 << 20
"""Approximate size in bytes of a block handed on: some three of them are in memory at any time."""


def span_of(samples: Samples, processing: Processing) -> tuple[int, int]:
    """Return the first sample analysed and the one after the last.

    Raises LinkwiseError if there are too few samples.
    """
    count, needed = len(samples.time), processing.span
    cut = needed // 2 if processing.edges == "trim" else 0
    if count < needed + 2 * cut:
        raise LinkwiseError(
            f"{count} samples, but the {processing.derivative} formula"
            f"{' with trimmed edges' if cut else ''} needs {needed + 2 * cut} or more"
        )
    return cut, count - cut


def stream(
    samples: Samples, decomposer: Decomposer, processing: Processing, sink: Sink, progress: Progress
) -> WholeMovement:
    """Send every block to `sink`, which works in a thread beside the computation.

    Raises LinkwiseError for too few samples, results that overflow, and a robot whose torques do not add up.
    """
    start, stop = span_of(samples, processing)
    total = np.zeros(len(decomposer.rows))
    peak = np.zeros(len(decomposer.rows))
    work = WorkSum(decomposer.rows)
    closure = Closure()
    inner = _at_once(len(decomposer.rows))
    with ThreadPoolExecutor(1) as writer, np.errstate(over="ignore", invalid="ignore"):
        pending: Future[None] | None = None
        for first, last in _blocks(start, stop, len(decomposer.rows)):
            block = np.empty((len(decomposer.rows), last - first))
            for at in range(first, last, inner):
                end = min(at + inner, last)
                q, qd, qdd = derivatives(samples.q, samples.rate, at, end, processing)
                out = block[:, at - first : end - first]
                closure |= decomposer.fill(out, samples.time[at:end], q, qd, qdd)
                magnitude = np.abs(out)
                added = magnitude.sum(axis=1)
                if not np.isfinite(added).all():
                    raise _overflow(samples, decomposer, out, at)
                total += added
                np.maximum(peak, magnitude.max(axis=1), out=peak)
                work(out)
            closure |= against_recursion(decomposer.robot, decomposer.loads, decomposer.rows, block)
            closure.check()
            if pending is not None:
                pending.result()
            pending = writer.submit(sink, block)
            let_go(samples.q)
            progress("analysing", last - start, stop - start)
        if pending is not None:
            pending.result()
    totals, works = Totals(total / (stop - start), peak), work.work(1 / samples.rate)
    return WholeMovement(totals, *works, closure, stop - start)


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
