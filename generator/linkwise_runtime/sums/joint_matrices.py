"""Packed values summed over the links, as matrices of joints."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..interface import Backend
from ..structure import Layout, Structure


class SumTable(NamedTuple):
    """Which packed values a matrix of joints sums: first those of its first entry, row by row."""

    values: Any
    """Position of each summand."""
    entries: Any
    """Entry of the matrix, flat, that it belongs to."""
    starts: Any
    """Where the summands of each entry begin that has any."""
    filled: Any
    """These entries."""


class JointMatrices:
    """Sums sum_j c_ijk of one robot, with tables of positions kept for each device."""

    def __init__(self, structure: Structure, backend: Backend[Any]) -> None:
        self._layout, self._n, self._backend = structure.layout, structure.n, backend
        self._tables: dict[Any, SumTable] = {}
        for like in backend.examples:
            for field in ("acceleration", "velocity"):
                self._table(field, like)

    def summed(self, values: Any, field: str) -> Any:
        """Matrices (..., n, n) of values (..., count) of a field of `Layout` with rows (i, j, k)."""
        table = self._table(field, values)
        size = self._n * self._n
        if not isinstance(values, np.ndarray):
            summands = values.index_select(-1, table.values)
            sums = self._backend.zeros(values, size).index_add(-1, table.entries, summands)
        elif len(table.starts) == size:
            sums = np.add.reduceat(values.take(table.values, -1), table.starts, -1)
        else:
            sums = np.zeros((*values.shape[:-1], size), values.dtype)
            if len(table.starts):
                sums[..., table.filled] = np.add.reduceat(values.take(table.values, -1), table.starts, -1)
        return sums.reshape(*values.shape[:-1], self._n, self._n)

    def _table(self, field: str, like: Any) -> SumTable:
        key = field, getattr(like, "device", None)
        if key not in self._tables:
            listed = sum_table(self._layout, field, self._n)
            self._tables[key] = SumTable(*(self._backend.index(a, like) for a in listed))
        return self._tables[key]


def sum_table(layout: Layout, field: str, n: int) -> SumTable:
    """The table of a field; of c2, whose half i <= k is listed, the other half too."""
    rows: NDArray[np.intp] = getattr(layout, field)
    i, k = rows[:, 0], rows[:, 2]
    values, entries = np.arange(len(rows)), i * n + k
    if field == "acceleration":
        values, entries = np.append(values, values[i < k]), np.append(entries, (k * n + i)[i < k])
    order = np.argsort(entries, kind="stable")
    filled, starts = np.unique(entries[order], return_index=True)
    return SumTable(values[order], entries[order], starts, filled)
