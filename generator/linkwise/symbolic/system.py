"""Systems, one of which every description becomes: coordinates, links and run-time parameters.

A rigid link and a link of hand-written energies are two types, and so are the systems made of them. Both
systems have `name`, `coordinates`, `links`, `link_names`, `parameters`, `notes`, `request` and `path`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import sympy as sp
from linkwise_runtime.html_tables import joint_table, page_part, table
from linkwise_runtime.structure import GRAVITY

from linkwise.errors import LinkwiseError
from linkwise.escape import listed, short
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


Named: TypeAlias = Mapping[str, sp.Expr]
"""Expressions by the names that their shares of a torque have."""
Forces: TypeAlias = Mapping[Any, Any]
"""Generalised forces Q_i by coordinate, its symbol or its name; or such mappings by the names of shares."""

POTENTIAL, DISSIPATION, FORCE = "potential", "dissipation", "force"
"""Names of shares to which the user gives none."""


@dataclass(frozen=True)
class LinkEnergy:
    """Energies and forces of one link, a body or a subsystem, as written; L_j = kinetic − potential.

        τ_ij = d/dt ∂L_j/∂q̇_i − ∂L_j/∂q_i + ∂D_j/∂q̇_i − Q_ij

    kinetic: in J, a polynomial in the velocities
    potential: P in J, linear in the velocities at most, as a magnet's; one, or several by name
    dissipation: Rayleigh's D in W, of which ∂D/∂q̇_i is what the joint gives; one, or several by name
    forces: generalised forces Q_i in N m or N, by coordinate, with its symbol or its name; or such mappings
    by name

    Each name is a share of its own in every torque. What has none is called potential, dissipation or force.
    """

    name: str
    kinetic: sp.Expr = sp.S.Zero
    potential: sp.Expr | Named = sp.S.Zero
    dissipation: sp.Expr | Named = sp.S.Zero
    forces: Forces = field(default_factory=dict)


@dataclass(frozen=True)
class Share:
    """A share of a link's torques that has a name of its own.

    s_i = d/dt ∂ℓ/∂q̇_i − ∂ℓ/∂q_i + ∂D/∂q̇_i − Q_i      with ℓ = motion − potential
    """

    name: str
    potential: sp.Expr = sp.S.Zero
    """P in J, without velocities: what is stored."""
    motion: sp.Expr = sp.S.Zero
    """Terms of the Lagrangian in J linear in the velocities, or of an imposed motion; they store nothing."""
    dissipation: sp.Expr = sp.S.Zero
    forces: Mapping[int, sp.Expr] = field(default_factory=dict)

    def parts(self) -> tuple[sp.Expr, ...]:
        """Return all expressions."""
        return self.potential, self.motion, self.dissipation, *self.forces.values()


@dataclass(frozen=True)
class LinkTerms:
    """Terms of one link, sorted: kinetic energy of degree two and more in the velocities, and shares."""

    name: str
    kinetic: sp.Expr
    degree: int
    """Highest power of velocities in the kinetic energy."""
    shares: tuple[Share, ...]

    @property
    def potential(self) -> sp.Expr:
        """Potential energy in J, of all shares."""
        return sp.Add(*(share.potential for share in self.shares))

    @property
    def motions(self) -> tuple[sp.Expr, ...]:
        """Terms of the Lagrangian, beside these two energies, of all shares."""
        return tuple(share.motion for share in self.shares)

    @property
    def has_lagrangian(self) -> bool:
        """True if nothing is dissipated or given: all torques are those of a Lagrangian."""
        return not any(share.dissipation != 0 or share.forces for share in self.shares)

    def symbols(self) -> set[sp.Symbol]:
        """Return the symbols of all expressions."""
        parts = (part for share in self.shares for part in share.parts())
        return set(self.kinetic.free_symbols).union(*(part.free_symbols for part in parts))


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
    def share_names(self) -> tuple[str, ...]:
        """Name of the one share that is not of motion."""
        return (GRAVITY,)

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
class WrittenConstraint:
    """A constraint that a user wrote: phi(q) = 0, or sum_k A_k(q) qd_k = 0 of velocities alone."""

    name: str
    expression: sp.Expr
    """phi in the user's unit, or the sum."""
    holonomic: bool
    """True for phi(q) = 0."""

    def row(self, coordinates: Sequence[Coordinate]) -> tuple[sp.Expr, ...]:
        """Return A_k for each coordinate."""
        return tuple(sp.diff(self.expression, c.q if self.holonomic else c.qd) for c in coordinates)


@dataclass(frozen=True)
class EnergySystem:
    """Links whose energies a user wrote, and constraints on them."""

    name: str
    coordinates: tuple[Coordinate, ...]
    links: tuple[LinkTerms, ...]
    parameters: Mapping[sp.Symbol, float] = field(default_factory=dict)
    """Run-time parameters and their values, time and inputs among them, whose value is that of none given."""
    notes: tuple[Note, ...] = ()
    request: Mapping[str, Any] = field(default_factory=dict, compare=False)
    """Source that it was read from, and the options, as manifests keep them."""
    time: sp.Symbol | None = None
    """Time among the parameters; None where nothing depends on it."""
    inputs: tuple[sp.Symbol, ...] = ()
    """Inputs among the parameters."""
    constraints: tuple[WrittenConstraint, ...] = ()
    requested_independent: tuple[int, ...] = ()
    """Coordinates that were asked for as those that the others follow; empty where none were."""
    independent: tuple[int, ...] = ()
    """Coordinates that the others follow by the constraints; empty until chosen, and without any."""
    closed_position: tuple[float, ...] = ()
    """Position where the constraints hold, at the parameters' own values; empty until found."""

    @property
    def share_names(self) -> tuple[str, ...]:
        """Names of the shares of torques, in the order of their first link."""
        return tuple(dict.fromkeys(share.name for link in self.links for share in link.shares))

    def __repr__(self) -> str:
        names = listed([c.name for c in self.coordinates]), listed(self.link_names)
        return f"<energies of {short(self.name)}: coordinates {names[0]}; links {names[1]}>"

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
        """Return path(j): the coordinates that link `link` depends on, in ascending order."""
        terms = self.links[link]
        used, loaded = terms.symbols(), {i for share in terms.shares for i in share.forces}
        return tuple(k for k, c in enumerate(self.coordinates) if k in loaded or used & {c.q, c.qd})


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
