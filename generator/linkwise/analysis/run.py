"""`analyze`: from a log and a robot to arrays in memory, or to a directory of files."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from linkwise.analysis.filtering import lowpass
from linkwise.analysis.result import Analysis
from linkwise.analysis.robot import Robot, load_robot
from linkwise.analysis.samples import Samples, read_samples
from linkwise.analysis.settings import Processing, Reading
from linkwise.analysis.stream import Run, Sink, run, span_of
from linkwise.analysis.terms import Terms
from linkwise.errors import within
from linkwise.progress import Progress, silent

Array = NDArray[np.float64]


def analyze(
    log: str | Path,
    robot: str | Path | Robot,
    reading: Reading | None = None,
    processing: Processing | None = None,
    progress: Progress = silent,
) -> Analysis:
    """Analyse a motion log with a generated robot (its directory), all samples in memory.

    Raises LinkwiseError, naming file, row and column, for what cannot be analysed.
    """
    loaded = robot if isinstance(robot, Robot) else load_robot(Path(robot))
    job = prepare(Path(log), loaded, reading or Reading(), processing or Processing(), progress)
    kept = Keep(len(job.terms.columns), 1)
    return job.analysis(job.run(kept, progress), kept)


@dataclass(frozen=True)
class Job:
    """A log read, filtered and found long enough; `run` does the rest."""

    source: str
    reading: Reading
    processing: Processing
    samples: Samples
    terms: Terms

    def run(self, sink: Sink, progress: Progress) -> Run:
        """Analyse every sample, handing the blocks to `sink`."""
        with within(self.source):
            return run(self.samples, self.terms, self.processing, sink, progress)

    @property
    def count(self) -> int:
        """Samples that will be analysed."""
        start, stop = span_of(self.samples, self.processing)
        return stop - start

    def analysis(self, done: Run, kept: "Keep") -> Analysis:
        """The samples kept, with what is known of them all."""
        return Analysis(
            self.terms.robot,
            self.reading,
            self.processing,
            self.source,
            self.samples.rate,
            self.terms.columns,
            kept.values,
            done.totals,
            done.closure,
            self.samples.ignored,
            self.samples.warnings,
            done.samples,
            kept.stride,
        )


def prepare(
    log: Path,
    robot: Robot,
    reading: Reading,
    processing: Processing,
    progress: Progress,
    spool: Path | None = None,
) -> Job:
    """Read and filter a log; `spool`, a directory, keeps the samples on disk, not in memory."""
    samples = read_samples(log, robot.joints, robot.units, reading, progress, spool)
    with within(str(log)):
        span_of(samples, processing)
        if processing.lowpass is not None:
            lowpass(samples.q, samples.rate, processing.lowpass)
    return Job(log.name, reading, processing, samples, Terms.of(robot, processing.convention))


class Keep:
    """A sink that keeps every `stride`-th sample, the first of all included."""

    def __init__(self, columns: int, stride: int) -> None:
        self.stride = stride
        self._blocks: list[Array] = [np.empty((columns, 0))]
        self._seen = 0

    def __call__(self, block: Array) -> None:
        """Take a block (columns, samples)."""
        first = -self._seen % self.stride
        self._seen += block.shape[1]
        self._blocks.append(block if self.stride == 1 else block[:, first :: self.stride].copy())

    @property
    def values(self) -> Array:
        """All samples kept so far, (columns, kept)."""
        return np.concatenate(self._blocks, axis=1)


def stride_for(samples: int, columns: int, numbers: int, most: int) -> int:
    """Smallest stride that keeps at most `most` samples and `numbers` numbers in all."""
    return max(1, -(-samples // max(2, min(most, numbers // columns))))
