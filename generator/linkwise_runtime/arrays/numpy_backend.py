"""Closed forms and the vectorised rule on NumPy arrays."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import (
    NOTHING,
    Beside,
    as_array,
    as_given,
    as_weights,
    check_axes,
    no_common_shape,
    precision,
    samples_of,
    too_many_axes,
)
from ..interface import ClosedForms, EnergyForms, Entries, Namespace, Numbers
from ..parameter_values import fits
from ..rule.calls import RigidRule
from ..rule.joint_tree import Bodies
from ..structure import Structure
from .backend import ArrayBackend, Crossing

Dtype = np.dtype[np.floating]
FLOATS = (np.dtype(np.float32), np.dtype(np.float64))
NO_VALUES: Mapping[str, Numbers] = {}
CROSSINGS = {
    "decomposition": Crossing(1016, ((1016, 32), (3279, 64), (4264, 128), (11719, 256), (28167, 512))),
    "torque": Crossing(618, ((618, 32), (1441, 64), (1985, 128), (21901, 256))),
    "position_gradient": Crossing(1217, ((1217, 32), (2044, 64), (4990, 128), (29453, 512))),
}
"""Limits up to which the rule is faster, see `Crossing`."""
MATRICES = 128
"""Links times samples up to which the rule is faster in spatial matrices than with samples innermost."""


class NumpyBackend(ArrayBackend):
    """Back end that answers with NumPy arrays of the caller's dtype.

    Parameters may be arrays (...), with one value for each sample.
    """

    name: ClassVar = "numpy"
    takes_tensors: ClassVar = False
    xp: ClassVar[Namespace] = cast(Namespace, np)
    fuses: bool = False
    bodies: Bodies[NDArray[np.floating]] | None

    def __init__(
        self,
        structure: Structure,
        links: Sequence[ClosedForms] | None,
        parameters: Mapping[str, object],
        rule: RigidRule | None = None,
        kernel: str = "auto",
        bodies: object = None,
    ) -> None:
        """Set up the back end; raise ValueError for an impossible kernel and for bodies of a wrong shape."""
        super().__init__(structure, links, rule, kernel, bodies)
        self._numbers = {k: as_array(f"parameter {k!r}", v).astype(float) for k, v in parameters.items()}
        self.parameters = self._numbers
        self._alone = {
            call: rule if crossing.rule_is_quicker(self.operations[call], ()) else None
            for call, crossing in CROSSINGS.items()
            if self.kernel == "auto"
        }

    def arrays(
        self, named: Mapping[str, object], n: int, beside: Mapping[str, Beside] = NOTHING
    ) -> Sequence[Numbers]:
        """Return the motion (..., n), then what is beside it, checked and in one shape of samples."""
        motion = [*named.values()]
        first = motion[0]
        if type(first) is np.ndarray and first.dtype in FLOATS and first.shape[-1:] == (n,):
            for a in motion:
                if type(a) is not np.ndarray or a.shape != first.shape or a.dtype != first.dtype:
                    break
            else:
                if not beside:
                    return cast("list[Numbers]", motion)
                for about in beside.values():
                    b: Any = about.value
                    shape = first.shape[:-1] + about.axes
                    if type(b) is not np.ndarray or b.shape != shape or b.dtype != first.dtype:
                        break
                else:
                    return cast("list[Numbers]", [*motion, *(about.value for about in beside.values())])
        given = as_given(named, beside)
        read = {name: as_array(name, value) for name, value in given.items()}
        kind = precision(given, read)
        arrays = {name: a.astype(kind, copy=False) for name, a in read.items()}
        check_axes(arrays, n, self.structure.file_joints, beside)
        batches = [samples_of(name, a, beside) for name, a in arrays.items()]
        try:
            batch = np.broadcast_shapes(*batches)
        except ValueError:
            raise no_common_shape(arrays, n, beside) from None
        except RuntimeError:  # more axes than NumPy has
            raise too_many_axes(arrays, n) from None
        return [
            a if own == batch else np.broadcast_to(a, (*batch, *a.shape[len(own) :]))
            for a, own in zip(arrays.values(), batches, strict=True)
        ]

    def decomposition(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2, c1, g, tau and h1, each (..., count) in the order of `Layout`."""
        p = self._values(q)
        if rule := self._rule("decomposition", q):
            return [*rule.decomposition(self, (q, qd, qdd), p, self._bodies(q)), self.zeros(q, 0)]
        packed = [_Columns(q, size) for size in self.structure.sizes]
        for link in self.links:
            # A link of what is quadratic in the velocities has no h1.
            for columns, entries in zip(packed, link.decomposition(np, q, qd, qdd, p), strict=False):
                columns.fill(entries)
        return [columns.array() for columns in packed]

    def torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return tau (..., count), in the order of `Layout.torque`."""
        p = self._values(q)
        if rule := self._rule("torque", q):
            return rule.torque(self, (q, qd, qdd), p, self._bodies(q))
        columns = _Columns(q, self.structure.sizes.tau)
        for link in self.links:  # the memory of one link's values is used for the next's
            columns.fill(link.torque(np, q, qd, qdd, p))
        return columns.array()

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return c0 (..., count), in the order of `Layout.velocity`."""
        p = self._values(q)
        if rule := self._rule("position_gradient", q):
            return rule.position_gradient(self, (q, qd, qdd), p, self._bodies(q))
        columns = _Columns(q, self.structure.sizes.c1)
        for link in self.links:
            columns.fill(link.position_gradient(np, q, qd, qdd, p))
        return columns.array()

    def separate(self) -> ArrayBackend:
        """Return a copy whose parameters may be set."""
        made = cast(NumpyBackend, super().separate())
        made._numbers = dict(self._numbers)
        made.parameters = made._numbers
        return made

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Give run-time parameters of a separate copy these values."""
        self._numbers.update({name: np.asarray(value, dtype=float) for name, value in values.items()})

    def named_shares(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return shares of links written by hand, (..., count), in the order of `Structure.share_rows`."""
        columns, p = _Columns(q, len(self.structure.share_rows)), self._values(q)
        for link in cast("Sequence[EnergyForms]", self.links):
            columns.fill(link.named_shares(np, q, qd, p))
        return columns.array()

    def evaluated(
        self, function: Callable[..., Sequence[object]], motion: Sequence[Numbers], count: int
    ) -> Numbers:
        """Return what a closed form returns of namespace, motion (..., n) and parameters, (..., count)."""
        columns = _Columns(motion[0], count)
        columns.fill(tuple(function(np, *motion, self._values(motion[0]))))
        return columns.array()

    def _energy_columns(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return K, P and R of the links, one after the other, (..., 3 N)."""
        columns, p = _Columns(q, 3 * self.structure.N), self._values(q)
        for link in cast("Sequence[EnergyForms]", self.links):
            columns.fill(link.energy(np, q, qd, p))
        return columns.array()

    def regressor(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return the rows of 10 of tau in the order of `Layout.torque`, flat: (..., 10 count)."""
        assert self.rule is not None  # Answers has checked it
        return self.rule.regressor(self, (q, qd, qdd), self._values(q))

    def coefficient_regressors(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return the rows of 10 of c2, c1 and g in the order of `Layout`, flat: (..., 10 count) each."""
        assert self.rule is not None  # Answers has checked it
        return self.rule.coefficient_regressors(self, (q, qd, qdd), self._values(q))

    def constant(self, values: ArrayLike, like: Numbers) -> Numbers:
        """Return a table of numbers, to compute with `like`."""
        return np.asarray(values, dtype=cast(Dtype, like.dtype))

    def index(self, values: ArrayLike, like: Numbers) -> Numbers:
        """Return a table of positions, to index `like` with."""
        return np.asarray(values, dtype=np.intp)

    def weights(self, name: str, value: object, like: Numbers) -> Numbers:
        """Return real numbers, from anything array-like, in the dtype of `like`; errors name the argument."""
        return as_array(name, as_weights(name, value)).astype(cast(Dtype, like.dtype))

    def zeros(self, like: Numbers, count: int) -> Numbers:
        """Return zeros of shape (..., count) for `like` of shape (..., m)."""
        return np.zeros((*like.shape[:-1], count), cast(Dtype, like.dtype))

    def concatenate(self, parts: Iterable[Numbers]) -> Numbers:
        """Return the parts joined along the last axis."""
        return np.concatenate(cast("list[NDArray[np.floating]]", list(parts)), -1)

    def few(self, samples: int, links: int) -> bool:
        """Return whether spatial matrices are faster for so many samples of a robot of so many links."""
        return samples * links <= MATRICES

    def chunk(self, motion: Sequence[Numbers], most: int) -> int | None:
        """Return the number of samples to compute at once: as many as stay in the cache."""
        return most

    def _rule(self, call: str, q: Numbers) -> RigidRule | None:
        """Return the rule where it is to be used, None for closed forms."""
        if self.kernel == "auto":
            if q.ndim == 1:
                return self._alone[call]
            quicker = CROSSINGS[call].rule_is_quicker(self.operations[call], tuple(q.shape[:-1]))
            return self.rule if quicker else None
        return self.rule if self.kernel == "rule" else None

    def _bodies(self, q: Numbers) -> Bodies[NDArray[np.floating]] | None:
        return None if self.bodies is None else Bodies(*(a.astype(cast(Dtype, q.dtype)) for a in self.bodies))

    def _values(self, q: Numbers) -> Mapping[str, Numbers]:
        if not self._numbers:
            return NO_VALUES
        for name, value in self._numbers.items():
            if value.ndim:
                fits(name, value.shape, q.shape[:-1])
        return {k: v.astype(cast(Dtype, q.dtype)) for k, v in self._numbers.items()}


class _Columns:
    """An array (..., count) like q, filled from its first column on; for one sample it is made in the end."""

    def __init__(self, q: Numbers, count: int) -> None:
        self._dtype, self._next = cast(Dtype, q.dtype), 0
        self._entries: list[Any] = []
        self._array = None if q.ndim == 1 else np.empty((*q.shape[:-1], count), self._dtype)

    def fill(self, entries: Entries) -> None:
        if self._array is None:
            self._entries += entries
            return
        for value in entries:
            self._array[..., self._next] = value
            self._next += 1

    def array(self) -> NDArray[np.floating]:
        return np.array(self._entries, self._dtype) if self._array is None else self._array
