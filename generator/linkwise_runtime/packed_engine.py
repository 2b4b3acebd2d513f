"""What a back end computes with one library: packed values, and what answers are made of."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, Protocol

from .interface import Namespace, Numbers
from .structure import Structure


class OneSample(Protocol):
    """Functions of one sample that a back end has beside those of many."""

    def answer(
        self, call: str, motion: Sequence[Numbers], frame: int | None = None, point: Numbers | None = None
    ) -> Numbers | None:
        """The answer to a motion (..., n), of a frame and a point (..., 3) of it where there are such.

        None for what is not one sample, and for what the function does not answer.
        """


class TorqueOfOne(Protocol):
    """A controller's torque of one sample that a back end has beside that of many."""

    def torque(self, given: Mapping[str, Numbers]) -> Numbers | None:
        """The torque (n,) for motion and targets by name; None for what the function does not answer."""


class PackedEngine:
    """Base of back ends: packed values (..., count) in the order of `Layout`, of motion (..., n)."""

    name: ClassVar[str]
    """As `load` has it."""
    xp: ClassVar[Namespace]
    structure: Structure
    """Names, paths and parameters."""
    examples: Sequence[Numbers] = ()
    """Empty ones of kinds that tables are made for in advance: no compiler traces how they are made."""

    @property
    def samples(self) -> tuple[int, ...]:
        """Shape of the samples that have a parameter or a body each; () where they are the same for all."""
        raise NotImplementedError

    regresses: bool
    """Whether it has regressors, which come from the rule of rigid links."""
    one_sample: OneSample | None = None
    """Functions of one sample; None without any."""

    @property
    def fuses(self) -> bool:
        """Whether a compiler makes one loop of many operations, to which a matrix product is a wall."""
        raise NotImplementedError

    def decomposition(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """c2, c1, g, tau, h1."""
        raise NotImplementedError

    def torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """tau, in the order of `Layout.torque`."""
        raise NotImplementedError

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """c0, in the order of `Layout.velocity`."""
        raise NotImplementedError

    def energies(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Kinetic and potential energies of the links in J, (..., N) each."""
        raise NotImplementedError

    def regressor(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Rows of 10 of tau, flat: (..., 10 count)."""
        raise NotImplementedError

    def coefficient_regressors(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Rows of 10 of c2, c1, g, flat: (..., 10 count) each."""
        raise NotImplementedError

    def read_beside_motion(self) -> Iterable[object]:
        """Arrays or tensors that results hang on, beside the motion."""
        raise NotImplementedError

    def constant(self, values: Any, like: Numbers) -> Numbers:
        """A table of numbers, to compute with `like`."""
        raise NotImplementedError

    def index(self, values: Any, like: Numbers) -> Numbers:
        """A table of positions, to take from `like`."""
        raise NotImplementedError

    def weights(self, name: str, value: object, like: Numbers) -> Numbers:
        """Real numbers in anything array-like, of the kind and dtype of `like`; errors name the argument."""
        raise NotImplementedError

    def zeros(self, like: Numbers, count: int) -> Numbers:
        """Zeros of shape (..., count) for `like` of shape (..., m)."""
        raise NotImplementedError

    def concatenate(self, parts: Iterable[Numbers]) -> Numbers:
        """The parts joined along the last axis."""
        raise NotImplementedError

    def few(self, samples: int, links: int) -> bool:
        """Whether spatial matrices are quicker for so many samples of a robot of so many links."""
        raise NotImplementedError

    def chunk(self, motion: Sequence[Numbers], most: int) -> int | None:
        """Samples to compute at once, of which so many stay in the cache; None for all."""
        raise NotImplementedError
