"""Controllers of a robot's partial impedance: they read targets, check motion and compute torques."""

from typing import Any, Generic, cast

from ..arguments import Beside
from ..arrays.backend import ArrayBackend
from ..chosen_names import known_kind, listed
from ..interface import Array
from ..motion.induced_accelerations import DrivenRobot
from ..targets import FrameImpedance, Target
from .controller import Controller, Given, Need, Stance, errors_of, standing_of
from .frame_impedance import OF_FRAME, FrameTargets
from .gains import stiffness_of, target_shares
from .joint_impedance import JointTargets, dissipates, friction_width_of


class PartialImpedance(Controller, Generic[Array]):
    """Controller that makes the robot obey impedance targets; made by `Dynamics.partial_impedance`.

    With e = q - q_d and f the torques on the joints from outside (the paper's equation, summed over j), it
    returns the torque u of

        M* (qdd - qdd_d) + B* (qd - qd_d) + K* e = f     M* = sum_j M_ijk, B* and K* likewise
        u = M qdd + C qd + g - f, where qdd follows from the line above

    Only the sums over the links move the robot: how a sum is shared among the links is a choice, made when
    entries are given or the natural ones are scaled.

    Under ties the line holds along all motions that these leave, with the forces of ties beside f: the robot
    moves as one of these inertias, dampings and stiffnesses under the same ties. Of q and qd the independent
    joints count, as for `Constraints`, and joints that nothing drives have no torque; see `Actuators` for how
    torques are chosen where many do, as of who stands on four feet.

    A frame has precedence over the joints: of all accelerations with which the frame moves as asked, the
    joints take the one nearest to what the lines above ask for, by Gauss's principle of least constraint.

    M is the inertia of links and armatures. Friction of the joints brakes them in addition to f, except for
    the part that is compensated, which is never more than there is. Arguments, batches and errors are as for
    `Dynamics`; gradients flow through motion, targets and gains.

    target: positions q_d (..., n) to stay at, or a `Target`
    external: torques f of the surroundings on the joints, (..., n), in N m or N: J^T (moment, force), and so
    the negative of `kinematics.load_torque`; zero unless given. What is natural in M* needs no measured f.

    Raises ValueError for an M* that is not positive definite at a sample, for a frame that cannot move along
    one of its rows, and for a frame that is half a turn from its target. Warns where rounding leaves fewer
    than half of the digits of the wanted accelerations.
    """

    def __repr__(self) -> str:
        return f"<partial impedance of {self._about()}>"

    @property
    def dissipative(self) -> bool:
        """True if the stored energy falls along every motion with f = 0.

        For joints this holds with any target, for a frame and under ties with a target at rest. It holds
        where inertia and damping keep the same share of each link, and all that is added and the stiffness
        are positive: the kept c1 balance the change of the inertia. It does not hold for a frame that is
        stiff about one or two of the three axes, as the angle about one changes by turns about the others. It
        is False for links of energies, of which nothing is known, and where nothing drives some motions.
        """
        if self._robot.backend.tree is None or self.undriven:  # nothing is known of a user's energies
            return False
        if self._frame is not None:
            return self._frame.dissipative
        return dissipates(self._joints.targets.inertia, self._joints.targets.damping)

    def __call__(self, q: Array, qd: Array, target: object = None, external: Array | None = None) -> Array:
        """Return the torque u of the actuators, (..., n), in N m or N."""
        backend, given = self._given(q, qd, target, external)
        torque = self._torque_of_one(backend, given)
        if torque is not None:
            return cast("Array", torque)
        if self._frame is None and self._joints.targets.inertia.natural and not self._grips:
            state, given = self._state(backend, given)
            natural = self._joints.natural_torque(backend, state, errors_of(given))
            return cast("Array", self._torque(Need(backend, state, natural, None)))
        return cast("Array", self._torque(self._followed(backend, given)))

    def acceleration(
        self, q: Array, qd: Array, target: object = None, external: Array | None = None
    ) -> Array:
        """Return the acceleration qdd that follows, (..., n), in rad/s^2 or m/s^2."""
        backend, given = self._given(q, qd, target, external)
        found = self._acceleration_of_one(backend, given)
        return cast("Array", self._moved(self._followed(backend, given)) if found is None else found)

    def forces(self, q: Array, qd: Array, target: object = None, external: Array | None = None) -> Array:
        """Return the forces lambda of ties and contacts that follow, (..., C), as `Constraints` has them."""
        backend, given = self._given(q, qd, target, external)
        found = self._forces_of_one(backend, given)
        return cast("Array", self._borne(self._followed(backend, given)) if found is None else found)

    def stored_energy(self, q: Array, qd: Array, target: object = None) -> Array:
        """Return the stored energy (ed' M* ed + e' K* e) / 2 in J, (...); with a frame, that of the frame."""
        backend, given = self._given(q, qd, target, None)
        state, given = self._state(backend, given)
        if self._frame is None:
            return cast("Array", self._joints.stored(backend, state, errors_of(given)))
        framed = self._frame.state(backend, state, given)
        return cast("Array", self._frame.stored(backend, framed))

    def _followed(self, backend: ArrayBackend, given: Given) -> Need:
        """Return the acceleration that is asked for, and what it needs of the joints."""
        external = given.get("external")
        state, given = self._state(backend, given)
        qdd = self._joints.acceleration(backend, state, errors_of(given), told=self._frame is not None)
        if self._frame is not None:
            framed = self._frame.state(backend, state, given)
            qdd = self._frame.acceleration(backend, framed, qdd, external)
        return Need(backend, state, self._joints.torque(state, qdd, external), qdd)

    def _given(self, q: object, qd: object, target: object, external: object) -> tuple[ArrayBackend, Given]:
        """Return the back end and the arguments by name; positions alone are a target."""
        read = target if isinstance(target, Target) else Target(q=target)
        if hasattr(read.q, "_fields"):
            raise TypeError(
                f"target is {known_kind(read.q, Target)}; give positions (..., n), or Target(q, qd, ...)"
            )
        if read.q is None and self._joints.targets.stiffness is not None:
            raise ValueError("the joints are stiff, but target has no q; give positions, (..., n)")
        if self._frame is None and any(a is not None for a in read[3:]):
            raise ValueError(
                "target has what a frame shall do, but none is controlled; give frame=FrameImpedance(...)"
            )
        motion: dict[str, object] = {
            "target": read.q,
            "target.qd": read.qd,
            "target.qdd": read.qdd,
            "external": external,
        }
        beside = {
            f"target.{name}": Beside(getattr(read, name), axes, meaning)
            for name, (axes, meaning) in OF_FRAME.items()
            if getattr(read, name) is not None
        }
        return self._arrays(q, qd, motion, beside)


def partial_impedance(
    robot: DrivenRobot,
    stance: Stance,
    inertia: object,
    damping: object,
    stiffness: object,
    frame: FrameImpedance | None,
    passive: bool,
    friction_width: float | None,
) -> PartialImpedance[Any]:
    """Return the controller of `Dynamics.partial_impedance`."""
    structure, on = robot.structure, standing_of(robot, stance)
    targets = JointTargets(
        target_shares("inertia", inertia, structure, True),
        target_shares("damping", damping, structure, False),
        stiffness_of(stiffness, structure),
        True,
        bool(passive),
        friction_width_of(friction_width, passive),
    )
    held = None if frame is None else FrameTargets(robot.backend.frames, frame)
    if held is not None and on.actuators.undriven:
        raise ValueError(
            f"frame {held.frame!r} cannot have an impedance while {listed(on.actuators.names)} leave "
            f"{on.actuators.undriven} of the robot's motions to themselves; "
            "hold more contacts, or let the joints have impedances alone"
        )
    asked = (inertia, damping, stiffness, frame, passive, friction_width, *stance)
    return PartialImpedance(robot, on, targets, held, ("partial_impedance", asked))
