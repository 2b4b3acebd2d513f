"""Systems, one of which every description becomes: coordinates, links and run-time parameters.

A rigid link and a link of hand-written energies are two types, and so are the systems made of them. Both
systems have `name`, `coordinates`, `links`, `link_names`, `parameters`, `notes`, `request` and `path`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import sympy as sp
from linkwise_runtime.html_tables import joint_table, page_part, table

from linkwise.errors import LinkwiseError
from linkwise.robot.notes import Note
from linkwise.robot.robot import Coordinate, Joint, Mat3, Robot, Scalar, Vec3


@dataclass(frozen=True)
class RigidLink:
    """A rigid body that carries mass, and the joints between it and the base.

    chain: indices of the robot's links from the root to this one; joints: the joints of these links
    mass in kg, com in m, inertia about it in kg·m², in the axes of the last joint's frame
    """

    name: str
    chain: tuple[int, ...]
    joints: tuple[Joint, ...]
    mass: Scalar
    com: Vec3
    inertia: Mat3


@dataclass(frozen=True)
class LinkEnergy:
    """Kinetic and potential energy of one link in J, as a user writes them; L_j = kinetic − potential."""

    name: str
    kinetic: sp.Expr
    potential: sp.Expr


@dataclass(frozen=True)
class RigidSystem:
    """A robot, and its links that carry mass; made by `rigid_system`."""

    robot: Robot
    links: tuple[RigidLink, ...]

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows: the robot."""
        return self.robot._repr_html_()

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.robot.name

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Coordinates of the robot."""
        return self.robot.coordinates

    @property
    def notes(self) -> tuple[Note, ...]:
        """Notes on what was done with the robot's description."""
        return self.robot.notes

    @property
    def request(self) -> Mapping[str, Any]:
        """Source that the robot was read from, and the options, as manifests keep them."""
        return self.robot.request

    @property
    def parameters(self) -> dict[sp.Symbol, float]:
        """Run-time parameters and their values."""
        return {sp.Symbol(p.name, real=True): p.value for p in self.robot.parameters}

    @property
    def curved(self) -> bool:
        """True if a joint follows a curve of its coordinate."""
        return any(link.joint.curve for link in self.robot.links)

    @property
    def link_names(self) -> tuple[str, ...]:
        """Names of the links."""
        return tuple(link.name for link in self.links)

    def path(self, link: int) -> tuple[int, ...]:
        """Return path(j): the coordinates that move link `link`, in ascending order."""
        return tuple(sorted({joint.coordinate for joint in self.links[link].joints}))


@dataclass(frozen=True)
class EnergySystem:
    """Links whose energies a user wrote."""

    name: str
    coordinates: tuple[Coordinate, ...]
    links: tuple[LinkEnergy, ...]
    parameters: Mapping[sp.Symbol, float] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()
    request: Mapping[str, Any] = field(default_factory=dict, compare=False)
    """Source that it was read from, and the options, as manifests keep them."""

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows: coordinates, and links with the coordinates moving them."""
        names = [c.name for c in self.coordinates]
        moved = [", ".join(names[k] for k in self.path(j)) for j in range(len(self.links))]
        links = [(str(j), *row) for j, row in enumerate(zip(self.link_names, moved, strict=True))]
        joints = joint_table(names, [c.unit for c in self.coordinates], ())
        return page_part(self.name, joints, table(("j", "link", "moved by"), links))

    @property
    def link_names(self) -> tuple[str, ...]:
        """Names of the links."""
        return tuple(link.name for link in self.links)

    def path(self, link: int) -> tuple[int, ...]:
        """Return path(j): the coordinates that the energy of link `link` depends on, in ascending order."""
        energy = self.links[link]
        used = energy.kinetic.free_symbols | energy.potential.free_symbols
        return tuple(k for k, c in enumerate(self.coordinates) if used & {c.q, c.qd})


System: TypeAlias = RigidSystem | EnergySystem
"""System of either kind: all that derivation and emission know of a robot."""


def refuse_curves(system: System) -> None:
    """Raise LinkwiseError where a joint follows a curve: closed forms know only lines."""
    for link in system.robot.links if isinstance(system, RigidSystem) else ():
        if link.joint.curve:
            raise LinkwiseError(
                f"joint {link.joint.name!r} follows a curve, and no closed forms are derived for that: only "
                "kernels in loops are to be had"
            )


def rigid_system(robot: Robot) -> RigidSystem:
    """Return the system of a robot's links.

    Links without mass have no Lagrangian and are only passed through.
    """
    links = []
    for index, link in enumerate(robot.links):
        if not link.massless:
            chain = robot.chain(index)
            joints = tuple(robot.links[at].joint for at in chain)
            links.append(RigidLink(link.name, chain, joints, link.mass, link.com, link.inertia))
    return RigidSystem(robot, tuple(links))
