"""The dynamics of a robot whose joints are tied: closed loops, coupled joints, contacts."""

from typing import Any, Generic, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .interface import Array
from .labelled import labelled
from .quantities import Coefficients, ConstrainedMotion, Propagation


class Contact(NamedTuple):
    """A frame that the ground holds where it is now, for `Dynamics.constrained`.

    kind: what is held, and how many rows that has:
        held      all of the frame: 6, turns about the world's axes, then the point along them
        hinged    all but turns about `axis`: 5, two turns across the axis, then the point
        point     the point: 3
        rolling   a ball, or an upright wheel, of `radius` about the point rolls without slip: 3, the velocity
                  where it touches
    """

    frame: str | int
    """A frame by its name, or by its number in `kinematics.frames`."""
    kind: str = "held"
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """In the frame, in m; of a ball its centre."""
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Of `hinged`, in the frame."""
    normal: tuple[float, float, float] | None = None
    """Of `rolling`: the ground's, in the world, away from it; against gravity unless given."""
    radius: float = 0.0
    """Of `rolling`, in m."""
    name: str | None = None
    """That of its rows; the frame's and the kind unless given."""


class Constraints(Generic[Array]):
    """What ties, couplings and contacts leave of a robot's motion; `Dynamics.constraints`, `.constrained`.

    A qd = 0 has C rows, by which all other joints d follow the m independent ones y:

        qd = G yd    qdd = G ydd + bias    G_d = -A_d^-1 A_y    bias_d = -A_d^-1 dA/dt qd
        tau^_aj = sum_i G_ia tau_ij = sum_b c2^_ajb ydd_b + sum_b c1^_ajb yd_b + g^_aj

    is what actuators of the independent joints a give through link j while all other joints move freely. The
    shares sum up as those of the open tree do, in the closing convention.

    Forces lambda are those on the first frame of a tie, minus those on the second, or on a contact's frame:
    moments in N m, then forces in N, along the axes that the rows have; a distance's pushes apart; a
    coupling's is on the unit of its sum. They load the joints with A^T lambda. Where rows say the same
    twice, as those of a planar loop in space do, A_d^-1 is the pseudoinverse, and of all forces that do it
    these are the least, by the sum of their squares: `redundant` names where that choice was made. Others
    are unique.

    q, batches and errors are as for `Dynamics`, and q (..., n) is that of all joints, in which the ties must
    close within the tolerance of `Dynamics.constrained`: else ValueError, and `closed` is the mend. Of qd and
    qdd (..., n) the independent joints count, and the others follow; ydd and yd are (..., m). Answers are of
    the motion's kind and dtype; gradients flow through motion and parameters.

    Raises ValueError at a singular position, and for a choice of independent joints that does not go, with
    sample and joints.
    """

    def __init__(self, answers: Any) -> None:
        self._answers = answers

    def are_of(self, robot: Any) -> bool:
        """Whether they were made by this robot, on this back end."""
        return bool(self._answers.robot is robot)

    def __repr__(self) -> str:
        return f"<constraints of {len(self.rows)} rows, independent {', '.join(self.independent)}>"

    @property
    def names(self) -> tuple[str, ...]:
        """Of ties, couplings and contacts, in the order of their rows."""
        names: tuple[str, ...] = self._answers.names
        return names

    @property
    def rows(self) -> tuple[str, ...]:
        """What each of the C rows holds: "loop force_x", say."""
        rows: tuple[str, ...] = self._answers.rows
        return rows

    @property
    def row_units(self) -> tuple[str, ...]:
        """In which each row is open: rad or m; none for a coupling, whose sum may have any."""
        units: tuple[str, ...] = self._answers.row_units
        return units

    def labelled(self, call: str, *given: Any, along: Any = None, **named: Any) -> Any:
        """`Dynamics.labelled` of these calls: made.labelled("forces", q, qd, qdd)."""
        return labelled(self._answers.robot, self, call, given, named, along)

    @property
    def independent(self) -> tuple[str, ...]:
        """Joints y, whose motion tells that of all others; in the order of all joints."""
        names: tuple[str, ...] = self._answers.independent
        return names

    @property
    def dependent(self) -> tuple[str, ...]:
        """The other joints."""
        names: tuple[str, ...] = self._answers.dependent
        return names

    @property
    def redundant(self) -> tuple[str, ...]:
        """Names of those among whose rows some follow from others: how they share forces is a choice."""
        names: tuple[str, ...] = self._answers.redundant
        return names

    def violation(self, q: Array, held_at: Array | None = None) -> Array:
        """How far each row is from closing, (..., C), in m, rad or a coupling's unit.

        Of a turn it is twice the sine of half the angle. held_at: positions (..., n) in which contacts took
        hold of their frames; without them, and of rolling, contacts have none.
        """
        violation: Array = self._answers.violation(q, held_at)
        return violation

    def jacobian(self, q: Array) -> Array:
        """A, (..., C, n), at any q."""
        jacobian: Array = self._answers.jacobian(q)
        return jacobian

    def jacobian_rate(self, q: Array, qd: Array) -> Array:
        """dA/dt, (..., C, n), at any q and qd, none of which is replaced here."""
        rate: Array = self._answers.jacobian_rate(q, qd)
        return rate

    @property
    def closed_position(self) -> NDArray[np.float64]:
        """A position of all joints in which the ties close, (n,).

        It is the one that generating found, near zero if ties close there; of `Dynamics.constrained` with
        other joints or contacts the one at which these were chosen.
        """
        position: NDArray[np.float64] = self._answers.closed_position.copy()
        return position

    def closed(self, q: Array, held_at: Array | None = None, start: Array | None = None) -> Array:
        """The same q with its dependent joints moved until all ties close, (..., n), by Newton's method.

        q: of all joints, (..., n), the dependent ones where they are looked for; or of the independent ones
        alone, (..., m): the others are then led there from `start`, step by step without leaps, so that ties
        that can close in several ways stay in the one of the start
        held_at: positions in which contacts took hold; q itself unless given, or the start
        start: a closed position (..., n); `closed_position` unless given

        Raises ValueError, with the sample, the tie and what remains, if they do not close.
        """
        closed: Array = self._answers.closed(q, held_at, start)
        return closed

    def velocity_map(self, q: Array) -> Array:
        """G, (..., n, m): qd = G yd."""
        mapped: Array = self._answers.velocity_map(q)
        return mapped

    def velocity(self, q: Array, yd: Array) -> Array:
        """qd of all joints, (..., n), for that of the independent ones, (..., m)."""
        velocity: Array = self._answers.velocity(q, yd)
        return velocity

    def acceleration(self, q: Array, qd: Array, ydd: Array) -> Array:
        """qdd of all joints, (..., n), for that of the independent ones, (..., m)."""
        acceleration: Array = self._answers.acceleration(q, qd, ydd)
        return acceleration

    def velocity_accelerations(self, q: Array, qd: Array) -> Array:
        """The bias of qdd = G ydd + bias by its causes, (..., n, n): what joint k gets through qd_s.

        Over s they sum to it; independent joints have none.
        """
        bias: Array = self._answers.velocity_accelerations(q, qd)
        return bias

    def projected(self, q: Array, torque: Array, by_link: bool = False) -> Array:
        """G^T torque: what torques (..., n) on all joints come to on the independent ones, (..., m).

        by_link: torque is (..., n, X), for X links, loads or others, and the answer (..., m, X)
        """
        projected: Array = self._answers.projected(q, torque, by_link)
        return projected

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Torques of the independent joints, sum_j tau^_aj, (..., m): of the links, as in `Dynamics`."""
        torque: Array = self._answers.inverse_dynamics(q, qd, qdd)
        return torque

    def partial_torque(self, q: Array, qd: Array, qdd: Array) -> Array:
        """tau^_aj, (..., m, N)."""
        torque: Array = self._answers.partial_torque(q, qd, qdd)
        return torque

    def coefficients(self, q: Array, qd: Array) -> Coefficients[Array]:
        """c2^, c1^ (..., m, N, m) and g^ (..., m, N) of the closing convention."""
        answer: Coefficients[Array] = self._answers.coefficients(q, qd)
        return answer

    def propagation(self, q: Array, qd: Array, qdd: Array) -> Propagation[Array]:
        """c2^_ajb ydd_b and c1^_ajb yd_b, (..., m, N, m), and g^_aj, (..., m, N): they sum to tau^_aj."""
        answer: Propagation[Array] = self._answers.propagation(q, qd, qdd)
        return answer

    def forces(self, q: Array, qd: Array, qdd: Array) -> Array:
        """lambda^(j), (..., C, N): what the constraints bear of link j, where dependent joints have no
        actuators."""
        forces: Array = self._answers.forces(q, qd, qdd)
        return forces

    def forces_of(self, q: Array, torque: Array, by_link: bool = False) -> Array:
        """lambda, (..., C), for torques (..., n) that joints need and the dependent ones do not give.

        by_link: torque is (..., n, X), and the answer (..., C, X). Actuators, springs or loads of dependent
        joints are taken from the torque first.
        """
        forces: Array = self._answers.forces_of(q, torque, by_link)
        return forces

    def forward_dynamics(
        self, q: Array, qd: Array, tau: Array, passive: bool = True
    ) -> ConstrainedMotion[Array]:
        """qdd (..., n) and lambda (..., C) of M qdd + h + g + p = tau + A^T lambda, tau on all joints.

        tau: (..., n)
        passive: as `Dynamics.forward_dynamics` has it, with p
        """
        answer: ConstrainedMotion[Array] = self._answers.forward_dynamics(q, qd, tau, passive)
        return answer
