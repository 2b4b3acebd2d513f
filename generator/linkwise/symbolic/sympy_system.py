"""Systems of sympy.physics.mechanics as links: one for each body, with its energies and the loads on it.

Generalised speeds become velocities by the system's kinematic differential equations; a load becomes
generalised forces Q_i = F · ∂v/∂q̇_i + T · ∂ω/∂q̇_i.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import sympy as sp
from linkwise_runtime.structure import GRAVITY
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Force, Particle, ReferenceFrame, RigidBody, System, Torque
from sympy.physics.mechanics.joint import PinJoint, PrismaticJoint
from sympy.physics.vector import Vector, dynamicsymbols

from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed, short
from linkwise.symbolic.system import FORCE, POTENTIAL, EnergySystem, LinkEnergy
from linkwise.symbolic.user_energies import energy_system

OTHER = "loads elsewhere"
"""Name of the link that carries loads on points and frames of no body."""


def from_sympy(
    system: System,
    parameters: Mapping[sp.Symbol, float] | None = None,
    units: Mapping[sp.Expr, str] | None = None,
    inputs: Sequence[sp.Expr] = (),
    name: str = "system",
    symbolic: bool = False,
) -> EnergySystem:
    """Return the system of a sympy.physics.mechanics.System: a link for each of its bodies.

    parameters, inputs, symbolic: as in `energy_system`
    units: rad or m of each coordinate that is not that of a pin or prismatic joint, {x: "m"}
    name: of the robot

    A body's `potential_energy` is the share `potential`; uniform gravity on masscenters is `gravity`, where
    masses are symbols, or are numbers and all bodies have the same: the weight of one body alone might be any
    force. What actuators do is called after their class, and what other loads do `force`: those on a point,
    or a frame, that is fixed to several bodies count for the first of them. Constraints are called
    `holonomic 1`, `nonholonomic 1` and so on. Raises LinkwiseError for velocity constraints of its own, for a
    coordinate without a unit, for kinematic equations that do not give the speeds, and as `energy_system`
    does.
    """
    if not isinstance(system, System):
        raise LinkwiseError(
            f"from_sympy takes a sympy.physics.mechanics.System, and got {short(type(system).__name__)}"
        )
    reader = _SystemReader(system)
    links = [link for link in map(reader.link, system.bodies) if _moves(link)]
    if (rest := reader.rest()) is not None:
        links.append(rest)
    return energy_system(
        name,
        _units(system, units or {}),
        links,
        parameters,
        symbolic,
        inputs=inputs,
        constraints=reader.constraints(system),
    )


class _SystemReader:
    """Bodies and loads of a system, in coordinates and velocities."""

    def __init__(self, system: System) -> None:
        self.frame, self.origin = system.frame, system.fixed_point
        self.positions = list(system.q)
        self.rates = [q.diff(dynamicsymbols._t) for q in self.positions]
        self._speeds = _speeds(system, self.rates)
        self._loads = list(_named_loads(system))
        self._masscenters = [body.masscenter for body in system.bodies]
        self._fields = self._fields_of_all(system.bodies)

    def link(self, body: RigidBody | Particle) -> LinkEnergy:
        """Return the energies of a body, and the loads on it."""
        with within(f"body {body.name!r}"):
            kinetic, potential = self._kinetic(body), dict[str, sp.Expr]()
            if body.potential_energy != 0:
                potential[POTENTIAL] = self._plain(body.potential_energy)
            forces: dict[str, dict[sp.Expr, sp.Expr]] = {}
            for at, (name, load) in enumerate(self._loads):
                if load is None or not self._acts_on(load, body):
                    continue
                self._loads[at] = (name, None)
                field = _field(load, body, self.frame)
                if field is not None and (sp.sympify(body.mass).free_symbols or field in self._fields):
                    with _joined(f"where {body.masscenter.name!r} is"):
                        place = body.masscenter.pos_from(self.origin)
                    potential[GRAVITY] = potential.get(GRAVITY, 0) - body.mass * field.dot(place)
                else:
                    self._add(forces, name, load)
            return LinkEnergy(body.name, self._plain(kinetic), potential, 0, forces)

    def rest(self) -> LinkEnergy | None:
        """Return a link with the loads that act on no body; None where there are none."""
        forces: dict[str, dict[sp.Expr, sp.Expr]] = {}
        for name, load in self._loads:
            if load is not None:
                self._add(forces, name, load)
        return LinkEnergy(OTHER, 0, 0, 0, forces) if any(forces.values()) else None

    def constraints(self, system: System) -> dict[str, sp.Expr]:
        """Return the constraints by name, in coordinates and velocities; raises LinkwiseError."""
        rates = [zero.diff(dynamicsymbols._t) for zero in system.holonomic_constraints]
        if list(system.velocity_constraints) != [*rates, *system.nonholonomic_constraints]:
            raise LinkwiseError(
                "the system has velocity_constraints of its own in place of the derivatives of its others; "
                "leave them out, or give them as nonholonomic constraints"
            )
        kinds = {"holonomic": system.holonomic_constraints, "nonholonomic": system.nonholonomic_constraints}
        return {
            f"{kind} {number}": self._plain(zero)
            for kind, found in kinds.items()
            for number, zero in enumerate(found, 1)
        }

    def _acts_on(self, load: Force | Torque, body: Any) -> bool:
        """Return whether a load is on a body: on its masscenter or a point fixed to it, or on its frame."""
        if isinstance(load, Torque):
            return isinstance(body, RigidBody) and load.frame == body.frame
        if load.point in self._masscenters:  # another body may have it fixed, as a rod has a wheel's
            return bool(load.point == body.masscenter)
        return isinstance(body, RigidBody) and _is_fixed(load.point, body)

    def _fields_of_all(self, bodies: Sequence[RigidBody | Particle]) -> list[Vector]:
        """Return the accelerations that loads give to all bodies alike, of two at least."""
        found = []
        for body in bodies:
            own = [load for _, load in self._loads if load is not None and self._acts_on(load, body)]
            fields = [field for load in own if (field := _field(load, body, self.frame)) is not None]
            with within(f"body {body.name!r}"):
                moves = bool(fields) or self._kinetic(body) != 0
            if moves:
                found.append(fields)
        return [field for field in found[0] if all(field in own for own in found)] if len(found) > 1 else []

    def _add(self, forces: dict[str, dict[sp.Expr, sp.Expr]], name: str, load: Force | Torque) -> None:
        is_force = isinstance(load, Force)
        with _joined(f"how {load[0].name!r} moves, on which a load acts,"):
            moved = load.point.vel(self.frame) if is_force else load.frame.ang_vel_in(self.frame)
        moved, vector = (self._plain_vector(one) for one in (moved, load.vector))
        own = forces.setdefault(name, {})
        for q, rate in zip(self.positions, self.rates, strict=True):
            along = moved.diff(rate, self.frame, var_in_dcm=False).dot(vector)
            if along != 0:
                own[q] = own.get(q, 0) + along

    def _kinetic(self, body: RigidBody | Particle) -> sp.Expr:
        with _joined("how it moves"):
            return body.kinetic_energy(self.frame)

    def _plain(self, expr: sp.Expr) -> sp.Expr:
        return sp.sympify(expr).xreplace(self._speeds)

    def _plain_vector(self, vector: Vector) -> Vector:
        return vector.xreplace(self._speeds)


@contextmanager
def _joined(what: str) -> Iterator[None]:
    """Say what is not known where SymPy finds no way from a frame or a point to those of the system."""
    try:
        yield
    except LinkwiseError:
        raise
    except ValueError as error:
        raise LinkwiseError(
            f"nothing says {what} in the system's frame; join it by a joint, or give positions and "
            "orientations from there"
        ) from error


def _moves(link: LinkEnergy) -> bool:
    """Return whether anything of a link depends on motion: a wall has no energy that does."""
    parts = [link.kinetic, *dict(link.potential).values()]
    return any(link.forces.values()) or any(sp.sympify(part).has(AppliedUndef) for part in parts)


def _speeds(system: System, rates: list[sp.Expr]) -> dict[sp.Expr, sp.Expr]:
    """Return each generalised speed by the velocities."""
    speeds = [u for u in system.u if u not in rates]
    if not speeds:
        return {}
    equations = list(system.kdes)
    found = sp.solve(equations, speeds, dict=True)
    if len(found) != 1 or any(u not in found[0] for u in speeds):
        raise LinkwiseError(
            f"the kinematic differential equations do not give the speeds {listed(speeds)} by velocities; "
            "there must be one for each"
        )
    return dict(found[0])


def _units(system: System, given: Mapping[sp.Expr, str]) -> dict[sp.Expr, str]:
    """Return the unit of each coordinate."""
    known: dict[sp.Expr, str] = {}
    for joint in system.joints:
        kind = {PinJoint: "rad", PrismaticJoint: "m"}.get(type(joint))
        if kind is not None:
            known |= dict.fromkeys(joint.coordinates, kind)
    units = {q: given.get(q, known.get(q, "")) for q in system.q}
    if lacking := [q for q, unit in units.items() if not unit]:
        place = list(system.q).index(lacking[0])
        raise LinkwiseError(
            f"{listed(lacking)} have no unit; give them, units={{system.q[{place}]: 'rad'}} say"
        )
    if strange := [q for q in given if q not in units]:
        raise LinkwiseError(f"units names {listed(strange)}, which the system does not have as coordinates")
    return units


def _named_loads(system: System) -> Iterable[tuple[str, Force | Torque | None]]:
    """Yield each load with the name of its share: of an actuator, that of its class."""
    for load in system.loads:
        yield FORCE, load
    for actuator in system.actuators:
        for load in actuator.to_loads():
            yield type(actuator).__name__, load


def _is_fixed(point: Any, body: RigidBody) -> bool:
    """Return whether a point stands still in a body's frame."""
    try:
        place = point.pos_from(body.masscenter)
    except ValueError:
        return False
    return bool(place.dt(body.frame) == 0)


def _field(load: Force | Torque, body: Any, frame: ReferenceFrame) -> Vector | None:
    """Return the acceleration in a frame that a load gives to a body, if it is constant; else None.

    It is on the masscenter, made of constants along axes that stand still, and in proportion to the mass
    where that is a symbol.
    """
    if not isinstance(load, Force) or load.point != body.masscenter or body.mass == 0:
        return None
    try:
        field = (load.vector / body.mass).express(frame).simplify()
    except ValueError:  # axes that nothing relates to the frame
        return None
    changing = (AppliedUndef, dynamicsymbols._t, *sp.sympify(body.mass).free_symbols)
    return None if any(matrix.has(*changing) for matrix, _ in field.args) else field
