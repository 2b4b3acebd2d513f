"""All that is uncertain of one analysis: the robot's bodies, the log's motion, the loads."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

from linkwise.analysis.uncertain_file import CERTAIN, UncertainRobot
from linkwise.analysis.uncertain_loads import LoadSpread
from linkwise.analysis.uncertain_motion import MotionNoise


@dataclass(frozen=True, eq=False)
class UncertainInputs:
    """Uncertainty of what torques follow from; nothing is uncertain unless given."""

    stated: UncertainRobot | None = None
    motion: MotionNoise | None = None
    loads: tuple[LoadSpread | None, ...] = ()
    load_names: tuple[str, ...] = ()

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
            "certain": ", ".join([*certain, CERTAIN]),
        }

    @property
    def warnings(self) -> Iterator[str]:
        """Yield what was found out about noise."""
        if self.motion is not None and self.motion.is_estimated:
            yield self.motion.told
            if self.motion.suspicion:
                yield self.motion.suspicion
