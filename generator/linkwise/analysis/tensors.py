"""Back ends that compute with torch tensors, asked with and answering in NumPy arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class TensorModel:
    """A loaded package whose back end takes tensors, as the analysis uses it (`robot.Model`)."""

    def __init__(self, model: Any) -> None:
        self._model = model
        self.joint_names = model.joint_names
        self.link_names = model.link_names
        self.joint_units = model.joint_units
        self.layout = model.layout

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Any:
        """Joint torques τ_i (..., n)."""
        return _array(self._model.inverse_dynamics(*_tensors(q, qd, qdd)))

    def propagation(self, q: Array, qd: Array, qdd: Array, convention: str = "closing") -> Any:
        """Each coefficient times its motion."""
        return _arrays(self._model.propagation(*_tensors(q, qd, qdd), convention=convention))

    def packed(self, q: Array, qd: Array, qdd: Array) -> Any:
        """All coefficients that are not identically 0."""
        return _arrays(self._model.packed(*_tensors(q, qd, qdd)))


def _tensors(*motion: Array) -> list[Any]:
    import torch

    return [torch.from_numpy(np.array(values)) for values in motion]


def _array(value: Any) -> Any:
    return value.detach().numpy() if hasattr(value, "detach") else value


def _arrays(answer: Any) -> Any:
    return type(answer)(*map(_array, answer))
