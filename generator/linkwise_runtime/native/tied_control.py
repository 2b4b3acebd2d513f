"""Torques of controllers of joints that loops, couplings and contacts tie, by C for one sample."""

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..control.frame_impedance import FrameTargets
from ..control.joint_impedance import JointTargets
from ..interface import Numbers
from .calls import NativeCalls
from .control import NativeTorque
from .library import OneSampleCall, one_sample_call, symbol
from .memory import NumberArray, NumberType, address

OF_FRAME = "constrained_frame_partial_impedance"


@dataclass(frozen=True)
class TiedStance:
    """Ties and drives of a controller's joints, as C is told of them."""

    constraints: Callable[[NumberType], ctypes.Structure]
    """Function that returns the struct NAME_constraints of a number type, which stays where it is."""
    rows: int
    """Number of rows of the constraints."""
    joints: Sequence[int]
    """Indices of the driven joints, ascending."""
    weight: NDArray[np.float64]
    """Weight of the square of each one's torque."""
    undriven: int
    """Number of motions in which no driven joint takes part."""


class ActuatorsStruct(ctypes.Structure):
    """The struct NAME_actuators."""

    _fields_ = (
        ("driven", ctypes.c_int),
        ("joint", ctypes.c_void_p),
        ("weight", ctypes.c_void_p),
        ("undriven", ctypes.c_int),
    )


class TiedTorque(NativeTorque):
    """The torque of one controller of tied joints, and what follows from it."""

    def __init__(
        self, calls: NativeCalls, targets: JointTargets, frame: FrameTargets | None, stance: TiedStance
    ) -> None:
        super().__init__(calls, True, targets, frame)
        self._stance = stance

    def forces(self, given: Mapping[str, Numbers]) -> NumberArray | None:
        """Return the forces of ties and contacts (C,); None where C has no answer."""
        return self._answer("forces", given)

    def _one_sample(self, key: tuple[str, NumberType, tuple[str, ...]]) -> OneSampleCall:
        """Return a call for "tau", "qdd", "forces" or "cancel", given these arrays besides q and qd."""
        asked, kind, names = key
        stance, settings = self._stance, self._set(kind)
        joints, weight = np.array(stance.joints, np.intc), np.array(stance.weight, kind)
        settings.kept.extend((joints, weight))
        actuators = ActuatorsStruct(len(joints), address(joints), address(weight), stance.undriven)
        memory, placed = self._memory(kind, names)
        told = map(ctypes.byref, (stance.constraints(kind), actuators, settings.joints))
        answer = np.empty(stance.rows if asked == "forces" else self._structure.n, kind)
        motion = [placed["q"], placed["qd"], *([placed["qdd"]] if asked == "cancel" else [])]
        given: list[object] = [*motion, self._calls.constants(kind), *told]
        if asked == "cancel":
            found = symbol(self._calls.sources, "constrained_cancel", kind.str[1:])
            return one_sample_call(found, True, [*given, placed.get("task")], memory, [answer])
        beside: list[object] = [placed.get(name) for name in self._beside]
        if settings.frame is not None:
            beside.insert(3, ctypes.byref(settings.frame))
        call = "constrained_partial_impedance" if settings.frame is None else OF_FRAME
        found = symbol(self._calls.sources, call, kind.str[1:])
        given += beside
        results = [answer if asked == one else None for one in ("tau", "qdd", "forces")]
        return one_sample_call(found, True, given, memory, results)
