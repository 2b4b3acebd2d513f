"""Controllers behind their face: targets are read, motion is checked, torques are computed."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..arguments import check_numbers
from ..controllers import FrameImpedance, Target
from ..dense import Dense
from ..quantities import NaturalImpedance
from .cancelled_motions import ORDERS, cancelled_motions
from .frame_impedance import FrameTargets
from .joint_impedance import Errors, JointImpedance, JointTargets, dissipates, times
from .wanted_coefficients import Wanted, stiffness_of, wanted


class Controls:
    """What makes controllers of a robot on any back end; arguments as `ControllerCalls` says."""

    def __init__(self, robot: Any) -> None:
        self._robot = robot

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
        self, inertia: Any, damping: Any, stiffness: Any, frame: FrameImpedance | None, passive: bool
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
        )
        return ControlAnswers(
            self._robot, targets, None if frame is None else FrameTargets(self._robot, frame)
        )

    def cancellation(
        self, entries: Iterable[Any], passive: bool
    ) -> tuple["ControlAnswers", tuple[tuple[str, str, str, int], ...]]:
        """See `ControllerCalls.cancel`."""
        self._check_free()
        structure = self._robot.structure
        chosen = cancelled_motions(entries, structure)
        kept = {order: np.ones((structure.n, structure.N, structure.n)) for order in ORDERS}
        for i, j, k, order in chosen:
            kept[order][i, j, k] = 0.0
        acceleration, velocity = (Wanted(kept[m], None, None, False, False) for m in (2, 1))
        targets = JointTargets(acceleration, velocity, None, False, bool(passive))
        names = structure.joint_names, structure.link_names
        named = tuple((names[0][i], names[1][j], names[0][k], m) for i, j, k, m in chosen)
        return ControlAnswers(self._robot, targets, None), named

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
        targets = self._joints.targets
        return (
            dissipates(targets.inertia, targets.damping) if self._frame is None else self._frame.dissipative
        )

    def torque(self, q: Any, qd: Any, target: Any, external: Any) -> Any:
        """See `PartialImpedance.__call__`."""
        return self._followed(q, qd, target, external)[1]

    def acceleration(self, q: Any, qd: Any, target: Any, external: Any) -> Any:
        """See `PartialImpedance.acceleration`."""
        return self._followed(q, qd, target, external)[0]

    def stored_energy(self, q: Any, qd: Any, target: Any) -> Any:
        """See `PartialImpedance.stored_energy`."""
        target = self._read(target)
        q, qd, errors, _ = self._errors(q, qd, target, None)
        state = self._joints.state(q, qd)
        if self._frame is None:
            return self._joints.stored(state, errors, q)
        return self._frame.stored(self._frame.state(state, q, qd, target))

    def cancelling(self, q: Any, qd: Any, tau: Any, external: Any, qdd: Any) -> Any:
        """See `Cancellation.__call__`: tau + M_S qdd + C_S qd + g + p."""
        q, qd, tau, force, given = self._moved(q, qd, tau, external, qdd)
        state = self._joints.state(q, qd)
        if given is None:
            given = self._joints.acceleration(state, Errors(None, qd, None, force), q)
        cancelled = times(state.inertia - state.wanted_inertia, given)
        cancelled = cancelled + times(state.coriolis - state.wanted_damping, qd) + state.rest
        return cancelled if tau is None else cancelled + tau

    def cancelled_acceleration(self, q: Any, qd: Any, tau: Any, external: Any) -> Any:
        """See `Cancellation.acceleration`."""
        q, qd, _, force, _ = self._moved(q, qd, tau, external, None)
        return self._joints.acceleration(self._joints.state(q, qd), Errors(None, qd, None, force), q)

    def _followed(self, q: Any, qd: Any, target: Any, external: Any) -> tuple[Any, Any]:
        """Acceleration that follows, and torque for it."""
        target = self._read(target)
        q, qd, errors, external = self._errors(q, qd, target, external)
        state = self._joints.state(q, qd)
        qdd = self._joints.acceleration(state, errors, q)
        if self._frame is not None:
            qdd = self._frame.acceleration(self._frame.state(state, q, qd, target), qdd, external)
        return qdd, self._joints.torque(state, qd, qdd, external)

    def _errors(self, q: Any, qd: Any, target: Target, external: Any) -> tuple[Any, Any, Errors, Any]:
        """Motion of one shape, how far it is from the target, and the force from outside."""
        if target.q is None and self._joints.targets.stiffness is not None:
            raise ValueError("the joints are stiff, but target has no q; give positions, (..., n)")
        beside = {"target": target.q, "target.qd": target.qd, "target.qdd": target.qdd, "external": external}
        q, qd, values = self._arrays({"q": q, "qd": qd}, beside)
        place = None if target.q is None else q - values["target"]
        rate = qd - values["target.qd"] if "target.qd" in values else qd
        force = values.get("external")
        return q, qd, Errors(place, rate, values.get("target.qdd"), force), force

    def _moved(self, q: Any, qd: Any, tau: Any, external: Any, qdd: Any) -> tuple[Any, ...]:
        """Motion of one shape, tau, the sum of the forces, and qdd; None for what was not given."""
        q, qd, values = self._arrays({"q": q, "qd": qd}, {"tau": tau, "external": external, "qdd": qdd})
        tau, external = values.get("tau"), values.get("external")
        force = external if tau is None else tau if external is None else tau + external
        return q, qd, tau, force, values.get("qdd")

    def _arrays(self, motion: dict[str, Any], beside: dict[str, Any]) -> tuple[Any, Any, dict[str, Any]]:
        named = motion | {name: a for name, a in beside.items() if a is not None}
        arrays = self._robot.backend.arrays(named, self._robot.n)
        if self._robot.check_finite:
            check_numbers(named, self._robot.joint_names)
        values = dict(zip(named, arrays, strict=True))
        return values.pop("q"), values.pop("qd"), values

    @staticmethod
    def _read(target: Any) -> Target:
        """A Target as it is, positions as one, whose package it may be."""
        if target is None or not hasattr(target, "_fields"):
            return Target(q=target)
        return Target(*target)
