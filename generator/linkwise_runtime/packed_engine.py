"""Base of back ends: packed values computed with one library, and the operations that answers need."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, Protocol

from .interface import Namespace, Numbers
from .structure import Structure


class OneSample(Protocol):
    """Functions of a back end for one sample, beside those for many."""

    def answer(
        self, call: str, motion: Sequence[Numbers], frame: int | None = None, point: Numbers | None = None
    ) -> Numbers | None:
        """Return the answer to a motion (..., n), for a frame and a point (..., 3) of it if given.

        It is None for anything but one sample, and for calls that the function does not answer.
        """


class TorqueOfOne(Protocol):
    """A controller's torque for one sample, which a back end has beside that for many."""

    def torque(self, given: Mapping[str, Numbers]) -> Numbers | None:
        """Return the torque (n,) for motion and targets by name; None where the function has no answer."""


class PackedEngine:
    """Base of back ends: packed values (..., count) in the order of `Layout`, for motion (..., n)."""

    name: ClassVar[str]
    """Name of the back end, as `load` accepts it."""
    xp: ClassVar[Namespace]
    structure: Structure
    """Names, paths and parameters."""
    examples: Sequence[Numbers] = ()
    """Empty arrays of kinds for which tables are made in advance, so that no compiler traces how they are
    made."""

    @property
    def samples(self) -> tuple[int, ...]:
        """Shape of the samples that have a parameter or a body each; () where all samples share them."""
        raise NotImplementedError

    regresses: bool
    """True if the back end has regressors, which come from the rule of rigid links."""
    one_sample: OneSample | None = None
    """Functions for one sample; None without any."""

    @property
    def fuses(self) -> bool:
        """True if a compiler makes one loop of many operations, which a matrix product would split."""
        raise NotImplementedError

    def decomposition(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2, c1, g, tau and h1, (..., count) each."""
        raise NotImplementedError

    def torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return tau (..., count), in the order of `Layout.torque`."""
        raise NotImplementedError

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return c0 (..., count), in the order of `Layout.velocity`."""
        raise NotImplementedError

    def energies(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return the kinetic and potential energies of the links in J, (..., N) each."""
        raise NotImplementedError

    def regressor(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return the rows of 10 of tau, flat: (..., 10 count)."""
        raise NotImplementedError

    def coefficient_regressors(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return the rows of 10 of c2, c1 and g, flat: (..., 10 count) each."""
        raise NotImplementedError

    def read_beside_motion(self) -> Iterable[object]:
        """Return the arrays or tensors, beside the motion, that results depend on."""
        raise NotImplementedError

    def constant(self, values: Any, like: Numbers) -> Numbers:
        """Return a table of numbers, to compute with `like`."""
        raise NotImplementedError

    def index(self, values: Any, like: Numbers) -> Numbers:
        """Return a table of positions, to index `like` with."""
        raise NotImplementedError

    def weights(self, name: str, value: object, like: Numbers) -> Numbers:
        """Return real numbers, from anything array-like, with the kind and dtype of `like`.

        Raises TypeError or ValueError, which names the argument.
        """
        raise NotImplementedError

    def zeros(self, like: Numbers, count: int) -> Numbers:
        """Return zeros of shape (..., count) for `like` of shape (..., m)."""
        raise NotImplementedError

    def concatenate(self, parts: Iterable[Numbers]) -> Numbers:
        """Return the parts joined along the last axis."""
        raise NotImplementedError

    def few(self, samples: int, links: int) -> bool:
        """Return whether spatial matrices are faster for so many samples of a robot of so many links."""
        raise NotImplementedError

    def chunk(self, motion: Sequence[Numbers], most: int) -> int | None:
        """Return the number of samples to compute at once, if `most` fit in the cache; None for all."""
        raise NotImplementedError
