"""Base of the controllers: motion is read, and driven joints give what a wanted motion needs."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from ..answers.packed import TorqueOfOne
from ..arguments import NOTHING, Beside
from ..arrays.backend import ArrayBackend
from ..constraints.closed_places import tie_forces, times
from ..constraints.robot_constraints import Constraints, made_again
from ..interface import Numbers
from ..motion.induced_accelerations import DrivenRobot, constraints_of
from .actuators import Actuators, Drive
from .frame_impedance import FrameTargets
from .freedom import freedom_of
from .grips import ContactTorques, Grips
from .joint_impedance import Errors, JointImpedance, JointState, JointTargets

Made = tuple[str, tuple[object, ...]]
Given = Mapping[str, Numbers]
"""Arguments of a call by name, of one batch shape (...)."""


class Stance(NamedTuple):
    """Constraints and drives of a robot, as `Dynamics.partial_impedance` is given it."""

    constraints: object
    actuated: object
    torque_weight: object
    grips: object


class StanceRead(NamedTuple):
    """Constraints, actuators and limits of contacts that were read."""

    constraints: Constraints[Any] | None
    actuators: Actuators
    grips: Grips


def standing_of(robot: DrivenRobot, stance: Stance) -> StanceRead:
    """Return what holds a robot and what drives it; raises as `Dynamics.partial_impedance` does."""
    held = constraints_of(robot, stance.constraints)
    actuators = Actuators(robot.structure, held, stance.actuated, stance.torque_weight)
    return StanceRead(held, actuators, Grips(held, actuators, stance.grips))


class Need(NamedTuple):
    """Torques that a wanted motion needs of the joints."""

    backend: ArrayBackend
    state: JointState
    torque: Numbers
    """Torques on all joints, up to forces of ties, (..., n)."""
    qdd: Numbers | None
    """Acceleration, (..., n); None where it was not worked out, as torques do not depend on it."""


class Controller:
    """Base of the controllers: targets of a robot, and how its state is read."""

    def __init__(
        self,
        robot: DrivenRobot,
        standing: StanceRead,
        targets: JointTargets,
        frame: FrameTargets | None,
        made: Made,
    ) -> None:
        """Keep the robot and its targets.

        made: the robot's method that makes the controller again, as for a copy, and its arguments
        """
        self._robot, self._frame, self._made = robot, frame, made
        self._constraints, self._actuators, self._grips = standing
        self._joints = JointImpedance(robot.structure, targets)
        self._of_one: dict[ArrayBackend, TorqueOfOne | None] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what pickle and copy need: the robot, copied with it, makes it again."""
        call, arguments = self._made
        return made_again, (self._robot, call, arguments)

    @property
    def actuated(self) -> tuple[str, ...]:
        """Names of the joints that give torques; the others get zeros."""
        return self._actuators.names

    @property
    def undriven(self) -> int:
        """Number of independent motions in which no driven joint takes part, as of who stands on two points.

        They go as they do under these torques, and all driven joints as they are asked to.
        """
        return self._actuators.undriven

    def _about(self) -> str:
        """Return the robot's name, its back end, and the frame that is controlled."""
        frame = "" if self._frame is None else f", frame {self._frame.frame!r}"
        return f"{self._robot.name} on {self._robot.backend.name}{frame}"

    def _torque_of_one(self, backend: ArrayBackend, given: Given) -> Numbers | None:
        """Return the torque if the back end has it for one sample without these arrays, else None."""
        of_one = self._for_one(backend)
        return None if of_one is None else of_one.torque(given)

    def _acceleration_of_one(self, backend: ArrayBackend, given: Given) -> Numbers | None:
        """Return the acceleration that follows, likewise."""
        of_one = self._for_one(backend)
        return None if of_one is None else of_one.acceleration(given)

    def _forces_of_one(self, backend: ArrayBackend, given: Given) -> Numbers | None:
        """Return the forces of ties and contacts that follow, likewise."""
        of_one = self._for_one(backend)
        return None if of_one is None else of_one.forces(given)

    def _for_one(self, backend: ArrayBackend) -> TorqueOfOne | None:
        if backend not in self._of_one:
            self._of_one[backend] = self._made_for_one(backend)
        return self._of_one[backend]

    def _made_for_one(self, backend: ArrayBackend) -> TorqueOfOne | None:
        """Return the back end's functions; None without any, as where contacts have limits."""
        by, targets = self._actuators, self._joints.targets
        if self._constraints is None:
            return backend.controller(targets, self._frame) if by.drive_all else None
        functions = self._constraints.ties.functions(backend)
        if functions is None or self._grips:
            return None
        return functions.controller(targets, self._frame, by.joints, by.weight, by.undriven)

    def _arrays(
        self, q: object, qd: object, motion: Mapping[str, object], beside: Mapping[str, Beside] = NOTHING
    ) -> tuple[ArrayBackend, dict[str, Numbers]]:
        """Return the back end and the arguments by name; motion: other arguments of shape (..., n)."""
        named = {"q": q, "qd": qd} | {name: a for name, a in motion.items() if a is not None}
        backend, arrays = self._robot.door.read(named, beside=beside)
        return backend, dict(zip((*named, *beside), arrays, strict=True))

    def _state(self, backend: ArrayBackend, given: Given) -> tuple[JointState, Given]:
        """Return the state of the joints, and the arguments with velocities in which all joints follow."""
        freedom = freedom_of(backend, self._constraints, given["q"], given["qd"])
        return self._joints.state(backend, given["q"], freedom), {**given, "qd": freedom.qd}

    def _drive(self, need: Need) -> Drive:
        """Return the torques of the driven joints that are the least, whatever contacts bear."""
        return self._actuators.driving(need.backend, need.state.freedom, need.state.inertia, need.torque)

    def _torque(self, need: Need) -> Numbers:
        """Return the torques of the driven joints, (..., n)."""
        drive = self._drive(need)
        return self._kept(need, drive).torque if self._grips else drive.torque

    def _kept(self, need: Need, drive: Drive) -> ContactTorques:
        """Return the torques under which contacts with limits hold, and what these bear."""
        total = _total(need, drive)
        return self._grips.borne(need.backend, need.state.freedom, total, drive.torque)

    def _moved(self, need: Need) -> Numbers:
        """Return the acceleration that follows, (..., n)."""
        assert need.qdd is not None  # who asks for it has it worked out
        if not self._actuators.undriven:
            return need.qdd
        left = self._drive(need).left
        return need.qdd if left is None else need.qdd + left

    def _borne(self, need: Need) -> Numbers:
        """Return lambda (..., C): A^T lambda is what motion needs of joints, less what they give."""
        place = need.state.freedom.place
        if place is None:
            raise ValueError(
                f"{self._robot.name} has no ties here whose forces could be told; give constraints=, as from "
                "robot.constrained(contacts=[...])"
            )
        drive = self._drive(need)
        if self._grips:
            return self._kept(need, drive).forces
        return tie_forces(place.found, (_total(need, drive) - drive.torque)[..., None])[..., 0]


def _total(need: Need, drive: Drive) -> Numbers:
    """Return what the motion that follows needs of joints, (..., n): what driven joints and ties give."""
    return need.torque if drive.left is None else need.torque + times(need.state.inertia, drive.left)


def errors_of(given: Given) -> Errors:
    """Return how far motion is from its target, and the forces from outside and of a task."""
    place = given["q"] - given["target"] if "target" in given else None
    rate = given["qd"] - given["target.qd"] if "target.qd" in given else given["qd"]
    forces = [given[name] for name in ("external", "task") if name in given]
    return Errors(place, rate, given.get("target.qdd"), sum(forces[1:], forces[0]) if forces else None)
