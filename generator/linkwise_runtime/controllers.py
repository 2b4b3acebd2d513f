"""Controllers of a robot's partial impedance, and what they are made of."""

from typing import Any, Generic, NamedTuple

from .interface import Array

ROWS = ("rx", "ry", "rz", "x", "y", "z")
"""Of a frame: turns about the world's axes, then its point along them."""


class Natural(NamedTuple):
    """What is kept of the robot's own inertia or damping, and what is added."""

    scale: Any = 1.0
    """alpha_ij, by which c2_ijk or c1_ijk is multiplied: a number, (n, N), or {link: number} or
    {(joint, link): number} for some, the others staying as they are."""
    plus: Any = None
    """What is added to their sum over the links: a number for every joint, (n,) a diagonal, or (n, n)."""


class FrameImpedance(NamedTuple):
    """What a frame feels like to who pushes it, for `Dynamics.partial_impedance`.

    inertia, damping: Natural, of whose scale a number is taken, or the whole: a number, (r,), or (r, r), of r
    rows, in kg, kg m^2, and such times 1/s; stiffness likewise, without Natural, in N/m and N m/rad
    """

    frame: str | int
    """A frame by its name, or by its number in `kinematics.frames`."""
    inertia: Any = Natural()
    damping: Any = Natural()
    stiffness: Any = 0.0
    rows: tuple[str, ...] = ROWS
    """Which of `ROWS`; a robot must be able to move the frame along each of them, whatever the others do."""
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the frame, in its axes, in m."""


class Target(NamedTuple):
    """Where joints, or a frame, shall be, and how they shall move; at rest unless given."""

    q: Any = None
    """Positions (..., n); not wanted without stiffness."""
    qd: Any = None
    """(..., n)"""
    qdd: Any = None
    """(..., n)"""
    pose: Any = None
    """Of the frame, (..., 4, 4), as `kinematics.pose` has it; not wanted without stiffness."""
    velocity: Any = None
    """Of the frame and its point, (..., 6), as `kinematics.velocity` has it."""
    acceleration: Any = None
    """(..., 6)"""


class PartialImpedance(Generic[Array]):
    """Torques under which the robot obeys its targets; `Dynamics.partial_impedance` makes it.

    With e = q - q_d and f, what acts on the joints from outside (the paper's equation, summed over j):

        M* (qdd - qdd_d) + B* (qd - qd_d) + K* e = f     M* = sum_j M_ijk, B* and K* likewise
        u = M qdd + C qd + g - f, where qdd follows from the line above

    Only the sums over the links move the robot: which link is said to have which share is a choice, made
    when entries are given or the natural ones are scaled.

    With a frame, that has precedence: of all accelerations with which the frame moves as asked, the joints
    take the one nearest to what the lines above ask for, by Gauss's principle of least constraint.

    M is the inertia of links and armatures. Friction of the joints brakes them beside f, but for what is
    compensated, which is never more than there is. Arguments, batches and errors are as for `Dynamics`;
    gradients flow through motion, targets and gains.

    target: positions q_d (..., n) to stay at, or a `Target`
    external: what the surroundings put on the joints, (..., n), in N m or N: J^T (n, f) of a moment and a
    force, and so the negative of `kinematics.load_torque`; nothing unless given. What is natural in M* needs
    no measured f.

    Raises ValueError for an M* that is not positive at a sample, for a frame that cannot move along a row,
    and for one that is half a turn from its target. Warns where rounding leaves fewer than half of the
    digits of the accelerations that are wanted.
    """

    def __init__(self, answers: Any) -> None:
        self._answers = answers

    def __repr__(self) -> str:
        return f"<partial impedance of {self._answers.about()}>"

    @property
    def dissipative(self) -> bool:
        """Whether the stored energy falls along every motion with f = 0, for targets at rest of a frame, and
        for any of joints.

        It does where inertia and damping keep the same share of each link, all that is added and the
        stiffness being positive: the kept c1 take up what the inertia changes by. Not so for a frame that is
        stiff about one or two of the three axes, as the angle about one changes by turns about the others.
        """
        return bool(self._answers.dissipative)

    def __call__(self, q: Array, qd: Array, target: Any = None, external: Array | None = None) -> Array:
        """Torque u of the actuators, (..., n), in N m or N."""
        tau: Array = self._answers.torque(q, qd, target, external)
        return tau

    def acceleration(self, q: Array, qd: Array, target: Any = None, external: Array | None = None) -> Array:
        """qdd that follows, (..., n)."""
        qdd: Array = self._answers.acceleration(q, qd, target, external)
        return qdd

    def stored_energy(self, q: Array, qd: Array, target: Any = None) -> Array:
        """(ed' M* ed + e' K* e) / 2 in J, (...); with a frame that of the frame."""
        energy: Array = self._answers.stored_energy(q, qd, target)
        return energy


class Cancellation(Generic[Array]):
    """Torques that cancel chosen motion propagation torques and leave the others; see `Dynamics.cancel`.

    u = tau + sum over the cancelled c_m,ijk q_k^(m) + g, and what joints have of their own, as
    `partial_impedance` compensates it, under which the robot obeys

        (M - M_S) qdd + (C - C_S) qd = tau + f

    with S for what is cancelled. Arguments, batches and errors are as for `PartialImpedance`.
    """

    def __init__(self, answers: Any, entries: tuple[tuple[str, str, str, int], ...]) -> None:
        self._answers, self.entries = answers, entries
        """entries: what is cancelled, by joint, link, coordinate and order."""

    def __repr__(self) -> str:
        return f"<{len(self.entries)} motion propagation torques of {self._answers.about()} cancelled>"

    def __call__(
        self,
        q: Array,
        qd: Array,
        tau: Array | None = None,
        external: Array | None = None,
        qdd: Array | None = None,
    ) -> Array:
        """Torque u of the actuators, (..., n), in N m or N.

        tau: what the task asks for, (..., n); nothing unless given
        qdd: acceleration at which the cancelled torques are taken, measured or wanted; unless given, the one
        that follows. With all of them cancelled and a wanted one this is computed torque, but for
        armature, which is of no link.
        """
        torque: Array = self._answers.cancelling(q, qd, tau, external, qdd)
        return torque

    def acceleration(
        self, q: Array, qd: Array, tau: Array | None = None, external: Array | None = None
    ) -> Array:
        """qdd that follows, (..., n)."""
        qdd: Array = self._answers.cancelled_acceleration(q, qd, tau, external)
        return qdd
