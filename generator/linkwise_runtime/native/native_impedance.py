"""Controllers of one sample in C, where nothing of them is learned."""

import ctypes
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..control.controls import ControlAnswers
from ..control.frame_impedance import FrameTargets
from ..control.joint_impedance import JointTargets
from ..controllers import Target
from ..kinematics.named_frames import frame_index
from .native_calls import NativeCalls
from .native_desk import Desk, new_desk
from .native_library import IMPEDANCE, NumberArray, address, symbol

JOINTS = ("target", "target.qd", "target.qdd", "task", "external")
"""What a call of joints may be given beside q and qd, in the order of C; a frame is given no task."""


def joint_struct(real: Any) -> type[ctypes.Structure]:
    """NAME_impedance, of double or float; C has the last where joints have anything of their own."""
    pointers = ("keep_inertia", "inertia", "keep_velocity", "damping", "stiffness")
    fields: list[tuple[str, Any]] = [(name, ctypes.c_void_p) for name in pointers]
    fields += [("regular", ctypes.c_int), ("friction_width", real)]
    return type("JointStruct", (ctypes.Structure,), {"_fields_": fields})


def frame_struct(real: Any) -> type[ctypes.Structure]:
    """NAME_frame_impedance, of double or float."""
    pointer = ctypes.c_void_p
    fields = [("frame", ctypes.c_int), ("point", pointer), ("rows", ctypes.c_int), ("row", pointer)]
    fields += [("keep_inertia", real), ("keep_velocity", real)]
    fields += [("inertia", pointer), ("damping", pointer), ("stiffness", pointer)]
    return type("FrameStruct", (ctypes.Structure,), {"_fields_": fields})


class Settings(NamedTuple):
    """What C is told of a controller in one number type."""

    joints: ctypes.Structure
    frame: ctypes.Structure | None
    kept: list[NumberArray]
    """The memory that they point to."""


class NativeControlAnswers(ControlAnswers):
    """The calls of one controller: C has the torque of one sample in arrays."""

    def __init__(
        self, calls: NativeCalls, robot: Any, targets: JointTargets, frame: FrameTargets | None
    ) -> None:
        super().__init__(robot, targets, frame)
        self._calls = calls
        self._settings: dict[Any, Settings] = {}
        self._free: dict[Any, list[Desk]] = {}
        gains = [targets.inertia.added, targets.damping.added, targets.stiffness]
        if frame is not None:
            gains += [frame.inertia.added, frame.damping.added, frame.stiffness]
        compensated = targets.passive or not robot.structure.passive
        kept = (targets.inertia.kept, targets.damping.kept)
        fixed = all(isinstance(w, float | np.ndarray) for w in kept)
        fixed = fixed and not any(gain is not None and gain.learned for gain in gains)
        self._known = fixed and compensated and robot.backend.tree is not None

    def _at_once(self, given: dict[str, Any], target: Target) -> Any:
        q = given["q"]
        if not self._known or self._calls.learned or type(q) is not np.ndarray or q.ndim > 1:
            return None
        beside = [(name, given.get(name)) for name in JOINTS]
        if self._frame is not None:
            asked = self._of_frame(target)
            if asked is None:
                return None
            beside[3:4] = asked
        names = tuple(name for name, a in beside if a is not None)
        key = q.dtype, names
        free = self._free.setdefault(key, [])
        try:
            desk = free.pop()  # no other thread finds it meanwhile
        except IndexError:
            desk = self._desk(q.dtype, [(name, None if a is None else np.size(a)) for name, a in beside])
        arrays = [q, given["qd"], *(a for _, a in beside if a is not None)]
        desk.motion[:] = b"".join(a.astype(q.dtype, copy=False).tobytes() for a in arrays)
        failed, torque = desk.compute(), desk.results[0].copy()
        free.append(desk)
        return None if failed else torque  # arrays say what is wrong

    def _of_frame(self, target: Target) -> list[tuple[str, Any]] | None:
        """Arrays of a frame's target that are plainly those of one sample; None for others."""
        assert self._frame is not None
        pose = target.pose if self._frame.stiffness is not None else None
        found = []
        for name, a, shape in (
            ("pose", pose, (4, 4)),
            ("velocity", target.velocity, (6,)),
            ("acceleration", target.acceleration, (6,)),
        ):
            if a is not None and (type(a) is not np.ndarray or a.shape != shape or a.dtype.kind != "f"):
                return None
            found.append((name, a))
        return None if self._frame.stiffness is not None and pose is None else found

    def _desk(self, kind: "np.dtype[Any]", beside: Sequence[tuple[str, int | None]]) -> Desk:
        """Memory for a call that is given some of the arrays, each of so many numbers."""
        n, settings = self._robot.n, self._set(kind)
        sizes = [n, n, *(size for _, size in beside if size is not None)]
        memory = np.empty(sum(sizes), kind)
        parts = iter(np.split(memory, np.cumsum(sizes)[:-1]))
        q, qd = next(parts), next(parts)
        told = [None if size is None else next(parts) for _, size in beside]
        given = [q, qd, self._calls.constants(kind), ctypes.byref(settings.joints), *told[:3]]
        if settings.frame is not None:
            given.append(ctypes.byref(settings.frame))
        found = symbol(self._calls.sources, IMPEDANCE[settings.frame is not None], kind.str[1:])
        found.restype = ctypes.c_int
        return new_desk(found, [*given, *told[3:]], memory, [np.empty(n, kind)])

    def _set(self, kind: "np.dtype[Any]") -> Settings:
        """What C is told, made once for each number type."""
        if kind not in self._settings:
            self._settings[kind] = self._made(kind)
        return self._settings[kind]

    def _made(self, kind: "np.dtype[Any]") -> Settings:
        targets, n, links = self._joints.targets, self._robot.n, self._robot.N
        memory: list[NumberArray] = []

        def at(numbers: Any) -> int | None:
            """Where numbers stand; None for none of them."""
            if numbers is None:
                return None
            memory.append(np.array(numbers, kind))
            return address(memory[-1])

        def weights(kept: Any) -> Any:
            return None if isinstance(kept, float) and kept == 1.0 else np.broadcast_to(kept, (n, links, n))

        inertia = None if targets.inertia.added is None else targets.inertia.added.numbers
        if inertia is not None and targets.inertia.whole:  # C adds the armature to what links have
            inertia = inertia - np.diag(self._robot.structure.passive_sums.armature)
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
        number = frame_index(frame.frame, self._robot.kinematics.frames)
        made = frame_struct(real)(
            number,
            at(frame.point),
            len(rows),
            address(rows),
            frame.inertia.kept,
            frame.damping.kept,
            *added,
        )
        return Settings(joints, made, memory)
