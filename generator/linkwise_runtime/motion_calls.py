"""The calls of `Dynamics` on what moves a robot, and how it then moves."""

import warnings
from collections.abc import Sequence
from typing import Any

from numpy.typing import ArrayLike

from .file_joints import Order
from .interface import Array
from .motion_quantities import InducedAccelerations, Trajectory
from .structure import Structure


class MotionCalls:
    """Accelerations by their sources, and motion over time.

    Arguments, batches and errors are those of `Dynamics`.
    """

    backend: Any
    structure: Structure

    def from_qpos(
        self,
        qpos: ArrayLike,
        qvel: ArrayLike | None = None,
        qacc: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        order: Order = "mujoco",
        joints: Sequence[str] | None = None,
    ) -> Any:
        """q of positions as MuJoCo or Pinocchio has them, and qd, qdd and torques of what else is given.

        qpos: (..., nq), in which a joint that turns in space has a quaternion: MuJoCo's w, x, y, z, or
        Pinocchio's x, y, z, w, which has a cosine and a sine besides for an angle without ends
        qvel, qacc, tau: (..., n), for which a tuple (q, qd), (q, qd, qdd), ... is the answer: velocities,
        accelerations and generalized forces of that simulator. Angular velocities are along the body's axes,
        a floating body's linear one along the world's with MuJoCo, along its own with Pinocchio
        order: whose numbers these are; joints stand as the file's order has them, or Pinocchio's own
        joints: their names in the order of qpos, where it is another: list(model.names)[1:], say

        Joints that are locked or follow others have no numbers here. Angles go on without leaps along the
        samples, the last axis but one: whole turns are added, and beyond a pitch of 90 degrees it grows on.
        Arrays of float64 in, or what becomes such, and out; gradients are not carried.

        Raises ValueError for a quaternion whose length is not 1 within 0.01, for velocities at a pitch of
        90 degrees, and for a wrong shape, with what stands where; warns next to such a pitch.
        """
        found = self.structure.qpos(order, joints).motion(qpos, qvel, qacc, tau)
        for told in found.warnings:
            warnings.warn(told, stacklevel=2)
        motion = tuple(values for values in found[:4] if values is not None)
        return motion if len(motion) > 1 else motion[0]

    def induced_accelerations(
        self,
        q: Array,
        qd: Array,
        tau: Array | None = None,
        qdd: Array | None = None,
        loads: Any = (),
        passive: bool = True,
        frame: str | int | None = None,
        point: Array | None = None,
        constraints: Any = None,
    ) -> InducedAccelerations[Array]:
        """What each source accelerates, the others away: shares that sum to the acceleration.

        tau: what the actuators give, (..., n); or in its place
        qdd: a motion's acceleration: the actuators then give what it asks of them, less what loads do
        loads: what acts from outside, each an `AppliedLoad`, or a list of them for one source, such as a
        muscle's two ends
        passive: as in `forward_dynamics`
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

    def simulate(
        self,
        q: Array,
        qd: Array,
        time: Any,
        tau: Any = None,
        loads: Any = (),
        passive: bool = True,
        step: float | None = None,
        method: str = "RK4",
        rtol: float = 1e-9,
        atol: float = 1e-12,
        constraints: Any = None,
    ) -> Trajectory[Array]:
        """How the robot moves from q and qd on, (..., n), at the instants `time`, (T,), in s.

        tau: what the actuators give: nothing unless given; (..., n), or a function of (t, q, qd) that is
        called wherever the method evaluates, also between steps
        loads: as in `induced_accelerations`, or a function of (t, q, qd) that gives them
        passive: as in `forward_dynamics`
        step: of RK4 the longest, in s; from instant to instant unless given; of the others a bound
        method: "RK4", of fixed steps, order 4, through which gradients flow; or one of SciPy's solve_ivp,
        RK45, DOP853, Radau, ..., whose steps keep rtol and atol, and with which all starts step together
        constraints: as in `induced_accelerations`; q is closed first, and q and qd may be (..., m), of the
        independent joints alone, as `Constraints.closed` takes them. Independent joints are integrated; the
        others are closed by Newton's method at each evaluation and after each step, and follow with G yd

        The answer's energy_drift is the energy that the integration made or lost. Raises ValueError where the
        motion ceases to be finite, and as forward_dynamics and `Constraints` do; ImportError without SciPy.
        """
        given = q, qd, time, tau, loads, passive, step, method, (rtol, atol), constraints
        trajectory: Trajectory[Array] = self.backend.simulated(self, *given)
        return trajectory

    def induced_reactions(
        self,
        q: Array,
        qd: Array,
        tau: Array | None = None,
        qdd: Array | None = None,
        loads: Any = (),
        passive: bool = True,
        constraints: Any = None,
    ) -> InducedAccelerations[Array]:
        """What each source puts on the constraints: shares of lambda, (..., C, ...), by their rows.

        Arguments are those of `induced_accelerations`. Raises ValueError without constraints.
        """
        answers, given = self.backend.induced(self), (q, qd, tau, qdd, loads, passive)
        shares: InducedAccelerations[Array] = answers.reactions(*given, constraints)
        return shares
