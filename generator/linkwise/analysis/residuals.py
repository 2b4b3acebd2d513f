"""Residuals: what a motion asks of coordinates that nothing drives, as those of a floating base.

They are no torques of joints: if robot, motion and external forces fitted each other they would be zero.
J. L. Hicks et al., "Is my model good enough? Best practices for verification and validation of
musculoskeletal models and simulations of movement", J. Biomech. Eng. 137(2), 020905, 2015, take peaks of
residual forces up to 5 % of the largest net external force, and of residual moments up to 1 % of it times the
height of the centre of mass.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.loads.placed import PlacedLoad, model_pose
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_rows import ResultRows
from linkwise.arrays import Array
from linkwise.escape import listed

OF_FORCE, OF_MOMENT = 0.05, 0.01
"""Parts of the largest net external force, and of that times the centre of mass's height, up to which peaks
are taken."""
SOURCE = "Hicks et al. 2015, doi:10.1115/1.4029304"


@dataclass(frozen=True)
class Residual:
    """Residual of one coordinate over the whole movement, in N·m or N."""

    joint: str
    unit: str
    peak: float
    rms: float
    limit: float | None
    """Peak that is taken; None without external forces."""
    time: float
    """Time of the peak in s: at the ends of a log filters and differences are worst."""

    @property
    def line(self) -> str:
        """Text of it for a terminal."""
        told = f"{self.joint} {self.peak:.3g} {self.unit} at {self.time:.6g} s (rms {self.rms:.3g}"
        if self.limit is None:
            return f"{told})"
        word = "within" if self.peak <= self.limit else "ABOVE"
        return f"{told}; {word} {self.limit:.3g})"


@dataclass(frozen=True)
class ResidualReport:
    """Residuals of a movement, and what they are held against."""

    residuals: tuple[Residual, ...]
    force: float | None
    """Largest net external force in N; None without any."""
    height: float | None
    """Mean height of the centre of mass above the world's origin, in m; None without external forces."""

    @property
    def lines(self) -> Iterator[str]:
        """Yield the lines that a terminal shows."""
        if not self.residuals:
            return
        told = listed([one.line for one in self.residuals], len(self.residuals), longest=200)
        yield f"residuals, as nothing drives these: peaks of {told}; where motors do, add --unactuated none"
        if self.force is None or self.height is None:
            yield "no external force is given, so that there is nothing to hold residuals against"
        else:
            yield (
                f"residuals are held against {OF_FORCE:.0%} of the largest net external force,"
                f" {self.force:.4g} N, and {OF_MOMENT:.0%} of it times the height of the centre of mass,"
                f" {self.height:.3g} m ({SOURCE})"
            )

    def record(self) -> dict[str, Any]:
        """Return this as plain data."""
        return {
            "source": SOURCE,
            "largest_net_external_force_N": self.force,
            "mean_height_of_centre_of_mass_m": self.height,
            "of": [vars(one) for one in self.residuals],
        }


class ResidualSums:
    """A sink that finds residuals of a movement, block by block."""

    def __init__(self, robot: OpenedRobot, rows: ResultRows, loads: tuple[PlacedLoad, ...]) -> None:
        """Set up the sums of those residuals whose torques have a row."""
        told = dict(zip(rows["tau"].at[:, 0].tolist(), rows["tau"].numbers.tolist(), strict=True))
        self._robot, self._rows, self._loads = robot, rows, loads
        # Where the robot stands on contacts, these bear what nothing drives.
        self._joints = [i for i in robot.residuals if i in told and robot.contacts is None]
        self._numbers = [told[i] for i in self._joints]
        self._count, self._height, self._force = 0, 0.0, 0.0
        self._peaks, self._times, self._squares = np.zeros((3, len(self._joints)))

    def __call__(self, block: Array) -> None:
        """Add a block of the result (rows, samples)."""
        values = block[self._numbers]
        self._count += block.shape[1]
        for number, sizes in enumerate(np.abs(values)):
            if len(sizes) and (peak := float(sizes.max())) > self._peaks[number]:
                self._peaks[number], self._times[number] = peak, block[0, int(sizes.argmax())]
        self._squares += np.einsum("rs,rs->r", values, values)
        if self._loads and self._joints:
            q, pose = self._rows.dense("q", block), model_pose(self._robot.model)
            outside = [one for load in self._loads if not load.is_muscle for one in load.wrenches]
            forces = sum((one.wrench(block[0], q, pose).force for one in outside), np.zeros((len(q), 3)))
            self._force = max(self._force, float(np.linalg.norm(forces, axis=-1).max(initial=0.0)))
            self._height += float(heights_of_mass(self._robot, q).sum())

    def report(self) -> ResidualReport:
        """Return what was found."""
        force = self._force if self._loads and self._force > 0.0 else None
        height = None if force is None else self._height / max(1, self._count)
        limits: dict[str, float | None] = {"m": None, "rad": None}
        if force is not None and height is not None:
            limits = {"m": OF_FORCE * force, "rad": OF_MOMENT * abs(height) * force}
        rms = np.sqrt(self._squares / max(1, self._count)).tolist()
        robot = self._robot
        return ResidualReport(
            tuple(
                Residual(robot.joints[i], robot.torque_units[i], peak, root, limits[robot.units[i]], time)
                for i, peak, root, time in zip(
                    self._joints, self._peaks.tolist(), rms, self._times.tolist(), strict=True
                )
            ),
            force,
            height,
        )


def heights_of_mass(robot: OpenedRobot, q: Array) -> Array:
    """Return the height of the centre of mass above the world's origin, (S,) in m, at q (S, n)."""
    tree, recursion = robot.tree, robot.recursion
    assert tree is not None  # as a robot of energies has no residuals
    assert recursion is not None
    masses = np.array([link.mass for link in tree.links])
    places = recursion.places([(link.joint, np.array(link.com)) for link in tree.links], q)
    up = np.array(robot.up) / np.linalg.norm(robot.up)
    found: Array = (places @ up) @ masses / masses.sum()
    return found
