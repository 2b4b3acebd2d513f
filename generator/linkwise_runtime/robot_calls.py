"""Answering of calls: motion is read, a back end computes, and the row of the table says how.

`Dynamics` lists the calls; each of them passes its arguments to `_call`, with the key of its row.
"""

from collections.abc import Callable, Sequence
from types import MethodType
from typing import Any

from .arrays.backend import ArrayBackend
from .call_table import CALLS
from .door import Door
from .interface import Numbers, Unscripted
from .out_argument import accepted
from .structure import JointLimits, Layout, Structure


class RobotCalls(Unscripted):
    """A robot on one back end, whose calls are rows of `call_table.CALLS`."""

    name: str
    """Name of the package."""
    n: int
    """Number of joints."""
    N: int
    """Number of links."""
    joint_names: tuple[str, ...]
    """Names of the joints, in the order of i and k."""
    joint_units: tuple[str, ...]
    """Unit of each joint's position: rad or m."""
    joint_limits: JointLimits
    """Lower, upper, velocity and effort limit of each joint, as in its file; no call enforces them."""
    link_names: tuple[str, ...]
    """Names of the links, in the order of j."""
    layout: Layout
    """Indices of the packed values."""
    structure: Structure
    """Names, paths and parameters, as in the package's names.py."""
    backend: ArrayBackend
    """Back end that computes; `threads` may be set on the native one."""
    door: Door[ArrayBackend]
    """Entry at which the motion of every call is read."""

    def __init__(
        self,
        structure: Structure,
        backend: ArrayBackend,
        load: Callable[..., "RobotCalls"],
        asked: tuple[Any, ...],
        check_finite: bool = False,
    ) -> None:
        """Set up the robot; `load` makes it again from the arguments that it was `asked` with."""
        self.name, self.n, self.N = structure.name, structure.n, structure.N
        self.joint_names, self.joint_units = structure.joint_names, structure.joint_units
        self.joint_limits = structure.joint_limits
        self.link_names, self.layout = structure.link_names, structure.layout
        self.structure, self.backend = structure, backend
        self._load, self._asked = load, asked
        self.door = Door(structure, backend, check_finite)
        self._bind()

    def _bind(self) -> None:
        """Bind calls directly to functions of the back end, which pass on what they do not accept.

        They precede the methods of the class, and do not check whether numbers are finite.
        """
        for name, call in self.backend.direct.items():
            if self.door.check_finite:
                vars(self).pop(name, None)
            else:
                vars(self)[name] = MethodType(call, self)

    @property
    def check_finite(self) -> bool:
        """True if every call first looks for NaN and infinity in the motion; it may be set."""
        return self.door.check_finite

    @check_finite.setter
    def check_finite(self, wanted: bool) -> None:
        self.door.check_finite = bool(wanted)
        self._bind()

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what loads this robot again in a copy or another process, and the settings made here."""
        return self._load, self._asked, (self.backend.threads_set, self.check_finite)

    def __setstate__(self, state: tuple[int | None, bool]) -> None:
        """Restore the settings of the robot of which this one is a copy."""
        threads, self.check_finite = state
        if threads is not None:
            self.backend.threads_set = threads

    def _call(self, key: str, given: tuple[object, ...], out: object) -> Any:
        """Return the answer to motion as it was given, by the row of the table with this key."""
        row = CALLS[key]
        if out is None:  # written out, as a call of its own would cost native's quickest answers 7 %
            at_once = self.backend.at_once
            if at_once is not None and not self.door.check_finite:
                values = at_once(key, given)
                if values is not None:
                    return row.record(*values) if row.record else values[0]
            backend, motion = self.door.read(dict(zip(row.motion, given)))  # noqa: B905 - rows are as long
            if row.rigid:
                backend.answers.check_regresses()
            values = getattr(backend.answers, key)(*motion)
            return row.record(*values) if row.record else values[0]
        backend, motion = self.door.read(dict(zip(row.motion, given, strict=True)))
        return self._answer(key, backend, motion, out)

    def _answer(
        self,
        key: str,
        backend: ArrayBackend,
        motion: Sequence[Numbers],
        out: object,
        beside: Sequence[Numbers] = (),
    ) -> Any:
        """Return the answer to motion that has been read, and to what the row is given beside it."""
        row, answers = CALLS[key], backend.answers
        if row.rigid:
            answers.check_regresses()
        if out is None:
            values = getattr(answers, key)(*motion, *beside)
            return row.record(*values) if row.record else values[0]
        fields: Sequence[str] = getattr(row.record, "_fields", ())
        named = dict(zip(row.motion, motion, strict=True))
        read = backend.read_beside_motion()
        into = accepted(out, fields, answers.shapes[key], named, [*read, *beside], answers.contiguous)
        answers.compute_into(key, [*motion, *beside], into)
        return row.record(*into) if row.record else out
