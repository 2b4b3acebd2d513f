"""The Lagrangian of one link as a torch module."""

from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

import torch
from torch import Tensor

Parameters = Mapping[str, Tensor]
"""Values by name."""


class Values(Protocol):
    """One tensor for each coordinate: values[k] belongs to coordinate k, counted from 0."""

    def __getitem__(self, k: int, /) -> Tensor: ...


class PartialLagrangian(torch.nn.Module):
    """Lagrangian of one link as a module; a subclass writes down `kinetic` and `potential`."""

    path: ClassVar[tuple[int, ...]] = ()
    """Coordinates that the energies depend on, ascending, counted from 0."""
    linear: ClassVar[bool] = False
    """Whether the kinetic energy has terms linear in the velocities."""
    parent: ClassVar["type[PartialLagrangian] | None"] = None
    """Lagrangian of the link that carries this one, if their energies share work."""

    def __init__(self, p: Parameters) -> None:
        super().__init__()
        self.p = p

    def kinetic(self, q: Values, qd: Values) -> Any:
        """Kinetic energy in J."""
        raise NotImplementedError

    def potential(self, q: Values) -> Any:
        """Potential energy in J."""
        raise NotImplementedError

    def forward(self, q: Tensor, qd: Tensor) -> Tensor:
        """Lagrangian in J, shape (...); q and qd of shape (..., n)."""
        x, v = q.unbind(-1), qd.unbind(-1)
        energy = self.kinetic(x, v) - self.potential(x)
        value: Tensor = energy + torch.zeros_like(x[0])
        return value
