"""Controllers of a robot's partial impedance: they read targets, check motion and compute torques."""

from collections.abc import Iterable, Mapping
from typing import Any, Generic, Protocol, cast

import numpy as np

from ..answers.packed import TorqueOfOne
from ..arguments import NOTHING, Beside
from ..arrays.backend import ArrayBackend
from ..chosen_names import known_kind
from ..constraints.robot_constraints import TiedRobot, made_again
from ..interface import Array, Numbers
from ..targets import FrameImpedance, Target
from .frame_impedance import OF_FRAME, FrameTargets
from .gains import TargetShares, stiffness_of, target_shares
from .joint_impedance import (
    ORDERS,
    Errors,
    JointImpedance,
    JointTargets,
    cancelled_motions,
    dissipates,
    friction_width_of,
    times,
)

Made = tuple[str, tuple[object, ...]]
Given = Mapping[str, Numbers]
"""Arguments of a call by name, of one batch shape (...)."""


class ControlledRobot(TiedRobot, Protocol):
    """Attributes of a robot that controllers need."""

    @property
    def name(self) -> str:
        """Name of the robot's package."""


class Controller:
    """Base of the controllers: targets of a robot, and how its state is read."""

    def __init__(
        self, robot: ControlledRobot, targets: JointTargets, frame: FrameTargets | None, made: Made
    ) -> None:
        """Keep the robot and its targets.

        made: the robot's method that makes the controller again, as for a copy, and its arguments
        """
        self._robot, self._frame, self._made = robot, frame, made
        self._joints = JointImpedance(robot.structure, targets)
        self._of_one: dict[ArrayBackend, TorqueOfOne | None] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what pickle and copy need: the robot, copied with it, makes it again."""
        call, arguments = self._made
        return made_again, (self._robot, call, arguments)

    def _about(self) -> str:
        """Return the robot's name, its back end, and the frame that is controlled."""
        frame = "" if self._frame is None else f", frame {self._frame.frame!r}"
        return f"{self._robot.name} on {self._robot.backend.name}{frame}"

    def _torque_of_one(self, backend: ArrayBackend, given: Given) -> Numbers | None:
        """Return the torque if the back end has it for one sample without these arrays, else None."""
        if backend not in self._of_one:
            self._of_one[backend] = backend.controller(self._joints.targets, self._frame)
        of_one = self._of_one[backend]
        return None if of_one is None else of_one.torque(given)

    def _arrays(
        self, q: object, qd: object, motion: Mapping[str, object], beside: Mapping[str, Beside] = NOTHING
    ) -> tuple[ArrayBackend, dict[str, Numbers]]:
        """Return the back end and the arguments by name; motion: other arguments of shape (..., n)."""
        named = {"q": q, "qd": qd} | {name: a for name, a in motion.items() if a is not None}
        backend, arrays = self._robot.door.read(named, beside=beside)
        return backend, dict(zip((*named, *beside), arrays, strict=True))


class PartialImpedance(Controller, Generic[Array]):
    """Controller that makes the robot obey impedance targets; made by `Dynamics.partial_impedance`.

    With e = q - q_d and f the torques on the joints from outside (the paper's equation, summed over j), it
    returns the torque u of

        M* (qdd - qdd_d) + B* (qd - qd_d) + K* e = f     M* = sum_j M_ijk, B* and K* likewise
        u = M qdd + C qd + g - f, where qdd follows from the line above

    Only the sums over the links move the robot: how a sum is shared among the links is a choice, made when
    entries are given or the natural ones are scaled.

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

        For joints this holds with any target, for a frame with a target at rest. It holds where inertia and
        damping keep the same share of each link, and all that is added and the stiffness are positive: the
        kept c1 balance the change of the inertia. It does not hold for a frame that is stiff about one or two
        of the three axes, as the angle about one changes by turns about the others. It is False for links of
        energies, of which nothing is known.
        """
        if self._robot.backend.tree is None:  # nothing is known of a user's energies
            return False
        if self._frame is not None:
            return self._frame.dissipative
        return dissipates(self._joints.targets.inertia, self._joints.targets.damping)

    def __call__(self, q: Array, qd: Array, target: object = None, external: Array | None = None) -> Array:
        """Return the torque u of the actuators, (..., n), in N m or N."""
        backend, given = self._given(q, qd, target, external)
        torque = self._torque_of_one(backend, given)
        if torque is None and self._frame is None and self._joints.targets.inertia.natural:
            state = self._joints.state(backend, given["q"], given["qd"])
            torque = self._joints.natural_torque(backend, state, given["qd"], _errors(given))
        return cast("Array", self._followed(backend, given)[1] if torque is None else torque)

    def acceleration(
        self, q: Array, qd: Array, target: object = None, external: Array | None = None
    ) -> Array:
        """Return the acceleration qdd that follows, (..., n), in rad/s^2 or m/s^2."""
        return cast("Array", self._followed(*self._given(q, qd, target, external))[0])

    def stored_energy(self, q: Array, qd: Array, target: object = None) -> Array:
        """Return the stored energy (ed' M* ed + e' K* e) / 2 in J, (...); with a frame, that of the frame."""
        backend, given = self._given(q, qd, target, None)
        at, moved = given["q"], given["qd"]
        state = self._joints.state(backend, at, moved)
        if self._frame is None:
            return cast("Array", self._joints.stored(backend, state, _errors(given)))
        framed = self._frame.state(backend, state, given)
        return cast("Array", self._frame.stored(backend, framed))

    def _followed(self, backend: ArrayBackend, given: Given) -> tuple[Numbers, Numbers]:
        """Return the acceleration that follows, and the torque for it."""
        q, qd, external = given["q"], given["qd"], given.get("external")
        state = self._joints.state(backend, q, qd)
        qdd = self._joints.acceleration(backend, state, _errors(given), told=self._frame is not None)
        if self._frame is not None:
            framed = self._frame.state(backend, state, given)
            qdd = self._frame.acceleration(backend, framed, qdd, external)
        return qdd, self._joints.torque(state, qd, qdd, external)

    def _given(
        self, q: object, qd: object, target: object, external: object
    ) -> tuple[ArrayBackend, dict[str, Numbers]]:
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


class Cancellation(Controller, Generic[Array]):
    """Controller that cancels chosen motion propagation torques and leaves the others; see `Dynamics.cancel`.

    It returns u = tau + the sum over the cancelled c_m,ijk q_k^(m) + g, and the joints' own torques as
    `partial_impedance` compensates them. Under u the robot obeys

        (M - M_S) qdd + (C - C_S) qd = tau + f

    with S for what is cancelled. Arguments, batches and errors are as for `PartialImpedance`.
    """

    entries: tuple[tuple[str, str, str, int], ...]
    """Names of joint, link and coordinate, and the order, of each torque that is cancelled."""

    def __init__(
        self,
        robot: ControlledRobot,
        targets: JointTargets,
        entries: tuple[tuple[str, str, str, int], ...],
        made: Made,
    ) -> None:
        super().__init__(robot, targets, None, made)
        self.entries = entries

    def __repr__(self) -> str:
        return f"<{len(self.entries)} motion propagation torques of {self._about()} cancelled>"

    def __call__(
        self,
        q: Array,
        qd: Array,
        tau: Array | None = None,
        external: Array | None = None,
        qdd: Array | None = None,
    ) -> Array:
        """Return the torque u of the actuators, (..., n), in N m or N.

        tau: torques that the task asks for, (..., n); zero unless given
        qdd: acceleration at which the cancelled torques are taken, measured or wanted; unless given, the one
        that follows. With all torques cancelled and a wanted acceleration, this is computed torque control,
        except for armature, which belongs to no link.
        """
        backend, given = self._arrays(q, qd, {"task": tau, "external": external, "qdd": qdd})
        at, moved, accelerated = given["q"], given["qd"], given.pop("qdd", None)
        if accelerated is None and (torque := self._torque_of_one(backend, given)) is not None:
            return cast("Array", torque)
        state = self._joints.state(backend, at, moved)
        if accelerated is None:
            accelerated = self._joints.acceleration(backend, state, _errors(given))
        # tau + M_S qdd + C_S qd + g + p
        cancelled = times(state.inertia - state.target_inertia, accelerated)
        cancelled = cancelled + times(state.coriolis - state.target_damping, moved) + state.rest
        return cast("Array", cancelled + given["task"] if "task" in given else cancelled)

    def acceleration(
        self, q: Array, qd: Array, tau: Array | None = None, external: Array | None = None
    ) -> Array:
        """Return the acceleration qdd that follows, (..., n), in rad/s^2 or m/s^2."""
        backend, given = self._arrays(q, qd, {"task": tau, "external": external})
        state = self._joints.state(backend, given["q"], given["qd"])
        return cast("Array", self._joints.acceleration(backend, state, _errors(given)))


def partial_impedance(
    robot: ControlledRobot,
    inertia: object,
    damping: object,
    stiffness: object,
    frame: FrameImpedance | None,
    passive: bool,
    friction_width: float | None,
) -> PartialImpedance[Any]:
    """Return the controller of `Dynamics.partial_impedance`."""
    _check_free(robot)
    structure = robot.structure
    targets = JointTargets(
        target_shares("inertia", inertia, structure, True),
        target_shares("damping", damping, structure, False),
        stiffness_of(stiffness, structure),
        True,
        bool(passive),
        friction_width_of(friction_width, passive),
    )
    held = None if frame is None else FrameTargets(robot.backend.frames, frame)
    asked = (inertia, damping, stiffness, frame, passive, friction_width)
    return PartialImpedance(robot, targets, held, ("partial_impedance", asked))


def cancellation(
    robot: ControlledRobot, entries: Iterable[object], passive: bool, friction_width: float | None
) -> Cancellation[Any]:
    """Return the controller of `Dynamics.cancel`."""
    _check_free(robot)
    structure = robot.structure
    chosen = cancelled_motions(entries, structure)
    kept = {order: np.ones((structure.n, structure.N, structure.n)) for order in ORDERS}
    for i, j, k, order in chosen:
        kept[order][i, j, k] = 0.0
    acceleration, velocity = (TargetShares(kept[m], None, None, False, False) for m in (2, 1))
    width = friction_width_of(friction_width, passive)
    targets = JointTargets(acceleration, velocity, None, False, bool(passive), width)
    names = structure.joint_names, structure.link_names
    named = tuple((names[0][i], names[1][j], names[0][k], m) for i, j, k, m in chosen)
    return Cancellation(robot, targets, named, ("cancel", (named, passive, friction_width)))


def _check_free(robot: ControlledRobot) -> None:
    if robot.backend.ties_joints:
        raise ValueError(
            f"the joints of {robot.name} are tied, and are not free to have an impedance each; "
            "controllers are there for open trees"
        )


def _errors(given: Given) -> Errors:
    """Return how far motion is from its target, and the forces from outside and of a task."""
    place = given["q"] - given["target"] if "target" in given else None
    rate = given["qd"] - given["target.qd"] if "target.qd" in given else given["qd"]
    forces = [given[name] for name in ("external", "task") if name in given]
    return Errors(place, rate, given.get("target.qdd"), sum(forces[1:], forces[0]) if forces else None)
