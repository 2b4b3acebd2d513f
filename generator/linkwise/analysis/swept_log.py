"""A log that is analysed anew at each cutoff of a sweep; of each analysis only sizes of rows are kept."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from linkwise.analysis.cutoff_range import FLAG, CutoffRange
from linkwise.analysis.cutoff_sweep import CutoffSweep, RowSizes
from linkwise.analysis.disk_rows import copied
from linkwise.analysis.filtering import lowpass, sections_at_rest
from linkwise.analysis.samples import Samples
from linkwise.analysis.settings import Lowpass, Processing
from linkwise.analysis.stream import stream
from linkwise.analysis.torques import Decomposer
from linkwise.arrays import Array
from linkwise.errors import within
from linkwise.progress import Progress

STAGE = "sweeping"


@dataclass(frozen=True, eq=False)
class UnfilteredLog:
    """Samples of a log as they were before the filter, and the cutoffs at which it is analysed."""

    samples: Samples
    asked: CutoffRange
    settings: Lowpass
    """The low-pass of the analysis itself."""


def before_filter(
    asked: CutoffRange | None, samples: Samples, processing: Processing, buffer: Path | None
) -> UnfilteredLog | None:
    """Return a copy of samples that are not filtered yet; None where no sweep of cutoffs is asked for.

    buffer: a directory that keeps it in a disk buffer, not in memory

    Raises LinkwiseError for cutoffs that the log cannot be filtered at.
    """
    settings = processing.lowpass
    if asked is None or settings is None:
        return None
    for cutoff in (asked.low, asked.high):
        sections_at_rest(samples.rate, replace(settings, cutoff=cutoff), FLAG)
    return UnfilteredLog(replace(samples, q=copied(samples.q, buffer)), asked, settings)


@dataclass(frozen=True, eq=False)
class SweptLog:
    """A log before the filter, and what decomposes it at each cutoff."""

    log: UnfilteredLog
    decomposer: Decomposer
    """Decomposer without deviations and traces."""
    processing: Processing
    buffer: Path | None
    """Directory that keeps filtered copies in a disk buffer, one at a time; None keeps them in memory."""

    def run(self, own: RowSizes, progress: Progress) -> CutoffSweep:
        """Return the sizes at all cutoffs; own: those of the analysis itself.

        Raises LinkwiseError, with the cutoff, for what cannot be analysed there.
        """
        asked, mine = self.log.asked, self.log.settings.cutoff
        cutoffs = asked.cutoffs(mine)
        others = [cutoff for cutoff in cutoffs if cutoff != mine]
        found = {mine: own.sizes()}
        for number, cutoff in enumerate(others):

            def stage(_: str, done: int, whole: int, number: int = number) -> None:
                progress(STAGE, number * whole + done, len(others) * whole)

            with within(f"{FLAG} at {cutoff:.4g} Hz"):
                found[cutoff] = self._sizes(cutoff, stage)
        rms, peak, time = np.stack([np.array(found[cutoff]) for cutoff in cutoffs], axis=-1)
        robot = self.decomposer.robot
        places = np.array(cutoffs)
        low, high = (int(np.abs(places - end).argmin()) for end in (asked.low, asked.high))
        numbers = cutoffs.index(mine), low, high
        names = robot.joints, robot.links, robot.residuals_apart
        return CutoffSweep(own.columns, places, *numbers, rms, peak, time, *names)

    def _sizes(self, cutoff: float, progress: Progress) -> tuple[Array, Array, Array]:
        """Return what `RowSizes` tells of the log filtered at another cutoff."""
        log, settings = self.log, replace(self.log.settings, cutoff=cutoff)
        samples = replace(log.samples, q=copied(log.samples.q, self.buffer))
        lowpass(samples.q, samples.rate, settings, flag=FLAG)
        sizes = RowSizes(self.decomposer.rows)
        stream(samples, self.decomposer, replace(self.processing, lowpass=settings), sizes, progress)
        return sizes.sizes()
