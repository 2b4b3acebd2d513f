"""Sources that drive a robot's coordinates, each as a column of generalised forces F_x.

    M q̈ = Σ_i u_i − Σ_js c1_ijs q̇_s − Σ_j g_ij − spring, damping, friction − Σ_e τ_ie + Aᵀ λ

with u_i = τ_i, the torque of the joint, and with the armatures in M. M, c1, g and passive torques are those
of the open tree. Where joints are tied, τ_i and τ_ie are torques of the independent joints: on these alone,
they move the robot as do any other forces with the same Gᵀ F.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.model_side import Side
from linkwise.analysis.result_columns import Column
from linkwise.analysis.result_quantities import PASSIVE, Quantity
from linkwise.analysis.term_rows import mirrored
from linkwise.package.load import Array

LOSSES: tuple[Quantity, ...] = ("acc_spring", "acc_damping", "acc_friction")
"""Shares of passive torques, in the order of `passive_torque`."""


@dataclass(frozen=True)
class ForceSource:
    """A source: its link, its cause, and the torques that it consists of."""

    quantity: Quantity
    link: int | None
    cause: int | None
    torques: tuple[tuple[int, int], ...]
    """Pairs of a coordinate and the place of its torque: a row of the result, a packed value, a joint."""


@dataclass(frozen=True)
class InducedSources:
    """The sources of a robot, and their forces."""

    robot: LoadedRobot
    every: tuple[ForceSource, ...]

    @classmethod
    def of(cls, robot: LoadedRobot, columns: Sequence[Column]) -> "InducedSources":
        """Collect the sources of a robot.

        columns: those of torques, in the result's order
        """
        found: dict[tuple[Quantity, int | None, int | None], list[tuple[int, int]]] = {}
        for quantity, link, cause, i, at in _parts(robot, columns):
            found.setdefault((quantity, link, cause), []).append((i, at))
        return cls(robot, tuple(ForceSource(*key, tuple(parts)) for key, parts in found.items()))

    def mass_and_forces(
        self, out: Array, packed: Side, q: Array, qd: Array, qdd: Array
    ) -> tuple[Array, Array]:
        """Return M (S, n, n) and F_x (S, n, X).

        out: the torques (columns, S); packed: values of the robot's model
        """
        model = opened(self.robot)
        if self.robot.constrained is not None:
            packed = model.packed(q, qd, qdd)
        own = model.passive_torque(q, qd, qdd)[:3] if self.robot.passive else ()
        torques: dict[Quantity, Array] = dict(zip(LOSSES, own, strict=False))
        torques |= {"acc_qd": packed.velocity, "acc_gravity": packed.gravity}
        forces = np.zeros((*q.shape, len(self.every)))
        for x, source in enumerate(self.every):
            there = torques.get(source.quantity, out.T)
            moved = qd[:, source.cause] if source.quantity == "acc_qd" else 1.0
            for i, at in source.torques:
                torque = there[:, at] * moved
                forces[:, i, x] += torque if source.quantity == "acc_tau" else -torque
        return self._mass(packed.acceleration, q.shape[1]), forces

    def _mass(self, packed: Array, n: int) -> Array:
        """Return M (S, n, n) of links, payloads and the armatures behind gears."""
        mass = np.zeros((len(packed), n, n))
        for i, _, k, source in mirrored(opened(self.robot).layout):
            mass[:, i, k] += packed[:, source]
        for own in self.robot.passive:
            mass[:, own.coordinate, own.coordinate] += own.ratio**2 * own.armature
        return mass


def opened(robot: LoadedRobot) -> Any:
    """Return the model of links and payloads without ties."""
    model: Any = robot.model
    return model if robot.constrained is None else model.open


def _parts(
    robot: LoadedRobot, columns: Sequence[Column]
) -> Iterator[tuple[Quantity, int | None, int | None, int, int]]:
    """Yield the quantity, link and cause of a source, with a coordinate and the place of its torque."""
    layout = opened(robot).layout
    for row, c in enumerate(columns):
        if c.quantity == "tau" and c.joint is not None:
            yield "acc_tau", None, c.joint, c.joint, row
    velocities = [(*ijk, at) for at, ijk in enumerate(layout.velocity.tolist())]
    for i, j, k, at in sorted(velocities):
        yield "acc_qd", j, k, i, at
    for i, j, at in sorted((*ij, at) for at, ij in enumerate(layout.gravity.tolist())):
        yield "acc_gravity", j, None, i, at
    for quantity, number in zip(LOSSES, PASSIVE.values(), strict=False):
        for i in sorted({own.coordinate for own in robot.passive if getattr(own, number)}):
            yield quantity, None, i, i, i
    for row, c in enumerate(columns):
        if c.quantity == "tau_load" and c.joint is not None:
            yield "acc_load", None, c.cause, c.joint, row
