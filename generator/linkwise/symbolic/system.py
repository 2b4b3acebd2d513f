"""What every description becomes: coordinates, and one energy a link."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import sympy as sp

from linkwise.robot.robot import Coordinate, Joint, Mat3, Robot, Scalar, Vec3

Definition: TypeAlias = tuple[sp.Symbol, sp.Expr]


@dataclass(frozen=True)
class RigidBody:
    """The facts behind a rigid link's energy, which the rigid-link rule works from.

    `chain` holds the indices of the robot's links from the root to this one, `joints` their joints.
    """

    chain: tuple[int, ...]
    joints: tuple[Joint, ...]
    mass: Scalar
    com: Vec3
    inertia: Mat3
    gravity: Vec3


@dataclass(frozen=True)
class Steps:
    """Named definitions in order, each in terms of earlier ones; links further out may use `exports`."""

    definitions: tuple[Definition, ...] = ()
    exports: tuple[sp.Symbol, ...] = ()


@dataclass(frozen=True)
class LinkEnergy:
    """One link's kinetic and potential energy in J; L_j = kinetic − potential.

    `kinetic` may use the symbols of `twist`, `potential` those of `height`: named steps that continue the
    exports of link `parent`, so that a long chain never has to be written out. Energies written by a user
    need none. `body` is there for a rigid link only.
    """

    name: str
    kinetic: sp.Expr
    potential: sp.Expr
    parent: int | None = None
    twist: Steps = Steps()
    height: Steps = Steps()
    body: RigidBody | None = None


@dataclass(frozen=True)
class System:
    """Coordinates, links and run-time parameters: all that derivation and emission know of a robot."""

    name: str
    coordinates: tuple[Coordinate, ...]
    links: tuple[LinkEnergy, ...]
    parameters: Mapping[sp.Symbol, float] = field(default_factory=dict)
    robot: Robot | None = None

    def lineage(self, link: int) -> tuple[LinkEnergy, ...]:
        """Return the links whose definitions link `link` builds on, oldest first, itself last."""
        chain: list[LinkEnergy] = []
        at: int | None = link
        while at is not None:
            chain.append(self.links[at])
            at = self.links[at].parent
        return tuple(reversed(chain))

    def path(self, link: int) -> tuple[int, ...]:
        """path(j): the coordinates that move link `link`, in ascending order."""
        body = self.links[link].body
        if body is not None:
            return tuple(sorted({joint.coordinate for joint in body.joints}))
        energy = self.links[link]
        used = energy.kinetic.free_symbols | energy.potential.free_symbols
        return tuple(k for k, c in enumerate(self.coordinates) if used & {c.q, c.qd})
