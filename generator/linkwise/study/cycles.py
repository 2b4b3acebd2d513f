"""Cycles of a trial, such as gait cycles: where each begins and ends, and its samples over 0 to 100 %.

They are taken as samples arrive; at the end there are their mean and deviation.
"""

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.disk_rows import let_go
from linkwise.analysis.job import Job
from linkwise.analysis.loads import FORCE
from linkwise.analysis.logs.checks import named_once
from linkwise.analysis.phases import PlacedPhase
from linkwise.arrays import Array, Index, Mask
from linkwise.errors import LinkwiseError, within
from linkwise.extras import extra
from linkwise.study.deviation_columns import RANDOM, WHOLE, is_deviation
from linkwise.study.kept_curves import kept_curves
from linkwise.study.ledger import CURVES
from linkwise.study.paths import opened_here
from linkwise.study.plan import SIDES, Cycles, StudyPlan, Trial
from linkwise.study.summary import RunningMoments

AT_ONCE = 1 << 18
MARGIN = 12
"""Samples beyond a cycle's ends that its splines use."""
Span = tuple[float, float]


def cycle_spans(cycles: Cycles, job: Job, trial: Trial) -> list[Span]:
    """Return the beginning and end of each whole cycle in s; raise LinkwiseError where there is none."""
    time, begun = job.analysed.time, ""
    if cycles.table:
        found = written_cycles(cycles.table, bool(cycles.sides)).get((trial.recording, trial.side), [])
    else:
        up, down = _edges(job)
        begun = f"; it begins {len(up)} and ends {len(down)} times there"
        if cycles.start:
            found = list(pairwise(up.tolist()))
        else:
            ends = (down[down > at] for at in up)
            found = [(float(at), float(some[0])) for at, some in zip(up, ends, strict=True) if len(some)]
    lasting = [(a, b) for a, b in found if cycles.shortest <= b - a <= cycles.longest]
    inside = sorted({(a, b) for a, b in lasting if time[0] <= a < b <= time[-1]})
    if not inside:
        what = cycles.table or cycles.what(trial.side)
        between = (
            f": none of {len(found)} that last {cycles.shortest:g} to {cycles.longest:g} s"
            if found
            else begun or f": it has none of {trial.recording!r}"
        )
        raise LinkwiseError(f"no whole cycle by {what!r} between {time[0]:g} and {time[-1]:g} s{between}")
    return inside


def _edges(job: Job) -> tuple[Array, Array]:
    """Return when the phase that defines the cycles begins, and when it ends, in s, within the movement.

    By a load these are crossings of its own samples. By all else, of the motion's samples the first that is
    on, and the last.
    """
    time, pressing = job.analysed.time, job.phases[-1].pressing
    if pressing is not None:
        table = pressing.table
        edges = crossings(table[:, 0], np.linalg.norm(table[:, FORCE], axis=1), job.phases[-1].above)
        first, last = time[0], time[-1]
        steady = without_flicker(*edges, _flicker(job.phases[-1]))
        up, down = (edge[(edge >= first) & (edge <= last)] for edge in steady)
        return up, down
    on = _on(job)
    return time[1:][on[1:] & ~on[:-1]], time[:-1][~on[1:] & on[:-1]]


def crossings(time: Array, values: Array, above: float) -> tuple[Array, Array]:
    """Return when samples (S,) come above a limit, and when they no longer are, by lines between them."""
    on = values > above
    edges = []
    for at in (np.flatnonzero(on[1:] & ~on[:-1]), np.flatnonzero(~on[1:] & on[:-1])):
        share = (above - values[at]) / (values[at + 1] - values[at])
        edges.append(time[at] + share * (time[at + 1] - time[at]))
    return edges[0], edges[1]


def without_flicker(up: Array, down: Array, shortest: float) -> tuple[Array, Array]:
    """Return when something begins and ends, without spans and then without gaps of less than `shortest`.

    Gaps come last: noise about a threshold would else join to long spans.
    """
    edges = sorted([*((at, True) for at in up.tolist()), *((at, False) for at in down.tolist())])
    for is_begin in (True, False):
        kept: list[tuple[float, bool]] = []
        for at, begins in edges:
            if kept and kept[-1][1] is is_begin and begins is not is_begin and at - kept[-1][0] < shortest:
                kept.pop()
            else:
                kept.append((at, begins))
        edges = kept
    return np.array([at for at, begins in edges if begins]), np.array(
        [at for at, begins in edges if not begins]
    )


def _flicker(phase: PlacedPhase) -> float:
    """Return how long, in s, a load must press or leave off to count: half a period of its low-pass.

    What is shorter that filter takes for noise; without one all counts.
    """
    cutoff = None if phase.load is None else phase.load.cutoff
    return 0.5 / cutoff if cutoff else 0.0


def told_of_ends(cycles: Cycles, job: Job) -> str:
    """Return in words at which instants cycles begin and end."""
    if cycles.table:
        return "at the times of the table"
    phase = job.phases[-1]
    told = phase.told.removeprefix("cycle: ")
    if phase.pressing is None:
        return f"{told}; at samples of the motion"
    own = phase.pressing.table[:, 0]
    rate = (len(own) - 1) / np.ptp(own) if len(own) > 1 else 0.0
    least = 1000 * _flicker(phase)
    passed_over = f"; what lasts less than {least:.3g} ms does not count" if least else ""
    return f"{told}; between the load's own samples, of {rate:.6g} Hz, by straight lines{passed_over}"


def _on(job: Job) -> Mask:
    """Return at which samples the phase that defines the cycles is on, the last of the job."""
    phase, times = job.phases[-1], job.decomposer.times
    samples, robot = job.analysed, job.decomposer.robot
    parts = []
    for at in range(0, len(samples.time), AT_ONCE):
        span = slice(at, at + AT_ONCE)
        time, q = samples.time[span], samples.q[span]
        shares = np.zeros((0, 0)) if times is None else times.shares(robot.model, time, q).T
        parts.append(phase.on(robot, time, q, shares))
        let_go(samples.q)
    return np.concatenate(parts)


def written_cycles(table: str, is_sided: bool = False) -> dict[tuple[str, str], list[Span]]:
    """Return the cycles of each trial and side in a table; the side is empty where cycles are of none.

    Raises LinkwiseError, with the row, for an invalid one.
    """
    found: dict[tuple[str, str], list[Span]] = {}
    needed = ("trial", "start", "end", *(["side"] if is_sided else []))
    with opened_here(table) as path, path.open(newline="", encoding="utf-8-sig") as file:
        try:
            reader = csv.DictReader(file)
            with within(table):
                names = named_once(reader.fieldnames or ())
            if not set(needed) <= set(names):
                raise LinkwiseError(f"{table}: name its columns {', '.join(needed[:-1])} and {needed[-1]}")
            for number, row in enumerate(reader, 2):
                with within(f"{table}, row {number}"):
                    side = _side(row["side"]) if is_sided else ""
                    found.setdefault((row["trial"], side), []).append(_span(row["start"], row["end"]))
        except (UnicodeDecodeError, csv.Error) as error:
            raise LinkwiseError(f"{table}: not a table of text in UTF-8: {error}") from error
    return found


def _side(text: str | None) -> str:
    if text not in SIDES:
        raise LinkwiseError(f"side is {text!r}; give right or left")
    return text


def _span(start: str, end: str) -> Span:
    try:
        span = float(start), float(end)
    except (TypeError, ValueError):
        raise LinkwiseError("start and end are numbers, in s") from None
    if not span[0] < span[1]:
        raise LinkwiseError(f"the cycle from {start} to {end} s does not go forwards")
    return span


@dataclass
class CycleSink:
    """Receiver of blocks of samples that passes on each cycle, at even shares of its time.

    Blocks have columns in rows, the time first; spans ascend; take(number, points, samples) receives
    points (columns, points), and the samples from end to end (columns, samples), the time among them; a
    cubic spline through samples is what there is between them, of columns `squared` the root of that through
    their squares: a deviation has a kink where it is 0, and would come out negative beside it
    """

    spans: Sequence[Span]
    points: int
    take: Callable[[int, Array, Array], None]
    squared: Sequence[int] = ()
    _kept: list[Array] = field(default_factory=list)
    _next: int = 0

    def __call__(self, block: Array) -> None:
        """Take a block (columns, samples)."""
        if self._next == len(self.spans):
            self._kept = []
            return
        start, end = self.spans[self._next]
        self._kept.append(block)
        if block[0, -1] < start:  # what lies between cycles is not kept
            self._kept = [np.concatenate(self._kept, axis=1)[:, -2 - MARGIN :].copy()]
        elif block[0, -1] >= end:
            self._hand_on(MARGIN)

    def finish(self) -> None:
        """Pass on the cycles that end with the last samples."""
        self._hand_on(0)

    def _hand_on(self, beyond: int) -> None:
        """Pass on all cycles that have `beyond` samples after their end, and keep what later ones need."""
        there = np.concatenate(self._kept, axis=1) if self._kept else np.empty((1, 0))
        while self._next < len(self.spans):
            start, end = self.spans[self._next]
            first = max(0, int(np.searchsorted(there[0], start, side="right")) - 1 - MARGIN)
            last = int(np.searchsorted(there[0], end)) + 1
            if last + beyond > there.shape[1]:
                there = there[:, first:]
                break
            part: Any = there[:, first : last + MARGIN]
            points = self._between(part, np.linspace(start, end, self.points))
            inside = part[:, (part[0] > start) & (part[0] < end)]
            self.take(self._next, points, np.concatenate([points[:, :1], inside, points[:, -1:]], axis=1))
            self._next += 1
        self._kept = [there.copy()]

    def _between(self, samples: Array, time: Array) -> Array:
        """Return what samples (columns, samples) are at other times, (columns, points)."""
        squared = list(self.squared)
        smooth = samples.copy()
        smooth[squared] **= 2
        points: Array = extra("scipy.interpolate").CubicSpline(samples[0], smooth, axis=1)(time)
        points[squared] = np.sqrt(np.maximum(points[squared], 0.0))
        return points


class TrialCycles:
    """Receiver of samples that passes on each cycle; none without cycles.

    names: of the columns
    write: receives rows (columns, points), their cycle's number and percent of it, (points,) each
    integrals: receives samples of each cycle, as `CycleSink` takes them
    """

    def __init__(
        self,
        plan: StudyPlan,
        job: Job,
        names: Sequence[str],
        write: Callable[[Array, Index, Array], None],
        integrals: Callable[[Array], None],
    ) -> None:
        self._write, self._integrals = write, integrals
        self._names = list(names)
        self._of_motion_alone = job.uncertain.is_of_motion_alone
        self._points = 0 if plan.cycles is None else plan.cycles.points
        self._kept = kept_curves(plan, self._names)
        self._moments = RunningMoments(len(self._kept) * self._points)
        with within(job.source):
            self.ends = "" if plan.cycles is None else told_of_ends(plan.cycles, job)
            spans = [] if plan.cycles is None else cycle_spans(plan.cycles, job, plan.trials[0])
        squared = [at for at, name in enumerate(self._names) if is_deviation(name)]
        self.sink = CycleSink(spans, self._points, self._take, squared)

    @property
    def count(self) -> int:
        """Number of cycles so far."""
        return self._moments.count

    def _take(self, number: int, rows: Array, samples: Array) -> None:
        self._write(rows, np.full(self._points, number, np.intp), np.linspace(0, 100, self._points))
        self._integrals(samples)
        shifted = rows[self._kept]
        shifted[0] -= rows[0, 0]  # time, from the beginning of the cycle
        self._moments(shifted.reshape(-1, 1))

    def finish(self, draft: Path) -> None:
        """Take the remaining cycles, and write the curves."""
        if not self._points:
            return
        self.sink.finish()
        names = [self._names[at] for at in self._kept]
        curves = self._moments.table.reshape(-1, len(names), self._points)[:2]
        if self._of_motion_alone:
            whole = [at for at, name in enumerate(names) if name.startswith(WHOLE)]
            curves = np.concatenate([curves, curves[:, whole]], axis=1)
            names += [f"{RANDOM}{names[at].removeprefix(WHOLE)}" for at in whole]
        np.savez(draft / CURVES, curves=curves, names=names, cycles=self.count)
