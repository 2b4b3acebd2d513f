"""C functions of one sample: frames, the mass matrix, forward dynamics and the torques of controllers."""

import ctypes
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..control.frame_impedance import OF_FRAME, FrameTargets
from ..control.joint_impedance import JointTargets
from ..interface import Numbers
from .calls import NativeCalls
from .library import CONTROL, IMPEDANCE, OneSampleCall, OneSamplePool, one_sample_call, symbol
from .memory import NumberArray, NumberType, address

RealType = type[ctypes.c_double] | type[ctypes.c_float]
FieldType = RealType | type[ctypes.c_void_p] | type[ctypes.c_int]

JOINTS = ("target", "target.qd", "target.qdd", "task", "external")
"""Arguments of joint control besides q and qd, in the order of C; control of a frame has no task."""
ON_FRAME = {f"target.{name}": math.prod(axes) for name, (axes, _) in OF_FRAME.items()}
"""Targets that stand in place of the task where a frame is controlled, and how many numbers each has."""


def joint_struct(real: RealType) -> type[ctypes.Structure]:
    """Return the struct NAME_impedance of double or float.

    Its last field is there in C only where joints have springs, damping, friction or armature.
    """
    pointers = ("keep_inertia", "inertia", "keep_velocity", "damping", "stiffness")
    fields: list[tuple[str, FieldType]] = [(name, ctypes.c_void_p) for name in pointers]
    fields += [("regular", ctypes.c_int), ("friction_width", real)]
    return type("JointStruct", (ctypes.Structure,), {"_fields_": fields})


def frame_struct(real: RealType) -> type[ctypes.Structure]:
    """Return the struct NAME_frame_impedance of double or float."""
    pointer = ctypes.c_void_p
    fields: list[tuple[str, FieldType]] = [
        ("frame", ctypes.c_int),
        ("point", pointer),
        ("rows", ctypes.c_int),
        ("row", pointer),
        ("keep_inertia", real),
        ("keep_velocity", real),
        ("inertia", pointer),
        ("damping", pointer),
        ("stiffness", pointer),
    ]
    return type("FrameStruct", (ctypes.Structure,), {"_fields_": fields})


class Settings(NamedTuple):
    """A controller's settings, passed to C in one number type."""

    joints: ctypes.Structure
    frame: ctypes.Structure | None
    kept: list[NDArray[np.generic]]
    """Arrays whose memory the structs point to."""


class ControlCalls:
    """C functions that take one sample, each with memory of its own."""

    def __init__(self, calls: NativeCalls) -> None:
        self._calls = calls
        self._of_one = OneSamplePool(self._one_sample)

    def answer(
        self, call: str, motion: Sequence[Numbers], frame: int | None = None, point: Numbers | None = None
    ) -> NumberArray | None:
        """Return the answer for a motion (..., n), and for a frame and a point (..., 3) of it where given.

        Returns None for anything but one sample in arrays, for learned parameters, for a singular mass
        matrix, and for calls that C does not have.
        """
        q = motion[0]
        if call not in CONTROL:
            return None
        if self._calls.learned or type(q) is not np.ndarray or q.size != q.shape[-1]:
            return None
        given = cast("Sequence[NumberArray]", motion if point is None else (point, *motion))
        numbers = b"".join(a.tobytes() for a in given)
        found = self._of_one.results((call, frame, point is None, q.dtype), numbers)
        return found[0].reshape(*q.shape[:-1], *found[0].shape) if found else None

    def _one_sample(self, key: tuple[str, int | None, bool, NumberType]) -> OneSampleCall:
        """Return a call, in whose memory a point stands before the motion."""
        call, frame, at_origin, kind = key
        about, n = CONTROL[call], self._calls.structure.n
        (shape,) = self._calls.shapes[call if frame is None else f"kinematics.{call}"]
        memory = np.empty((0 if at_origin else 3) + about.motion * n, kind)
        motion = memory[memory.size - about.motion * n :].reshape(-1, n)
        told: list[object] = [] if frame is None else [ctypes.c_int(frame)]
        if about.point:
            told.append(None if at_origin else memory[:3])
        found = symbol(self._calls.sources, call, kind.str[1:])
        given, result = (*told, *motion, self._calls.constants(kind)), np.empty(shape, kind)
        return one_sample_call(found, call.startswith("forward_dynamics"), given, memory, [result])


class NativeTorque:
    """The torque of one controller, computed by C for one sample in arrays."""

    def __init__(
        self, calls: NativeCalls, is_rigid: bool, targets: JointTargets, frame: FrameTargets | None
    ) -> None:
        self._calls, self._structure = calls, calls.structure
        self._targets, self._frame = targets, frame
        self._beside = JOINTS if frame is None else (*JOINTS[:3], *ON_FRAME, *JOINTS[4:])
        self._aims = frame is not None and frame.stiffness is not None
        self._settings: dict[NumberType, Settings] = {}
        self._of_one = OneSamplePool(self._one_sample)
        gains = [targets.inertia.added, targets.damping.added, targets.stiffness]
        if frame is not None:
            gains += [frame.inertia.added, frame.damping.added, frame.stiffness]
        compensated = targets.passive or not self._structure.passive
        kept = (targets.inertia.kept, targets.damping.kept)
        fixed = all(isinstance(w, float | np.ndarray) for w in kept)
        fixed = fixed and not any(gain is not None and gain.learned for gain in gains)
        self._known = fixed and compensated and is_rigid

    def torque(self, given: Mapping[str, Numbers]) -> NumberArray | None:
        """Return the torque (n,); None where C has no answer: the calls for arrays then say what is wrong.

        With an acceleration qdd among the arguments it is what is cancelled there.
        """
        return self._answer("cancel" if "qdd" in given else "tau", given)

    def acceleration(self, given: Mapping[str, Numbers]) -> NumberArray | None:
        """Return the acceleration (n,) that follows, likewise."""
        return self._answer("qdd", given)

    def forces(self, given: Mapping[str, Numbers]) -> NumberArray | None:
        """Return the forces of ties (C,) that follow, likewise; joints that nothing ties have none."""
        return None

    def _answer(self, asked: str, given: Mapping[str, Numbers]) -> NumberArray | None:
        q = given["q"]
        if not self._known or self._calls.learned or type(q) is not np.ndarray or q.ndim > 1:
            return None
        of_one = cast("Mapping[str, NumberArray]", given)
        if self._aims and "target.pose" not in given:
            return None
        names = tuple(name for name in ("qdd", *self._beside) if name in of_one)
        numbers = b"".join(of_one[name].tobytes() for name in ("q", "qd", *names))
        found = self._of_one.results((asked, q.dtype, names), numbers)
        return found[0] if found else None

    def _memory(self, kind: NumberType, names: Sequence[str]) -> tuple[NumberArray, dict[str, NumberArray]]:
        """Return memory for q, qd and arrays of these names, one after another, and the arrays in it."""
        n, every = self._structure.n, ("q", "qd", *names)
        sizes = [ON_FRAME.get(name, n) for name in every]
        memory = np.empty(sum(sizes), kind)
        return memory, dict(zip(every, np.split(memory, np.cumsum(sizes)[:-1]), strict=True))

    def _one_sample(self, key: tuple[str, NumberType, tuple[str, ...]]) -> OneSampleCall:
        """Return a call for "tau", "qdd" or "cancel" that is given these arrays besides q and qd."""
        asked, kind, names = key
        n, settings = self._structure.n, self._set(kind)
        memory, placed = self._memory(kind, names)
        q, qd, told = placed["q"], placed["qd"], [placed.get(name) for name in self._beside]
        constants, wanted, answer = (
            self._calls.constants(kind),
            ctypes.byref(settings.joints),
            np.empty(n, kind),
        )
        if asked == "cancel":
            found = symbol(self._calls.sources, asked, kind.str[1:])
            given: list[object] = [q, qd, placed["qdd"], constants, wanted, placed.get("task")]
            return one_sample_call(found, True, given, memory, [answer])
        given = [q, qd, constants, wanted, *told[:3]]
        if settings.frame is not None:
            given.append(ctypes.byref(settings.frame))
        found = symbol(self._calls.sources, IMPEDANCE[settings.frame is not None], kind.str[1:])
        results = [answer, None] if asked == "tau" else [None, answer]
        return one_sample_call(found, True, [*given, *told[3:]], memory, results)

    def _set(self, kind: NumberType) -> Settings:
        """Return the settings for a number type, made once."""
        if kind not in self._settings:
            self._settings[kind] = self._made(kind)
        return self._settings[kind]

    def _made(self, kind: NumberType) -> Settings:
        targets, n, links = self._targets, self._structure.n, self._structure.N
        memory: list[NDArray[np.generic]] = []

        def at(numbers: ArrayLike | None) -> int | None:
            """Return the address of a copy of the numbers; None where there are none."""
            if numbers is None:
                return None
            array = np.array(numbers, kind)
            memory.append(array)
            return address(array)

        def weights(kept: object) -> NumberArray | None:
            """Return w (n, N, n), or None for the number 1.

            Tensors, which are learned, do not get here.
            """
            if isinstance(kept, float) and kept == 1.0:
                return None
            return np.broadcast_to(cast(NumberArray, kept), (n, links, n))

        inertia = None if targets.inertia.added is None else targets.inertia.added.numbers
        if inertia is not None and targets.inertia.whole:  # C adds the armature to the inertia of the links
            inertia = inertia - np.diag(self._structure.passive_sums.armature)
        real = ctypes.c_double if kind.itemsize == 8 else ctypes.c_float
        joints = joint_struct(real)(
            at(weights(targets.inertia.kept)),
            at(inertia),
            at(weights(targets.damping.kept)),
            at(None if targets.damping.added is None else targets.damping.added.numbers),
            at(None if targets.stiffness is None else targets.stiffness.numbers),
            not targets.positive,
            targets.friction_width or 0.0,
        )
        if self._frame is None:
            return Settings(joints, None, memory)
        frame, rows = self._frame, np.array(self._frame.rows, np.intc)
        memory.append(rows)
        added = (
            at(None if gain is None else gain.numbers)
            for gain in (frame.inertia.added, frame.damping.added, frame.stiffness)
        )
        made = frame_struct(real)(
            frame.number,
            at(frame.point),
            len(rows),
            address(rows),
            frame.inertia.kept,
            frame.damping.kept,
            *added,
        )
        return Settings(joints, made, memory)
