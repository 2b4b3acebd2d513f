"""Closed forms and the vectorised rule on NumPy arrays."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from ..arguments import as_array, as_weights, check_axes, no_common_shape, precision, too_many_axes
from ..interface import ClosedForms, EnergyForms, Entries
from ..parameter_values import fits
from ..rule.joint_tree import Bodies
from ..rule.rule_calls import RigidRule
from ..rule.tree_arrays import checked_bodies
from ..structure import Structure
from .array_backend import ArrayBackend
from .array_kernels import Crossing, known_kernel, operations

FLOATS = (np.dtype(np.float32), np.dtype(np.float64))
CROSSINGS = {
    "decomposition": Crossing(1016, ((1016, 32), (3279, 64), (4264, 128), (11719, 256), (28167, 512))),
    "torque": Crossing(618, ((618, 32), (1441, 64), (1985, 128), (21901, 256))),
    "position_gradient": Crossing(1217, ((1217, 32), (2044, 64), (4990, 128), (29453, 512))),
}
"""Where the rule is quicker, see `array_kernels`."""
MATRICES = 128
"""Links times samples up to which the rule is quicker in spatial matrices than with its samples innermost."""


class NumpyBackend(ArrayBackend):
    """Answers with NumPy arrays of the caller's dtype; parameters may be arrays (...): one value a sample."""

    name: ClassVar = "numpy"
    takes_tensors: ClassVar = False
    examples: tuple[Any, ...] = ()
    face: ClassVar[Any] = None
    xp: ClassVar[Any] = np
    fuses: ClassVar = False

    def __init__(
        self,
        structure: Structure,
        links: Sequence[ClosedForms] | None,
        parameters: Mapping[str, Any],
        rule: RigidRule | None = None,
        kernel: str = "auto",
        bodies: Bodies[Any] | None = None,
    ) -> None:
        """`links` are the closed forms, `rule` the vectorised rule: a package has one of them, or both.

        Raises ValueError for a kernel that cannot be and for bodies of a wrong shape.
        """
        self.structure = structure
        self.links = links or ()
        self.operations = operations(links) if links and rule else {}
        self.rule, self.tree = rule, rule.tree if rule else None
        self.kernel = known_kernel(kernel, links is not None, rule is not None, bodies is not None)
        self.parameters: dict[str, Any] = {
            k: as_array(f"parameter {k!r}", v).astype(float) for k, v in parameters.items()
        }
        self.bodies = None if bodies is None else checked_bodies(bodies, structure.N, as_array)

    def arrays(self, named: Mapping[str, Any], n: int) -> Sequence[Any]:
        """The motion, checked and broadcast to a common shape (..., n); errors name the argument."""
        first, *rest = named.values()
        if (
            type(first) is np.ndarray
            and first.dtype in FLOATS
            and first.shape[-1:] == (n,)
            and all(type(a) is np.ndarray and a.shape == first.shape and a.dtype == first.dtype for a in rest)
        ):
            return [first, *rest]
        read = {name: as_array(name, value) for name, value in named.items()}
        kind = precision(named, read)
        arrays = {name: a.astype(kind, copy=False) for name, a in read.items()}
        check_axes(arrays, n, self.structure.file_joints)
        try:
            shape = np.broadcast_shapes(*(a.shape for a in arrays.values()))
        except ValueError:
            raise no_common_shape(arrays, n) from None
        except RuntimeError:  # of more than 32 axes
            raise too_many_axes(arrays, n) from None
        return [a if a.shape == shape else np.broadcast_to(a, shape) for a in arrays.values()]

    def decomposition(self, q: Any, qd: Any, qdd: Any) -> Sequence[Any]:
        """c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        p = self._values(q)
        if rule := self._rule("decomposition", q):
            return [*rule.decomposition(self, (q, qd, qdd), p, self._bodies(q)), self.zeros(q, 0)]
        packed = [_Columns(q, size) for size in self.structure.sizes]
        for link in self.links:
            # A link without energy terms linear in the velocities has no h1.
            for columns, entries in zip(packed, link.decomposition(np, q, qd, qdd, p), strict=False):
                columns.fill(entries)
        return [columns.array for columns in packed]

    def torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        """tau (..., count) in the order of `Layout.torque`."""
        p = self._values(q)
        if rule := self._rule("torque", q):
            return rule.torque(self, (q, qd, qdd), p, self._bodies(q))
        columns = _Columns(q, self.structure.sizes.tau)
        for link in self.links:
            columns.fill(link.torque(np, q, qd, qdd, p))
        return columns.array

    def position_gradient(self, q: Any, qd: Any, qdd: Any) -> Any:
        """c0 (..., count) in the order of `Layout.velocity`."""
        p = self._values(q)
        if rule := self._rule("position_gradient", q):
            return rule.position_gradient(self, (q, qd, qdd), p, self._bodies(q))
        columns = _Columns(q, self.structure.sizes.c1)
        for link in self.links:
            columns.fill(link.position_gradient(np, q, qd, qdd, p))
        return columns.array

    def energies(self, q: Any, qd: Any) -> tuple[Any, Any]:
        """Kinetic and potential energies of the links in J, (..., N) each."""
        p = self._values(q)
        if self.rule:
            kinetic, potential = self.rule.energies(self, (q, qd), p, self._bodies(q))
            return kinetic, potential
        columns = _Columns(q, 2 * self.structure.N)
        for link in cast("Sequence[EnergyForms]", self.links):
            columns.fill(link.energy(np, q, qd, p))
        return columns.array[..., 0::2], columns.array[..., 1::2]

    def regressor(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Rows of 10 of tau in the order of `Layout.torque`, flat: (..., 10 count)."""
        assert self.rule is not None  # Answers has seen to it
        rows: Any = self.rule.regressor(self, (q, qd, qdd), self._values(q))
        return rows

    def coefficient_regressors(self, q: Any, qd: Any, qdd: Any) -> Sequence[Any]:
        """Rows of 10 of c2, c1, g in the order of `Layout`, flat: (..., 10 count) each."""
        assert self.rule is not None  # Answers has seen to it
        return self.rule.coefficient_regressors(self, (q, qd, qdd), self._values(q))

    def constant(self, values: NDArray[Any], like: Any) -> Any:
        """A table of numbers, to compute with `like`."""
        return np.asarray(values, dtype=like.dtype)

    def index(self, values: NDArray[np.intp], like: Any) -> Any:
        """A table of positions, to take from `like`."""
        return np.asarray(values, dtype=np.intp)

    def weights(self, name: str, value: Any, like: Any) -> Any:
        """Real numbers in anything array-like, in the dtype of `like`; errors name the argument."""
        return as_array(name, as_weights(name, value)).astype(like.dtype)

    def zeros(self, like: Any, count: int) -> Any:
        """Zeros of shape (..., count) for `like` of shape (..., m)."""
        return np.zeros((*like.shape[:-1], count), like.dtype)

    def concatenate(self, parts: Iterable[Any]) -> Any:
        """The parts joined along the last axis."""
        return np.concatenate(list(parts), -1)

    def few(self, samples: int, links: int) -> bool:
        """Whether spatial matrices are quicker for so many samples of a robot of so many links."""
        return samples * links <= MATRICES

    def chunk(self, motion: Sequence[Any], most: int) -> int | None:
        """Samples to compute at once: as many as stay in the cache."""
        return most

    def _rule(self, call: str, q: Any) -> RigidRule | None:
        """The rule where it is to be taken, None for closed forms."""
        if self.kernel == "auto":
            quicker = CROSSINGS[call].rule_is_quicker(self.operations[call], tuple(q.shape[:-1]))
            return self.rule if quicker else None
        return self.rule if self.kernel == "rule" else None

    def _bodies(self, q: Any) -> Bodies[Any] | None:
        return None if self.bodies is None else Bodies(*(a.astype(q.dtype) for a in self.bodies))

    def _values(self, q: Any) -> dict[str, Any]:
        for name, value in self.parameters.items():
            if value.ndim:
                fits(name, value.shape, q.shape[:-1])
        return {k: v.astype(q.dtype) for k, v in self.parameters.items()}


class _Columns:
    """An array (..., count) like q, filled from its first column on."""

    def __init__(self, q: Any, count: int) -> None:
        self.array = np.empty((*q.shape[:-1], count), q.dtype)
        self._next = 0

    def fill(self, entries: Entries) -> None:
        start, self._next = self._next, self._next + len(entries)
        if self.array.ndim == 1:
            self.array[start : self._next] = entries
            return
        for column, value in enumerate(entries, start):
            self.array[..., column] = value
