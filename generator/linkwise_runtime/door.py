"""Entry of all calls: arguments are read in one library."""

from collections.abc import Mapping, Sequence
from typing import Generic, Protocol, TypeVar

from .arguments import NOTHING, Beside, check_numbers
from .interface import Numbers
from .structure import Structure

Read = TypeVar("Read", covariant=True)


class Reads(Protocol[Read]):
    """A back end that reads arguments, and so chooses the library that it then computes with."""

    def read(
        self, named: Mapping[str, object], n: int, beside: Mapping[str, Beside]
    ) -> tuple[Read, Sequence[Numbers]]:
        """Return the back end to compute with, the motion (..., n), and what is beside it, in its library."""


class Door(Generic[Read]):
    """Entry that every call of a robot passes through."""

    def __init__(self, structure: Structure, backend: Reads[Read], check_finite: bool) -> None:
        self._structure, self._backend, self.check_finite = structure, backend, check_finite

    def read(
        self,
        named: Mapping[str, object],
        joints: Sequence[str] | None = None,
        beside: Mapping[str, Beside] = NOTHING,
    ) -> tuple[Read, Sequence[Numbers]]:
        """Return the back end to compute with, the motion of these joints, and the arguments beside it.

        joints: names of the joints of the motion, all unless given

        All are broadcast to one shape of samples. Raises ValueError and TypeError, which name the argument,
        for what is not accepted.
        """
        names = self._structure.joint_names if joints is None else joints
        read = self._backend.read(named, len(names), beside)
        if self.check_finite:
            check_numbers(named, names, beside)
        return read
