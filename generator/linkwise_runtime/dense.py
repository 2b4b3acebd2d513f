"""Packed values spread over tensors with their zeros."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .interface import Array, Backend
from .quantities import PARAMETERS
from .structure import Structure


class Dense:
    """Spreads packed values of one robot, with tables of constants kept for each device."""

    def __init__(self, structure: Structure, backend: Backend[Any]) -> None:
        self._layout, self._n = structure.layout, structure.n
        self._backend = backend
        over = (structure.n, structure.N)
        self._shapes = {
            "acceleration": (*over, structure.n),
            "velocity": (*over, structure.n),
            "velocity_linear": (*over, structure.n),
            "gravity": over,
            "torque": over,
        }
        self._tables: dict[Any, Any] = {}
        for like in backend.examples:
            for field in self._shapes:
                self._table(field, like)
            self._sums(like)

    def spread(self, values: Array, field: str) -> Array:
        """Values (..., count) of a field of `Layout` over (..., n, N) or (..., n, N, n), zeros elsewhere."""
        padded = self._backend.concatenate([values, self._backend.zeros(values, 1)])
        entries = padded[..., self._table(field, values)]
        dense: Array = entries.reshape(*values.shape[:-1], *self._shapes[field])
        return dense

    def spread_rows(self, values: Array, field: str) -> Array:
        """Rows of 10 (..., 10 count) of a field over (..., n, N[, n], 10), zeros elsewhere."""
        padded = self._backend.concatenate([values, self._backend.zeros(values, PARAMETERS)])
        rows = padded.reshape(*values.shape[:-1], len(getattr(self._layout, field)) + 1, PARAMETERS)
        entries = rows[..., self._table(field, values), :]
        dense: Array = entries.reshape(*values.shape[:-1], *self._shapes[field], PARAMETERS)
        return dense

    def summed(self, tau: Array) -> Array:
        """Packed torques (..., count), summed over the links: (..., n)."""
        total: Array = tau @ self._sums(tau)
        return total

    def _table(self, field: str, like: Any) -> Any:
        key = field, getattr(like, "device", None)
        if key not in self._tables:
            self._tables[key] = self._backend.index(self._positions(field), like)
        return self._tables[key]

    def _sums(self, like: Any) -> Any:
        key = like.dtype, getattr(like, "device", None)
        if key not in self._tables:
            self._tables[key] = self._backend.constant(self._joint_sums(), like)
        return self._tables[key]

    def _joint_sums(self) -> NDArray[np.float64]:
        rows = self._layout.torque
        sums = np.zeros((len(rows), self._n))
        sums[np.arange(len(rows)), rows[:, 0]] = 1.0
        return sums

    def _positions(self, field: str) -> NDArray[np.intp]:
        """For each entry of the dense tensor its packed position, or that of the zero behind them."""
        rows = getattr(self._layout, field)
        positions = np.full(self._shapes[field], len(rows), dtype=np.intp)
        positions[tuple(rows.T)] = np.arange(len(rows))
        if field == "acceleration":
            positions[rows[:, 2], rows[:, 1], rows[:, 0]] = np.arange(len(rows))
        return positions.reshape(-1)
