"""Rows of a result that hold standard deviations of torques, where bodies are uncertain.

A deviation stands for each τ_i, τ_ij and share of it by acceleration, velocity and gravity. Springs, damping,
friction, armature and loads, which are part of τ_i too, count as certain.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from linkwise_runtime.certainty.share_deviations import ShareDeviations, share_deviations

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_quantities import DEVIATION_OF
from linkwise.analysis.result_rows import Place, ResultRows
from linkwise.analysis.settings import Convention
from linkwise.analysis.term_rows import TermArrays
from linkwise.analysis.uncertain_file import UncertainRobot
from linkwise.arrays import Array


@dataclass(frozen=True)
class DeviationRows:
    """Fills the rows of deviations; none where nothing is uncertain."""

    robot: OpenedRobot
    uncertain: UncertainRobot | None
    convention: Convention
    sources: TermArrays
    """Places of the rows of τ_ij and its terms among packed values, in the order of rows."""

    def places(self, torques: Sequence[Place]) -> Iterator[Place]:
        """Yield the place of a deviation for each of these torques that has one."""
        if self.uncertain is not None:
            for deviation, torque in DEVIATION_OF.items():
                yield from ((deviation, at) for name, at in torques if name == torque)

    @cached_property
    def deviations(self) -> ShareDeviations:
        """Deviations of the robot's shares, packed."""
        assert self.uncertain is not None
        return share_deviations(self.robot.model.backend, self.uncertain.bodies)

    def fill(self, out: Array, rows: ResultRows, q: Array, qd: Array, qdd: Array) -> None:
        """Fill the rows in `out` (rows, S) for motion (S, n)."""
        if self.uncertain is None:
            return
        _, motion = self.robot.model.door.read({"q": q, "qd": qd, "qdd": qdd})
        found: Any = self.deviations.packed(motion, with_sums=False)
        c2, c1, gravity, torque, whole = (np.asarray(a) for a in found[:5])
        twice = 2.0 if self.convention == "gradient" else 1.0
        rows.put(out, "sd/tau", whole)
        for name, values, places, motions in (
            ("sd/tau_link", torque, self.sources.torque, None),
            ("sd/tau_qdd", c2, self.sources.acceleration, np.abs(qdd)),
            ("sd/tau_qd", c1, self.sources.velocity, twice * np.abs(qd)),
            ("sd/tau_gravity", gravity, self.sources.gravity, None),
        ):
            entries = rows[name]
            causes = None if motions is None else entries.at[:, 2].tolist()
            for number, (row, place) in enumerate(zip(out[entries.rows], places, strict=True)):
                if motions is None or causes is None:
                    row[:] = values[:, place]
                else:
                    np.multiply(values[:, place], motions[:, causes[number]], out=row)
