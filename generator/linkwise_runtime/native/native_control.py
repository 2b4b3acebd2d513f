"""Answers of C to one sample: frames, the mass matrix and forward dynamics."""

import ctypes
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..interface import Backend
from ..kinematics.kinematic_answers import KinematicAnswers
from ..structure import Structure
from ..sums.summed import Compute, Summed
from .native_calls import NativeCalls
from .native_desk import Desk, new_desk
from .native_library import CONTROL, NumberArray, symbol


class ControlCalls:
    """C functions that take one sample, each on memory of its own."""

    def __init__(self, calls: NativeCalls) -> None:
        n = calls.structure.n
        self._calls = calls
        self._shapes = {
            "pose": (4, 4),
            "jacobian": (6, n),
            "jacobian_rate": (6, n),
            "mass_matrix": (n, n),
            "forward_dynamics": (n,),
            "forward_dynamics_of_links": (n,),
        }
        self._free: dict[Any, list[Desk]] = {}

    def answer(
        self, call: str, motion: Sequence[Any], frame: int | None = None, point: Any = None
    ) -> NumberArray | None:
        """The answer to a motion (..., n), of a frame and a point (..., 3) of it where there are such.

        None for what is not one sample in arrays, learned parameters, and a singular mass matrix.
        """
        q = motion[0]
        if self._calls.learned or type(q) is not np.ndarray or q.size != q.shape[-1]:
            return None
        key = call, frame, point is None, q.dtype
        free = self._free.setdefault(key, [])
        try:
            desk = free.pop()  # no other thread finds it meanwhile
        except IndexError:
            desk = self._desk(*key)
        given = motion if point is None else (point, *motion)
        desk.motion[:] = b"".join(a.tobytes() for a in given)
        failed, answer = desk.compute(), desk.results[0].copy()
        free.append(desk)
        return None if failed else answer.reshape(*q.shape[:-1], *answer.shape)

    def _desk(self, call: str, frame: int | None, origin: bool, kind: "np.dtype[Any]") -> Desk:
        """Memory for a call; a point stands in it before the motion."""
        about, n = CONTROL[call], self._calls.structure.n
        memory = np.empty((0 if origin else 3) + about.motion * n, kind)
        motion = memory[memory.size - about.motion * n :].reshape(-1, n)
        told: list[Any] = [] if frame is None else [ctypes.c_int(frame)]
        if about.point:
            told.append(None if origin else memory[:3])
        found = symbol(self._calls.sources, call, kind.str[1:])
        found.restype = ctypes.c_int if call.startswith("forward_dynamics") else None
        given = (*told, *motion, self._calls.constants(kind))
        return new_desk(found, given, memory, [np.empty(self._shapes[call], kind)])


class NativeSums(Summed):
    """The sums of a robot of rigid links: those that control needs, C computes for one sample."""

    def __init__(
        self, structure: Structure, backend: Backend[Any], compute: Compute, control: ControlCalls
    ) -> None:
        super().__init__(structure, backend, compute)
        tree = backend.tree
        self._control, self._tied = control, tree is not None and tree.tied

    def mass_matrix(self, q: Any) -> tuple[Any, ...]:
        """See `Summed.mass_matrix`."""
        found = self._control.answer("mass_matrix", (q,))
        return super().mass_matrix(q) if found is None else (found,)

    def forward_dynamics(self, q: Any, qd: Any, tau: Any) -> tuple[Any, ...]:
        """See `Summed.forward_dynamics`, which says what is wrong where C finds M singular."""
        found = self._accelerated("forward_dynamics", q, qd, tau)
        return super().forward_dynamics(q, qd, tau) if found is None else (found,)

    def forward_dynamics_of_links(self, q: Any, qd: Any, tau: Any) -> tuple[Any, ...]:
        """See `Summed.forward_dynamics_of_links`; C has it apart where joints have anything of their own."""
        call = "forward_dynamics_of_links" if self._structure.passive else "forward_dynamics"
        found = self._accelerated(call, q, qd, tau)
        return super().forward_dynamics_of_links(q, qd, tau) if found is None else (found,)

    def _accelerated(self, call: str, *motion: Any) -> NumberArray | None:
        """What C answers; None where it has no such function, as of joints that are tied."""
        return None if self._tied else self._control.answer(call, motion)


class NativeKinematics(KinematicAnswers):
    """The kinematics of frames: poses, Jacobians and their rates of one sample, C computes."""

    def __init__(
        self,
        structure: Structure,
        backend: Any,
        check_finite: bool,
        read_beside_motion: Callable[[], Iterable[Any]],
        control: ControlCalls,
    ) -> None:
        super().__init__(structure, backend, check_finite, read_beside_motion)
        self._control = control

    def _at_once(self, call: str, motion: Sequence[Any], part: Any, point: Any) -> Any:
        return self._control.answer(call, motion, part, point) if call in CONTROL else None
