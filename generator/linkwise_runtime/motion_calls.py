"""Calls on motions as a whole and on their causes, which every back end answers.

They solve for accelerations or go along a motion: what accelerates what, what joints bear, where power flows,
simulation, and where velocities came from.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from .constraints.robot_constraints import Constraints, constraints_of
from .interface import Array
from .joint_reactions import Reactions
from .motion.borne_wrenches import Borne, reactions
from .motion.counterfactual import Without, counterfactual_motion
from .motion.induced_accelerations import Driven, induced_accelerations, induced_reactions
from .motion.induced_power import induced_flow, induced_power
from .motion.simulated import Simulated, simulate_motion
from .motion.traced import Traced, trace_motion
from .motion_quantities import Counterfactual, TracedMotion
from .quantities import Contact, InducedAccelerations, Trajectory
from .robot_calls import RobotCalls


class MotionCalls(RobotCalls):
    """Constraints, and calls on motions and their causes; arguments and answers are as `Dynamics` says."""

    @cached_property
    def constraints(self) -> Constraints[Any]:
        """Calls on the motion that the ties and couplings of the robot's file allow, see `Constraints`.

        Raises ValueError for a robot without any, links given by energies without constraints included.
        """
        return constraints_of(self, None, (), None, None, None)

    def constrained(
        self,
        independent: Sequence[int | str] | None = None,
        contacts: Sequence[Contact] = (),
        at: Array | None = None,
        tolerance: float | None = None,
        force_weight: Any = None,
    ) -> Constraints[Any]:
        """Return `constraints` with contacts or other independent joints, also of a robot without ties.

        independent: joints by number or by name; unless given, those of the file where there are no contacts,
        and else joints chosen by pivoting, as few as possible of a floating base
        contacts: frames that the ground holds
        at: positions (n,) at which loops close, where the joints are chosen; unless given, some that are
        found
        tolerance: largest violation of a tie, in m or rad, that calls accept; unless given, 1e-6 (1e-4 in
        float32) of what joints could close, and 1e-4 of the rest: right angles of 1.5708 in files leave some
        micrometres that nothing closes
        force_weight: weights of the squares of the forces of redundant rows, of which the least sum is taken:
        numbers above 0, (C,), or by the name of a tie or contact, 1 for what is left out, at most 1e6 times
        apart; a coupling's force counts times its largest slope, where that is above 1

        Raises ValueError for a joint or frame that does not exist, for independent joints that do not
        determine the others at `at`, and where nothing is left to move.
        """
        return constraints_of(self, independent, contacts, at, tolerance, force_weight)

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
        """Return the acceleration that each source causes alone: shares that sum to the acceleration.

        tau: torques of the actuators, (..., n); or in its place
        qdd: a motion's acceleration: the actuators then give what it requires of them, less what loads do
        loads: external loads, each an `AppliedLoad`, or a list of them for one source, such as a muscle's two
        ends
        passive: as in `forward_dynamics`
        frame: what is accelerated: the coordinates unless given, or a frame, with its `point`, as
        `robot.kinematics` accepts them, or "centre of mass"
        constraints: constraints that the motion keeps: the file's ties unless given, else what
        `robot.constrained` returns, or False for the open tree; q, qd are then as for `Constraints`, and the
        actuators that a qdd requires are those of the independent joints

        The frame's own dJ/dt qd is the share `kinematic`. Sources of acceleration are forces: the
        acceleration by gravity at rest is there even where it is held, and an actuator's share cancels it.

        Raises as forward_dynamics does, and names the load that is wrong.
        """
        asked = Driven(q, qd, tau, qdd, loads, passive, constraints)
        shares: InducedAccelerations[Array] = induced_accelerations(self, asked, frame, point)
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
        inputs: Mapping[str, Any] | None = None,
    ) -> Trajectory[Array]:
        """Return the motion of the robot from q and qd on, (..., n), at the instants `time`, (T,), in s.

        tau: torques of the actuators: none unless given; (..., n), or a function of (t, q, qd) that is called
        wherever the method evaluates, also between steps; what functions return is converted to the library
        and the precision of q and qd, and has no more samples than these
        loads: as in `induced_accelerations`, or a function of (t, q, qd) that returns them
        passive: as in `forward_dynamics`
        step: longest step of RK4, in s; from instant to instant unless given; for the other methods a bound
        method: "RK4", of fixed steps, order 4, through which gradients flow; or one of SciPy's solve_ivp,
        RK45, DOP853, Radau, ..., whose steps keep to rtol and atol, and with which all starts step together
        constraints: as in `induced_accelerations`; q is closed first, and q and qd may be (..., m), of the
        independent joints alone, as `Constraints.closed` accepts them. Independent joints are integrated; the
        others are closed by Newton's method at each evaluation and after each step, and follow with G yd
        inputs: of links that were written by hand, by name: numbers, (...), or functions of (t, q, qd); those
        that are left out keep the values that the robot has, and its time is that of the motion

        The answer's energy_drift is the energy that the integration added or lost. Raises ValueError where
        the motion is no longer finite, and as forward_dynamics and `Constraints` do; ImportError without
        SciPy, for its methods.
        """
        given = Simulated(q, qd, time, tau, loads, passive, step, method, rtol, atol, constraints, inputs)
        trajectory: Trajectory[Array] = simulate_motion(self, given)
        return trajectory

    def trace(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        time: Any,
        tau: Array | None = None,
        loads: Any = (),
        passive: bool = True,
        constraints: Any = None,
        windows: Any = (),
        restarts: Any = (),
        by_link: bool = False,
        weight: str = "apart",
    ) -> TracedMotion[Array]:
        """Return a motion's velocities by the forces that gave them: parts that sum to qd.

        Part s of source s, along the motion (T, ..., n) that took place at the instants `time`, (T,), is what
        M dv_s/dt + C(q, qd) v_s = F_s says, with C_ik = sum_j c1_ijk, from zero at the start on; under
        constraints it keeps them. Its energy is changed by its own source alone. It tells where the momentum
        that is there came from, not what the motion would have been without the source, and it depends on the
        coordinates, and on the symmetric split c1 of the velocity forces.

        tau: torques of the actuators, (T, ..., n): what is left of the motion is then the source "residual";
        unless given, actuators give what the motion needs, less what loads do
        loads, passive, constraints: as in `induced_accelerations`; loads of T samples
        windows: length in s, or instants, (W - 1,): sources are cut there, at the samples next to them
        restarts: instants at which the trace begins anew: all velocities are those of the start there
        by_link: whether gravity is a source for each link
        weight: "apart", as a source: it and the torques that hold it then give velocities that grow with time
        and cancel each other; or "borne": torques are those beyond what holds the weight, which is a source
        for a floating base alone, that no torque holds

        Between samples velocities go by cubics that have the accelerations of the samples. Raises ValueError
        for a gap in time, for instants outside the motion, for kinetic energies of degree three or more in
        the velocities, and as `forward_dynamics` and `Constraints` do.
        """
        given = Traced(q, qd, qdd, time, tau, loads, passive, constraints, windows, restarts, by_link, weight)
        traced: TracedMotion[Array] = trace_motion(self, given)
        return traced

    def counterfactual(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        time: Any,
        without: str,
        tau: Array | None = None,
        loads: Any = (),
        passive: bool = True,
        constraints: Any = None,
        step: float | None = None,
    ) -> Counterfactual[Array]:
        """Return the motion that there would have been without one of its sources, all else as it was.

        The robot starts as the motion did and is simulated under what the motion needed, less the source:
        where `trace` splits the motion that took place, this is another motion, with other inertias, other
        velocity forces and, later, elsewhere. Beside it is its first order, which is linear in the source,
        so that first orders of all sources sum up to another motion still.

        without: a source by the name that `trace` has for it: "torque:elbow", "gravity", "load:hand", "start"
        step: longest step of RK4, in s; from sample to sample unless given
        other arguments: as in `trace`

        Raises ValueError for a source that is not there, and as `trace` and `simulate` do.
        """
        motion = Traced(q, qd, qdd, time, tau, loads, passive, constraints)
        found: Counterfactual[Array] = counterfactual_motion(self, Without(motion, without, step))
        return found

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
        """Return the constraint force that each source causes: shares of lambda, (..., C, ...), by the rows.

        Arguments are those of `induced_accelerations`. Raises ValueError without constraints.
        """
        asked = Driven(q, qd, tau, qdd, loads, passive, constraints)
        shares: InducedAccelerations[Array] = induced_reactions(self, asked)
        return shares

    def reactions(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        axes: str | int = "joint",
        point: Array | None = None,
        joints: Any = None,
        loads: Any = (),
        passive: bool = True,
        constraints: Any = None,
    ) -> Reactions[Array]:
        """Return the whole wrench that each joint carries, by cause: shares (..., F, ..., 6) that sum to it.

        It is what the side of the ground exerts on the other side through the joint, moments about x, y and z
        in N m, then forces in N. F counts joints of the tree, `tree_joint_names`: joints that follow others
        are among them, and of a joint that turns or slides along several axes each axis is one.

        axes: axes of the wrenches: "joint", those of the frame that each joint moves, in which z is the
        joint's axis; "world"; or a frame by its name, as `robot.kinematics` accepts them
        point: point about which moments are taken, in these axes and from their origin, in m, (3,) or (...,
        3); unless given, the joint's own origin
        joints: joints by name or by number in `tree_joint_names`, one or a list; all unless given. Answers
        grow with joints, links and coordinates: of long robots ask for those that matter
        loads: as in `induced_accelerations`
        passive: whether coordinates that follow others by ties have their springs, damping, friction and
        armature, which changes the forces of ties
        constraints: as in `induced_accelerations`; of qd and qdd the independent joints count, and as for
        `Constraints` the others have no actuators

        In the joint's axes, moment_z of a hinge, or force_z of a slide, is tau_ij by the same cause. How a
        joint bears its axis' part, by actuator, spring, damping, friction or coupling, is not told: they act
        within it. What turns behind gears, the armature, is no link, and no part of the wrench in a tree.

        Raises ValueError for links given by energies, also for those of the back end autograd, and as
        `Constraints` and `induced_accelerations` do.
        """
        asked = Borne(q, qd, qdd, axes, point, joints, loads, passive, constraints)
        shares: Reactions[Array] = reactions(self, asked)
        return shares

    def induced_power(
        self,
        q: Array,
        qd: Array,
        tau: Array | None = None,
        qdd: Array | None = None,
        loads: Any = (),
        passive: bool = True,
        constraints: Any = None,
    ) -> InducedAccelerations[Array]:
        """Return the power in W that each source gives each link: shares (..., R, ...) of dE_j/dt.

        Arguments are those of `induced_accelerations`. The R rows are the links, whose energy E_j is kinetic
        and potential, then, if `passive`, the joints that have armature, which holds energy too.

        Rows sum to the rate of energy: `total`. Columns sum to the power of the source: of actuator i tau_i
        qd_i, of a spring, damping or friction minus what it takes, of a load what it gives. Velocity forces,
        weights and constraints hand power on, from link to link or from potential to kinetic energy, and
        their columns sum to 0; but weights of links that were written by hand, which are all their shares
        with names, to what dissipation, forces and imposed motions give. `kinematic` is 0.

        Raises as `induced_accelerations` does.
        """
        asked = Driven(q, qd, tau, qdd, loads, passive, constraints)
        shares: InducedAccelerations[Array] = induced_power(self, asked)
        return shares

    def induced_flow(
        self,
        q: Array,
        qd: Array,
        tau: Array | None = None,
        qdd: Array | None = None,
        loads: Any = (),
        passive: bool = True,
        constraints: Any = None,
        side: str = "successor",
    ) -> InducedAccelerations[Array]:
        """Return the power in W that flows through each joint to what hangs on it, by source: (..., n, ...).

        Arguments are those of `induced_accelerations`. It is the power of the joint's whole wrench, of which
        the actuator's torque is part.
        side: the body on whose twist this is
            successor    what the joint gives the body behind it
            predecessor  what the body before it gives the joint: less by what actuator, spring, damping and
                         friction of the joint give, more by what its armature takes

        Where several joints are in one place, as of a ball joint, the bodies are the first one's predecessor
        and the last one's successor. In loops a flow contains what ties carry to what hangs on the joint, and
        where some of the joints that a coordinate moves are behind another joint, what the coupling feeds in
        there: it is then not the power of the wrench that `reactions` tells.

        Raises as `induced_accelerations` does, and ValueError for links given by energies, which do not say
        what hangs on which joint.
        """
        asked = Driven(q, qd, tau, qdd, loads, passive, constraints)
        shares: InducedAccelerations[Array] = induced_flow(self, asked, side)
        return shares
