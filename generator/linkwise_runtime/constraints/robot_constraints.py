"""Dynamics of a robot with tied joints: closed loops, coupled joints, contacts."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from numbers import Real
from typing import Any, Generic, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from ..answers.answers import Answers
from ..answers.packed import TiedFunctions
from ..arguments import ANY, NOTHING, Beside, shape_of
from ..arrays.backend import ArrayBackend
from ..door import Door
from ..interface import Array, Numbers, array_of, is_traced, side_by_side
from ..labelled import labelled
from ..quantities import Coefficients, ConstrainedMotion, Propagation
from ..structure import Structure
from .chosen_constraints import TreeConstraints
from .closed_places import (
    ClosedPlace,
    DependentMap,
    independent_torque,
    tie_forces,
)
from .function_answers import by_functions
from .newton_closing import led, with_independent
from .tie_rows import TieRows
from .tied_joints import TiedJoints, without_gradient
from .written_rows import WrittenChoice, WrittenRows

MOTION = ("q", "qd", "qdd")
UNDER_TORQUE = ("q", "qd", "tau")
"""Names of the arrays of motion, and of those of forward dynamics."""


class TiedRobot(Protocol):
    """Attributes of a robot that constraints need."""

    @property
    def n(self) -> int:
        """Number of joints."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints."""

    @property
    def structure(self) -> Structure:
        """Names, paths and parameters."""

    @property
    def backend(self) -> ArrayBackend:
        """Back end that computes."""

    @property
    def door(self) -> Door[ArrayBackend]:
        """Reader of the motion that calls are given."""


class Constraints(Generic[Array]):
    """Dynamics of a robot under ties, couplings and contacts; see `Dynamics.constraints` and `.constrained`.

    A qd = 0 has C rows, by which all other joints d follow the m independent ones y:

        qd = G yd    qdd = G ydd + bias    G_d = -A_d^-1 A_y    bias_d = -A_d^-1 dA/dt qd
        tau^_aj = sum_i G_ia tau_ij = sum_b c2^_ajb ydd_b + sum_b c1^_ajb yd_b + g^_aj

    Here tau^_aj is the torque of the actuator of independent joint a through link j, while all other joints
    move freely. These shares sum up as those of the open tree do, in the closing convention.

    The constraint forces lambda act on the first frame of a tie and with the opposite sign on the second, or
    on the frame of a contact: moments in N m, then forces in N, along the axes of the rows. The force of a
    distance pushes its ends apart; the force of a coupling is per unit of its sum. They load the joints with
    A^T lambda. Where rows are redundant, as those of a planar loop in space are, A_d^-1 is the pseudoinverse,
    and lambda is the solution with the least sum of squares, a coupling's force being multiplied by its
    largest slope where that is above 1, and that of a constraint that a user wrote in any case; `redundant`
    names where that choice was made. Other forces are unique.

    q, batches and errors are as for `Dynamics`. Positions q (..., n) are those of all joints, in which the
    ties must close within the tolerance of `Dynamics.constrained`: else ValueError is raised; `closed`
    returns positions in which they do. Of qd and qdd (..., n) only the independent joints count, and the
    others follow; ydd and yd are (..., m). Answers are of the motion's kind and dtype; gradients flow through
    motion and parameters.

    Raises ValueError at a singular position, and for independent joints that the others do not follow, with
    sample and joints.
    """

    def __init__(self, robot: "TiedRobot", ties: TiedJoints, made: tuple[object, ...]) -> None:
        """Keep `made`, the arguments with which the robot's `constrained` makes them again, as for a copy."""
        self._robot, self._made, self.ties = robot, made, ties
        """Motion of the tied joints, for arguments that have been read."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what pickle and copy need: the robot, copied with them, makes them again."""
        return made_again, (self._robot, "constrained", self._made)

    def are_of(self, robot: object) -> bool:
        """Return whether they were made by this robot, on this back end."""
        return self._robot is robot

    def __repr__(self) -> str:
        return f"<constraints of {len(self.rows)} rows, independent {', '.join(self.independent)}>"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the ties, contacts and couplings, in the order of their rows."""
        return self.ties.chosen.names

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the C rows, which say what each holds: "loop force_x", say."""
        return self.ties.chosen.rows

    @property
    def row_units(self) -> tuple[str, ...]:
        """Unit in which each row is open: rad or m; empty for a coupling, whose sum may have any."""
        return self.ties.chosen.row_units

    def labelled(self, call: str, *given: Any, along: Any = None, **named: Any) -> Any:
        """Return `Dynamics.labelled` of one of these calls: made.labelled("forces", q, qd, qdd)."""
        return labelled(self._robot, self, call, given, named, along)

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of the independent joints y, which move all others; in the order of all joints."""
        return self.ties.independent

    @property
    def dependent(self) -> tuple[str, ...]:
        """Names of the dependent joints, in the order of all joints."""
        return self.ties.dependent

    @property
    def redundant(self) -> tuple[str, ...]:
        """Names of constraints some of whose rows follow from others: how these share forces is a choice."""
        return self.ties.chosen.redundant

    def violation(self, q: Array, held_at: Array | None = None) -> Array:
        """Return how far each row is from closing, (..., C), in m, rad or a coupling's unit.

        For a rotation this is twice the sine of half the angle.

        held_at: positions (..., n) in which contacts took hold of their frames; without them contacts have no
        violation. Rolling contacts never have one.
        """
        backend, (at, held) = self._read(q=q, held_at=q if held_at is None else held_at)
        return cast("Array", self.ties.rows(backend).violation(at, held))

    @by_functions()
    def jacobian(self, q: Array) -> Array:
        """Return the constraint Jacobian A (..., C, n), at any q."""
        backend, (at,) = self._read(q=q)
        return cast("Array", side_by_side(self.ties.rows(backend).at(at).positions()[..., 1:]))

    @by_functions()
    def jacobian_rate(self, q: Array, qd: Array) -> Array:
        """Return dA/dt (..., C, n), at any q and qd, which are used as they are given."""
        backend, (at, moved) = self._read(q=q, qd=qd)
        return cast("Array", self.ties.rows(backend).rates(at, moved))

    @property
    def closed_position(self) -> NDArray[np.float64]:
        """Position of all joints in which the ties close, (n,), or (..., n) where parameters have samples.

        It is the one found when the package was generated, near zero if ties close there. For constraints
        made by `Dynamics.constrained` with other joints or contacts, it is the one at which these were
        chosen.
        """
        return self._closed_position.copy()

    def closed(self, q: Array, held_at: Array | None = None, start: Array | None = None) -> Array:
        """Return q with its dependent joints moved by Newton's method until all ties close, (..., n).

        q: positions of all joints, (..., n), where the search for the dependent ones starts; or of the
        independent joints alone, (..., m): the others are then led there from `start`, step by step without
        leaps, so that ties that can close in several ways keep the way of the start. Constraints of
        velocities do not say where the others are, and refuse this
        held_at: positions (..., n) in which contacts took hold; unless given, q itself, or `start` where
        joints are led
        start: a closed position (..., n), accepted with independent joints alone; `closed_position` unless
        given

        Raises ValueError, with the sample, the tie and what remains, if they do not close.
        """
        m = len(self.independent)
        if shape_of(q)[-1:] == (m,):
            return cast("Array", self._led(q, held_at, start))
        if start is not None:
            raise ValueError(
                f"start is where joints are led from that q does not have, and q has shape {shape_of(q)}; "
                f"leave it out, or give q the {m} independent joints alone"
            )
        made = self.answered("closed", (q,)) if held_at is None else None
        if made is not None:
            return cast("Array", made[0])
        backend, (at, held) = self._read(q=q, held_at=q if held_at is None else held_at)
        return cast("Array", self.ties.closed(backend, at, held).q)

    @by_functions()
    def velocity_map(self, q: Array) -> Array:
        """Return the velocity map G (..., n, m) of qd = G yd."""
        backend, (at,) = self._read(q=q)
        return cast("Array", side_by_side(self.ties.place(backend, at).found.map))

    def velocity(self, q: Array, yd: Array) -> Array:
        """Return qd of all joints, (..., n), for yd of the independent ones, (..., m)."""
        backend, (at, own) = self._read(self._own("yd", yd), q=q)
        return cast("Array", self.ties.place(backend, at).velocity(own))

    def acceleration(self, q: Array, qd: Array, ydd: Array) -> Array:
        """Return qdd of all joints, (..., n), for ydd of the independent ones, (..., m)."""
        backend, (at, moved, own) = self._read(self._own("ydd", ydd), q=q, qd=qd)
        place = self.ties.place(backend, at)
        return cast("Array", place.velocity(own) + place.bias(place.velocity(place.own(moved))))

    @by_functions()
    def velocity_accelerations(self, q: Array, qd: Array) -> Array:
        """Return the bias of qdd = G ydd + bias by cause, (..., n, n): the acceleration of joint k by qd_s.

        The sum over s is the bias; independent joints have none.
        """
        place, _, (_, moved) = self._moving(q, qd)
        return cast("Array", place.bias_by_cause(moved))

    def projected(self, q: Array, torque: Array, by_link: bool = False) -> Array:
        """Return G^T torque (..., m), what torques (..., n) on all joints come to on the independent ones.

        by_link: whether torque is (..., n, X), for X links, loads or others, and the answer (..., m, X)
        """
        found = independent_torque(*self._loaded(q, torque, by_link))
        return cast("Array", found if by_link else found[..., 0])

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the torques of the independent joints, sum_j tau^_aj, (..., m).

        They are those of the links, as in `Dynamics`.
        """
        made = self.answered("partial_torque", (q, qd, qdd))
        if made is not None:
            return cast("Array", made[0].sum(-1))
        found, answers, motion = self._accelerated(q, qd, qdd)
        return cast(
            "Array", independent_torque(found, answers.inverse_dynamics(*motion)[0][..., None])[..., 0]
        )

    @by_functions()
    def partial_torque(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the partial torques tau^_aj, (..., m, N)."""
        found, answers, motion = self._accelerated(q, qd, qdd)
        return cast("Array", independent_torque(found, answers.partial_torque(*motion)[0]))

    @by_functions(Coefficients)
    def coefficients(self, q: Array, qd: Array) -> Coefficients[Array]:
        """Return c2^ and c1^ (..., m, N, m) and g^ (..., m, N) of the closing convention."""
        place, backend, (_, moved) = self._moving(q, qd)
        return cast("Coefficients[Array]", Coefficients(*self.ties.coefficients(backend, place, moved)))

    @by_functions(Propagation)
    def propagation(self, q: Array, qd: Array, qdd: Array) -> Propagation[Array]:
        """Return c2^_ajb ydd_b, c1^_ajb yd_b (..., m, N, m) and g^_aj (..., m, N): they sum to tau^_aj."""
        place, backend, (_, moved, asked) = self._moving(q, qd, qdd=qdd)
        c2, c1, g = self.ties.coefficients(backend, place, moved)
        yd, ydd = (place.own(a)[..., None, None, :] for a in (moved, asked))
        return cast("Propagation[Array]", Propagation(c2 * ydd, c1 * yd, g))

    @by_functions()
    def forces(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return lambda^(j) (..., C, N), the forces by which constraints carry link j.

        Dependent joints are taken to have no actuators.
        """
        found, answers, motion = self._accelerated(q, qd, qdd)
        return cast("Array", tie_forces(found, answers.partial_torque(*motion)[0]))

    @by_functions(Coefficients)
    def force_coefficients(self, q: Array, qd: Array) -> Coefficients[Array]:
        """Return the split of `forces`: by ydd and by yd (..., C, N, m), and at rest (..., C, N)."""
        place, backend, (_, moved) = self._moving(q, qd)
        return cast("Coefficients[Array]", Coefficients(*self.ties.force_coefficients(backend, place, moved)))

    @by_functions(Propagation)
    def force_propagation(self, q: Array, qd: Array, qdd: Array) -> Propagation[Array]:
        """Return `force_coefficients` times ydd_b and yd_b: by link, they sum to `forces`."""
        place, backend, (_, moved, asked) = self._moving(q, qd, qdd=qdd)
        c2, c1, g = self.ties.force_coefficients(backend, place, moved)
        yd, ydd = (place.own(a)[..., None, None, :] for a in (moved, asked))
        return cast("Propagation[Array]", Propagation(c2 * ydd, c1 * yd, g))

    def forces_of(self, q: Array, torque: Array, by_link: bool = False) -> Array:
        """Return lambda (..., C) for torques (..., n) that joints need and the dependent ones do not give.

        by_link: whether torque is (..., n, X), and the answer (..., C, X)

        Subtract what actuators, springs or loads of dependent joints give from the torque first.
        """
        found = tie_forces(*self._loaded(q, torque, by_link))
        return cast("Array", found if by_link else found[..., 0])

    def forward_dynamics(
        self, q: Array, qd: Array, tau: Array, passive: bool = True
    ) -> ConstrainedMotion[Array]:
        """Return qdd (..., n) and lambda (..., C) of M qdd + h + g + p = tau + A^T lambda.

        tau: torques on all joints, (..., n)
        passive: whether joints have p, as in `Dynamics.forward_dynamics`
        """
        name = "forward_dynamics" if passive else "forward_dynamics_of_links"
        made = self.answered(name, (q, qd, tau), UNDER_TORQUE)
        if made is not None:
            return cast("ConstrainedMotion[Array]", ConstrainedMotion(*made))
        place, backend, (_, moved, asked) = self._moving(q, qd, tau=tau)
        qdd, forces = self.ties.motion(backend, place, moved, asked, passive)
        return cast("ConstrainedMotion[Array]", ConstrainedMotion(qdd, forces))

    @cached_property
    def _functions(self) -> TiedFunctions | None:
        return self.ties.functions(self._robot.backend)

    @cached_property
    def _closed_position(self) -> NDArray[np.float64]:
        chosen = self.ties.chosen.closed_position
        backend, (q,) = self._read(q=np.broadcast_to(chosen, (*self._robot.backend.samples, len(chosen))))
        with without_gradient(q):
            found = self.ties.closed(backend, q, q).q
        return np.array(array_of(found), dtype=np.float64)

    def _led(self, q: object, held_at: object, start: object) -> Numbers:
        """Return closed positions (..., n) for positions of the independent joints (..., m)."""
        joints, written = self._robot.joint_names, self._robot.structure.written
        if written is not None and not all(written.holonomic):
            moving = next(name for name, own in zip(written.names, written.holonomic, strict=True) if not own)
            raise ValueError(
                f"where {', '.join(self.independent)} are does not tell where the others are: {moving} is a "
                f"constraint of velocities, and the way matters; give closed(q) all {len(joints)} joints"
            )
        # As a list it has no precision of its own.
        begin = self._closed_position.tolist() if start is None else start
        asked = {"start": begin} if held_at is None else {"start": begin, "held_at": held_at}
        given = {
            name: Beside(value, (len(joints),), "all joints in a closed position", joints)
            for name, value in asked.items()
        }
        backend, (own, begin, *last) = self._robot.door.read({"q": q}, self.independent, given)
        held = last[0] if last else begin
        if is_traced(own):
            raise ValueError(
                "joints cannot be led where nobody may look at numbers, as under vmap or a compiler; give "
                f"closed(q) all {len(joints)} joints"
            )
        columns = self.ties.columns(backend, own)
        with without_gradient(own):
            found = led(
                lambda q: self.ties.closed_place(backend, q, held),
                begin,
                own,
                columns,
                self._robot.joint_names,
            )
        return self.ties.closed(backend, with_independent(found, own, columns), held).q

    def answered(
        self, call: str, motion: Sequence[object], names: Sequence[str] = MOTION
    ) -> Sequence[Numbers] | None:
        """Return the answer of the back end's own functions; None without any, or where they have none."""
        functions = self._functions
        if functions is None or not motion:
            return None
        found = None if self._robot.door.check_finite else functions.at_once(call, motion)
        if found is None and len(motion) <= len(names):
            backend, arrays = self._read(NOTHING, **dict(zip(names, motion, strict=False)))
            found = functions.answer(call, arrays) if backend is self._robot.backend else None
        return found

    def _read(
        self, beside: Mapping[str, Beside] = NOTHING, **named: object
    ) -> tuple[ArrayBackend, Sequence[Numbers]]:
        return self._robot.door.read(named, beside=beside)

    def _own(self, name: str, given: object) -> dict[str, Beside]:
        """Return an argument for the independent joints, (..., m), by its name."""
        joints = self.independent
        return {name: Beside(given, (len(joints),), f"one for each of {', '.join(joints)}", joints)}

    def _loaded(self, q: object, torque: object, by_link: bool) -> tuple[DependentMap, Numbers]:
        """Return how joints follow, and torques (..., n, X)."""
        joints = self._robot.joint_names
        about = Beside(torque, (len(joints),), "one for each joint; with by_link=True (..., n, X)", joints)
        if by_link:
            about = Beside(torque, (len(joints), ANY), "joints, and X that load them", joints)
        backend, (at, values) = self._read({"torque": about}, q=q)
        return self.ties.place(backend, at).found, values if by_link else values[..., None]

    def _moving(
        self, q: object, qd: object, **more: object
    ) -> tuple[ClosedPlace, ArrayBackend, Sequence[Numbers]]:
        """Return how joints follow, the back end, and q and qd in which all follow, then other arguments."""
        backend, (at, moved, *others) = self._read(NOTHING, q=q, qd=qd, **more)
        place = self.ties.place(backend, at)
        return place, backend, (at, place.velocity(place.own(moved)), *others)

    def _accelerated(
        self, q: object, qd: object, qdd: object
    ) -> tuple[DependentMap, Answers, tuple[Numbers, Numbers, Numbers]]:
        """Return how joints follow, the answers for the open tree, and a motion in which they follow."""
        place, backend, (at, moved, asked) = self._moving(q, qd, qdd=qdd)
        qdd_there = place.velocity(place.own(asked)) + place.bias(moved)
        return place.found, backend.answers, (at, moved, qdd_there)


def made_again(robot: object, call: str, arguments: tuple[object, ...]) -> object:
    """Return what a robot's method returns: a copy's arguments are copied with the robot."""
    return getattr(robot, call)(*arguments)


def constraints_of(
    robot: "TiedRobot",
    independent: object,
    contacts: object,
    at: object,
    tolerance: object,
    force_weight: object,
) -> Constraints[Any]:
    """Return constraints as `Dynamics.constrained` makes them; raises as it says."""
    allowed = float(tolerance) if isinstance(tolerance, Real) and not isinstance(tolerance, bool) else None
    if tolerance is not None and (allowed is None or not 0.0 <= allowed < np.inf):
        raise ValueError(f"tolerance is {tolerance!r}; give a number of m and rad, 0 or more")
    made = independent, contacts, at, allowed, force_weight
    structure, tree = robot.structure, robot.backend.tree
    if tree is not None:
        chosen = TreeConstraints(structure, tree, independent, contacts, at)
        chosen.weigh(force_weight)
        ties = TiedJoints(
            structure,
            chosen,
            allowed,
            lambda backend: TieRows(backend.frames, chosen, backend.tied_functions(chosen, allowed)),
        )
        return Constraints(robot, ties, made)
    written = structure.written
    if written is None or not isinstance(contacts, list | tuple) or len(contacts):
        raise ValueError(
            f"the links of {structure.name} are energies, which do not say where anything is, so that no "
            "frame can be held; write constraints with the energies: energy_system(..., constraints=...)"
        )
    choice = WrittenChoice(structure, independent, at)
    choice.weigh(force_weight)
    ties = TiedJoints(structure, choice, allowed, lambda backend: WrittenRows(backend, written))
    return Constraints(robot, ties, made)
