"""The calls of `Dynamics` on what moves a robot, and how it then moves."""

from typing import Any

from .induced_quantities import InducedAccelerations
from .interface import Array


class MotionCalls:
    """Accelerations by their sources, and motion over time.

    Arguments, batches and errors are those of `Dynamics`.
    """

    backend: Any

    def induced_accelerations(
        self,
        q: Array,
        qd: Array,
        tau: Array | None = None,
        qdd: Array | None = None,
        loads: Any = (),
        passive: bool = False,
        frame: str | int | None = None,
        point: Array | None = None,
        constraints: Any = None,
    ) -> InducedAccelerations[Array]:
        """What each source accelerates, the others away: shares that sum to the acceleration.

        tau: what the actuators give, (..., n); or in its place
        qdd: a motion's acceleration: the actuators then give what it asks of them, less what loads do
        loads: what acts from outside, each an `AppliedLoad`, or a list of them for one source, such as a
        muscle's two ends
        passive: whether springs, damping, friction and armature of the joints count, as in forward_dynamics
        frame: what accelerates: the coordinates unless given, or a frame, with its `point`, as
        `robot.kinematics` takes them, or "centre of mass"
        constraints: what the motion keeps, the file's ties unless given, else what `robot.constrained`
        makes, or False for the open tree; q, qd are then as `Constraints` has them, and the actuators that a
        qdd asks for are those of the independent joints

        The frame's own dJ/dt qd is the share `kinematic`. Sources of acceleration are forces: what gravity
        accelerates at rest is there even where it is held, and an actuator's share cancels it.

        Raises as forward_dynamics does, and names the load that is wrong.
        """
        answers, given = self.backend.induced(self), (q, qd, tau, qdd, loads, passive)
        shares: InducedAccelerations[Array] = answers.accelerations(*given, frame, point, constraints)
        return shares

    def induced_reactions(
        self,
        q: Array,
        qd: Array,
        tau: Array | None = None,
        qdd: Array | None = None,
        loads: Any = (),
        passive: bool = False,
        constraints: Any = None,
    ) -> InducedAccelerations[Array]:
        """What each source puts on the constraints: shares of lambda, (..., C, ...), by their rows.

        Arguments are those of `induced_accelerations`. Raises ValueError without constraints.
        """
        answers, given = self.backend.induced(self), (q, qd, tau, qdd, loads, passive)
        shares: InducedAccelerations[Array] = answers.reactions(*given, constraints)
        return shares
