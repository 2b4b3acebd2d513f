"""All that is uncertain of one analysis: the robot's bodies, the log's motion, the loads."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

from linkwise.analysis.loads.placed import PlacedLoad
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.samples import Samples
from linkwise.analysis.settings import Processing
from linkwise.analysis.uncertain_file import CERTAIN, UncertainRobot
from linkwise.analysis.uncertain_loads import LoadSpread
from linkwise.analysis.uncertain_motion import MotionNoise, motion_noise
from linkwise.arrays import Array
from linkwise.errors import within


@dataclass(frozen=True, eq=False)
class UncertainInputs:
    """Uncertainty of what torques follow from; nothing is uncertain unless given."""

    stated: UncertainRobot | None = None
    motion: MotionNoise | None = None
    loads: tuple[LoadSpread | None, ...] = ()
    load_names: tuple[str, ...] = ()
    certain: tuple[str, ...] = ()
    """More of this analysis that counts as certain, or has no deviation."""

    @property
    def bodies(self) -> UncertainBodies | None:
        """Uncertainty of the robot's bodies."""
        return None if self.stated is None else self.stated.bodies

    @property
    def is_of_motion_alone(self) -> bool:
        """True if deviations are by noise of motion and nothing else."""
        return self.motion is not None and self.bodies is None and not any(self.loads)

    def record(self) -> dict[str, Any] | None:
        """Return what was assumed as plain data; None where nothing is uncertain."""
        if self.stated is None:
            return None
        loads = [
            {"name": name, **{key: sizes.tolist() for key, sizes in spread._asdict().items()}}
            for name, spread in zip(self.load_names, self.loads, strict=True)
            if spread is not None
        ]
        certain = [
            what
            for what, given in (("bodies", self.bodies), ("motion", self.motion), ("loads", loads))
            if not given
        ]
        return {
            "file": self.stated.file,
            **self.stated.record(),
            **({} if self.motion is None else {"motion": self.motion.record()}),
            **({"loads": loads} if loads else {}),
            "certain": ", ".join([*certain, *self.certain, CERTAIN]),
        }

    @property
    def warnings(self) -> Iterator[str]:
        """Yield what was found out about noise."""
        if self.motion is not None and self.motion.is_estimated:
            yield self.motion.told
            if self.motion.suspicion:
                yield self.motion.suspicion


def uncertain_inputs(
    file: Path | None,
    stated: UncertainRobot | None,
    raw: Array,
    samples: Samples,
    processing: Processing,
    robot: OpenedRobot,
    loads: Sequence[PlacedLoad],
    certain: Sequence[str] = (),
) -> UncertainInputs:
    """Return all that is uncertain of a log.

    file, stated: the file that says so, and what it says; raw: the log's first positions, as they were before
    the filter; certain: what else counts as certain

    Raises LinkwiseError, which names the file, as `motion_noise` and `StatedLoads.placed` do.
    """
    if stated is None:
        return UncertainInputs()
    noise: MotionNoise | None = None
    spreads: tuple[LoadSpread | None, ...] = (None,) * len(loads)
    with within(str(file)):
        if stated.motion is not None:
            noise = motion_noise(stated.motion, raw, samples, processing, robot)
        if stated.loads is not None:
            spreads = stated.loads.placed(loads, robot)
    return UncertainInputs(stated, noise, spreads, tuple(load.name for load in loads), tuple(certain))
