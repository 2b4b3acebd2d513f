"""Controllers behind their face: targets are read, motion is checked, torques are computed."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..arguments import check_numbers
from ..chosen_names import known_kind, short
from ..controllers import FrameImpedance, Target
from ..dense import Dense
from ..quantities import NaturalImpedance
from .cancelled_motions import ORDERS, cancelled_motions
from .frame_impedance import FrameTargets
from .joint_impedance import Errors, JointImpedance, JointTargets, dissipates, times
from .wanted_coefficients import WantedShares, stiffness_of, wanted


class Controls:
    """What makes controllers of a robot on any back end; arguments as `ControllerCalls` says."""

    def __init__(self, robot: Any, answers: "Callable[..., ControlAnswers] | None" = None) -> None:
        """answers: what makes a controller of a robot, targets of joints, and of a frame or None."""
        self._robot, self._answers = robot, answers or ControlAnswers

    def natural(self, q: Any, qd: Any, qdd: Any) -> NaturalImpedance[Any]:
        """See `ControllerCalls.natural_impedance`."""
        robot = self._robot
        packed, spread = robot.packed(q, qd, qdd), Dense(robot.structure, robot.backend).spread
        slopes = 2.0 * spread(packed.velocity, "velocity")
        if robot.structure.linear:
            slopes = slopes - spread(packed.velocity_linear, "velocity_linear")
        c0 = robot.position_gradient(q, qd, qdd)
        return NaturalImpedance(spread(packed.acceleration, "acceleration"), slopes, c0)

    def impedance(
        self,
        inertia: Any,
        damping: Any,
        stiffness: Any,
        frame: FrameImpedance | None,
        passive: bool,
        friction_width: float | None,
    ) -> "ControlAnswers":
        """See `ControllerCalls.partial_impedance`."""
        self._check_free()
        structure = self._robot.structure
        targets = JointTargets(
            wanted("inertia", inertia, structure, True),
            wanted("damping", damping, structure, False),
            stiffness_of(stiffness, structure),
            True,
            bool(passive),
            _width(friction_width, passive),
        )
        held = None if frame is None else FrameTargets(self._robot, frame)
        return self._answers(self._robot, targets, held)

    def cancellation(
        self, entries: Iterable[Any], passive: bool, friction_width: float | None
    ) -> tuple["ControlAnswers", tuple[tuple[str, str, str, int], ...]]:
        """See `ControllerCalls.cancel`."""
        self._check_free()
        structure = self._robot.structure
        chosen = cancelled_motions(entries, structure)
        kept = {order: np.ones((structure.n, structure.N, structure.n)) for order in ORDERS}
        for i, j, k, order in chosen:
            kept[order][i, j, k] = 0.0
        acceleration, velocity = (WantedShares(kept[m], None, None, False, False) for m in (2, 1))
        width = _width(friction_width, passive)
        targets = JointTargets(acceleration, velocity, None, False, bool(passive), width)
        names = structure.joint_names, structure.link_names
        named = tuple((names[0][i], names[1][j], names[0][k], m) for i, j, k, m in chosen)
        return self._answers(self._robot, targets, None), named

    def _check_free(self) -> None:
        tree = self._robot.backend.tree
        if tree is not None and tree.tied:
            raise ValueError(
                f"the joints of {self._robot.name} are tied, and are not free to have an impedance each; "
                "controllers are there for open trees"
            )


class ControlAnswers:
    """The calls of one controller."""

    def __init__(self, robot: Any, targets: JointTargets, frame: FrameTargets | None) -> None:
        self._robot, self._joints, self._frame = robot, JointImpedance(robot, targets), frame

    def about(self) -> str:
        """The robot, and the frame that is controlled."""
        frame = "" if self._frame is None else f", frame {self._frame.frame!r}"
        return f"{self._robot.name} on {self._robot.backend.name}{frame}"

    @property
    def dissipative(self) -> bool:
        """See `PartialImpedance.dissipative`; nobody knows what energies of a user's do."""
        if self._robot.backend.tree is None:
            return False
        if self._frame is not None:
            return self._frame.dissipative
        return dissipates(self._joints.targets.inertia, self._joints.targets.damping)

    def torque(self, q: Any, qd: Any, target: Any, external: Any) -> Any:
        """See `PartialImpedance.__call__`."""
        target, given = self._given(q, qd, target, external)
        torque = self._at_once(given, target)
        if torque is not None:
            return torque
        if self._frame is None and self._joints.targets.inertia.natural:
            state = self._joints.state(given["q"], given["qd"])
            return self._joints.natural_torque(state, given["qd"], _errors(given))
        return self._followed(given, target)[1]

    def acceleration(self, q: Any, qd: Any, target: Any, external: Any) -> Any:
        """See `PartialImpedance.acceleration`."""
        target, given = self._given(q, qd, target, external)
        return self._followed(given, target)[0]

    def stored_energy(self, q: Any, qd: Any, target: Any) -> Any:
        """See `PartialImpedance.stored_energy`."""
        target, given = self._given(q, qd, target, None)
        q, qd = given["q"], given["qd"]
        state = self._joints.state(q, qd)
        if self._frame is None:
            return self._joints.stored(state, _errors(given), q)
        return self._frame.stored(self._frame.state(state, q, qd, target))

    def cancelling(self, q: Any, qd: Any, tau: Any, external: Any, qdd: Any) -> Any:
        """See `Cancellation.__call__`: tau + M_S qdd + C_S qd + g + p."""
        given = self._arrays({"q": q, "qd": qd}, {"task": tau, "external": external, "qdd": qdd})
        q, qd, qdd = given["q"], given["qd"], given.pop("qdd", None)
        if qdd is None and (torque := self._at_once(given, Target())) is not None:
            return torque
        state = self._joints.state(q, qd)
        if qdd is None:
            qdd = self._joints.acceleration(state, _errors(given), q)
        cancelled = times(state.inertia - state.wanted_inertia, qdd)
        cancelled = cancelled + times(state.coriolis - state.wanted_damping, qd) + state.rest
        return cancelled + given["task"] if "task" in given else cancelled

    def cancelled_acceleration(self, q: Any, qd: Any, tau: Any, external: Any) -> Any:
        """See `Cancellation.acceleration`."""
        given = self._arrays({"q": q, "qd": qd}, {"task": tau, "external": external})
        return self._joints.acceleration(
            self._joints.state(given["q"], given["qd"]), _errors(given), given["q"]
        )

    def _at_once(self, given: dict[str, Any], target: Target) -> Any:
        """The torque, where a back end has it without these arrays; None where it does not."""

    def _followed(self, given: dict[str, Any], target: Target) -> tuple[Any, Any]:
        """Acceleration that follows, and torque for it."""
        q, qd, external = given["q"], given["qd"], given.get("external")
        state = self._joints.state(q, qd)
        qdd = self._joints.acceleration(state, _errors(given), q, told=self._frame is not None)
        if self._frame is not None:
            qdd = self._frame.acceleration(self._frame.state(state, q, qd, target), qdd, external)
        return qdd, self._joints.torque(state, qd, qdd, external)

    def _given(self, q: Any, qd: Any, target: Any, external: Any) -> tuple[Target, dict[str, Any]]:
        """Target and motion, as they were given and of one shape; positions alone are a target."""
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
        beside = {"target": read.q, "target.qd": read.qd, "target.qdd": read.qdd, "external": external}
        return read, self._arrays({"q": q, "qd": qd}, beside)

    def _arrays(self, motion: dict[str, Any], beside: dict[str, Any]) -> dict[str, Any]:
        """What was given, by name, in one shape (..., n)."""
        named = motion | {name: a for name, a in beside.items() if a is not None}
        arrays = self._robot.backend.arrays(named, self._robot.n)
        if self._robot.check_finite:
            check_numbers(named, self._robot.joint_names)
        return dict(zip(named, arrays, strict=True))


def _errors(given: dict[str, Any]) -> Errors:
    """How far motion is from its target, and the forces, from outside and of a task."""
    place = given["q"] - given["target"] if "target" in given else None
    rate = given["qd"] - given["target.qd"] if "target.qd" in given else given["qd"]
    forces = [given[name] for name in ("external", "task") if name in given]
    return Errors(place, rate, given.get("target.qdd"), sum(forces) if forces else None)


def _width(given: Any, passive: bool) -> float | None:
    """A width of friction; raises ValueError for one that is no velocity, or without friction."""
    if given is None:
        return None
    if isinstance(given, bool) or not isinstance(given, int | float) or not 0.0 < given < np.inf:
        raise ValueError(
            f"friction_width is {short(given)}; give a velocity above 0, in rad/s or m/s, within which "
            "friction is smooth, or None to compensate none"
        )
    if not passive:
        raise ValueError(
            "friction_width is given, and passive=False takes friction for not being there; leave one away"
        )
    return float(given)
