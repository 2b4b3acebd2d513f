"""Interfaces between the parts of a package: arrays, libraries, closed forms.

With them, the library that numbers belong to, their precision, and how they lie in memory.
"""

# ruff: noqa: D102 - functions that NumPy and torch document

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import FunctionType
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    # Packages that need no torch are type-checked without it: tensors are then Any.
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]

Array = TypeVar("Array", NDArray[np.float64], NDArray[np.float32], NDArray[Any], "Tensor")
"""NumPy array or torch tensor, of float32 or float64; answers are as the motion is, device included."""

Entries = tuple[Any, ...]
"""Packed values one by one: each an array of the batch's shape (...), or a number that all samples share."""


class Dtype(Protocol):
    """Dtype of an array or a tensor."""

    @property
    def itemsize(self) -> int:
        """Size of a number in bytes."""


class Numbers(Protocol):
    """An array or a tensor, in code that need not know which of the two it is."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def ndim(self) -> int: ...
    @property
    def dtype(self) -> Dtype: ...
    @property
    def itemsize(self) -> int: ...
    @property
    def mT(self) -> "Numbers": ...
    @property
    def reshape(self) -> Callable[..., Any]: ...
    def __getitem__(self, key: Any, /) -> "Numbers": ...
    def __setitem__(self, key: Any, value: Any, /) -> None: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator["Numbers"]: ...
    def __bool__(self) -> bool: ...
    def __float__(self) -> float: ...
    def __neg__(self) -> "Numbers": ...
    def __abs__(self) -> "Numbers": ...
    def __add__(self, other: Any, /) -> "Numbers": ...
    def __radd__(self, other: Any, /) -> "Numbers": ...
    def __sub__(self, other: Any, /) -> "Numbers": ...
    def __rsub__(self, other: Any, /) -> "Numbers": ...
    def __mul__(self, other: Any, /) -> "Numbers": ...
    def __rmul__(self, other: Any, /) -> "Numbers": ...
    def __truediv__(self, other: Any, /) -> "Numbers": ...
    def __rtruediv__(self, other: Any, /) -> "Numbers": ...
    def __pow__(self, other: Any, /) -> "Numbers": ...
    def __matmul__(self, other: Any, /) -> "Numbers": ...
    def __rmatmul__(self, other: Any, /) -> "Numbers": ...
    def __lt__(self, other: Any, /) -> Any: ...
    def __le__(self, other: Any, /) -> Any: ...
    def __gt__(self, other: Any, /) -> Any: ...
    def __ge__(self, other: Any, /) -> Any: ...
    def sum(self, axis: Any, /) -> "Numbers": ...
    def any(self, axis: Any = ..., /) -> Any: ...
    def all(self, axis: Any = ..., /) -> Any: ...
    def max(self) -> Any: ...
    def min(self) -> Any: ...
    def argmin(self, axis: Any = ..., /) -> Any: ...
    def diagonal(self, offset: int = ..., first: int = ..., second: int = ..., /) -> "Numbers": ...
    def tolist(self) -> Any: ...


class Namespace(Protocol):
    """Functions that NumPy and torch have under one name; `xp` wherever it is passed on."""

    __name__: str
    linalg: Any

    def concat(self, parts: Sequence[Numbers], axis: int = ..., /) -> Numbers: ...
    def stack(self, parts: Sequence[Numbers], axis: int = ..., /) -> Numbers: ...
    def where(self, condition: Numbers, a: Numbers, b: Numbers | float, /) -> Numbers: ...
    def swapaxes(self, a: Numbers, one: int, other: int, /) -> Numbers: ...
    def moveaxis(self, a: Numbers, one: int, other: int, /) -> Numbers: ...
    def broadcast_to(self, a: Numbers, shape: tuple[int, ...], /) -> Numbers: ...
    def broadcast_shapes(self, *shapes: tuple[int, ...]) -> tuple[int, ...]: ...
    def zeros_like(self, a: Numbers, /) -> Numbers: ...
    def ones_like(self, a: Numbers, /) -> Numbers: ...
    def empty(self, shape: tuple[int, ...], /, *, dtype: Dtype) -> Numbers: ...
    def zeros(self, shape: tuple[int, ...], /, **kind: object) -> Numbers: ...
    def eye(self, size: int, /, **kind: object) -> Numbers: ...
    def amax(self, a: Numbers, axis: int, /) -> Numbers: ...
    def diag(self, a: Numbers, /) -> Numbers: ...
    def isfinite(self, a: Numbers, /) -> Numbers: ...
    def cumsum(self, a: Numbers, axis: int, /) -> Numbers: ...
    def maximum(self, a: Numbers, b: Numbers, /) -> Numbers: ...
    def sign(self, a: Numbers, /) -> Numbers: ...
    def sin(self, a: Numbers, /) -> Numbers: ...
    def cos(self, a: Numbers, /) -> Numbers: ...
    def tan(self, a: Numbers, /) -> Numbers: ...
    def tanh(self, a: Numbers, /) -> Numbers: ...
    def arctan(self, a: Numbers, /) -> Numbers: ...
    def arctan2(self, a: Numbers, b: Numbers, /) -> Numbers: ...


class Library(Protocol):
    """NumPy or torch, as a call computes with it: chosen once, where its motion is read."""

    @property
    def xp(self) -> Namespace:
        """Functions of the library."""

    @property
    def fuses(self) -> bool:
        """True if a compiler makes one loop of many operations, which a matrix product would split."""

    def constant(self, values: Any, like: Numbers) -> Numbers:
        """Return a table of numbers, to compute with `like`."""

    def index(self, values: Any, like: Numbers) -> Numbers:
        """Return a table of positions, to index `like` with."""

    def weights(self, name: str, value: Any, like: Numbers) -> Numbers:
        """Return real numbers, from anything array-like, with the kind and dtype of `like`.

        Raises TypeError or ValueError, which names the argument.
        """

    def zeros(self, like: Numbers, count: int) -> Numbers:
        """Return zeros of shape (..., count) for `like` of shape (..., m)."""

    def concatenate(self, parts: Iterable[Numbers]) -> Numbers:
        """Return the parts joined along the last axis."""

    def few(self, samples: int, links: int) -> bool:
        """Return whether spatial matrices are faster for so many samples of a robot of so many links."""

    def chunk(self, motion: Sequence[Numbers], most: int) -> int | None:
        """Return the number of samples to compute at once, if `most` fit in the cache; None for all."""


class TableKind(NamedTuple):
    """Dtype and device of tables, which are made for it as for numbers that have these."""

    dtype: Any
    device: Any
    """None for NumPy."""


class ClosedForms(Protocol):
    """Closed forms of one link over its path, forms/link_k.py, for arrays of the namespace `xp`.

    q, qd, qdd have shape (..., n); `p` maps names of parameters to values; entries are in the order of
    `Layout`.
    """

    OPERATIONS: Mapping[str, int]
    """Number of operations of each function on arrays, sines and the like included."""

    def decomposition(self, xp: Any, q: Any, qd: Any, qdd: Any, p: Mapping[str, Any]) -> tuple[Entries, ...]:
        """Return (c2, c1, g, tau), and h1 after them where terms are not quadratic in the velocities."""

    def torque(self, xp: Any, q: Any, qd: Any, qdd: Any, p: Mapping[str, Any]) -> Entries:
        """Return tau_ij, in the order of i."""

    def position_gradient(self, xp: Any, q: Any, qd: Any, qdd: Any, p: Mapping[str, Any]) -> Entries:
        """Return c0_ijk = d(tau_ij)/d(q_k), in the order of i, then k."""


class EnergyForms(ClosedForms, Protocol):
    """Closed forms of a link given by its energies; for rigid links the rule has the energies."""

    def energy(self, xp: Any, q: Any, qd: Any, p: Mapping[str, Any]) -> Entries:
        """Return the kinetic and potential energy in J, and in W the power that is not the joints'."""

    def named_shares(self, xp: Any, q: Any, qd: Any, p: Mapping[str, Any]) -> Entries:
        """Return the shares that are not of motion, name by name, in the order of i."""


NUMPY = cast(Namespace, np)
MODULES = cast(Mapping[str, Namespace], sys.modules)
"""Modules that are imported already: wherever there is a tensor, torch is."""


def namespace(values: object) -> Namespace:
    """Return NumPy for an array, torch for a tensor; torch is imported already then."""
    return NUMPY if isinstance(values, np.ndarray) else MODULES["torch"]


def is_traced(values: Numbers) -> bool:
    """Return whether the numbers cannot be looked at.

    That is so where a compiler or a transformation such as vmap follows them, and where they have no data.
    """
    if isinstance(values, np.ndarray):
        return False
    torch = sys.modules["torch"]
    return bool(
        torch.compiler.is_compiling()
        or torch._C._are_functorch_transforms_active()
        or cast("Tensor", values).is_meta
    )


def side_by_side(values: Numbers) -> Numbers:
    """Return the numbers in C's order, without gaps in memory."""
    if isinstance(values, np.ndarray):
        return np.ascontiguousarray(values)
    return cast("Tensor", values).contiguous()


def array_of(values: Numbers) -> NDArray[np.floating]:
    """Return an array as it is, or the numbers of a tensor as an array."""
    if isinstance(values, np.ndarray):
        return values
    return np.asarray(values.detach().cpu() if hasattr(values, "detach") else values)


def kind_of(values: Numbers) -> np.dtype[np.floating]:
    """Return NumPy's dtype of floats for an array or a tensor."""
    return np.dtype(np.float64 if values.dtype.itemsize == 8 else np.float32)


def epsilon_of(values: Numbers) -> float:
    """Return the relative rounding of the dtype of an array or a tensor."""
    return float(np.finfo(kind_of(values)).eps)


class Unscripted:
    """Base of what torch.jit.script is given and cannot compile, as it knows a part of Python alone.

    Methods too refuse it: torch.jit.script looks for the same function on whatever it is given.
    """

    def __init_subclass__(cls) -> None:
        """Have the methods of a class refuse it."""
        super().__init_subclass__()
        for method in vars(cls).values():
            if isinstance(method, FunctionType):
                vars(method)["__prepare_scriptable__"] = refuse_script

    def __prepare_scriptable__(self) -> NoReturn:
        """Raise TypeError, which says what works instead; torch.jit.script calls this first."""
        refuse_script()


def refuse_script() -> NoReturn:
    """Raise TypeError, which says what to take in place of torch.jit.script."""
    raise TypeError(
        "torch.jit.script compiles a part of Python alone, which this is not written in; take "
        "torch.compile or torch.export, or torch.jit.trace of the back end torch"
    )
