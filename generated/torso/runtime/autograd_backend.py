"""Lagrangians differentiated by torch."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import torch
from torch import Tensor

from .partial_lagrangian import PartialLagrangian
from .structure import Structure
from .torch_backend import TorchBackend


class AutogradBackend(TorchBackend):
    """Partial torques and coefficients by differentiating each link's Lagrangian.

    lagrangians: the `links` of energies/__init__.py, which makes one module per link for given parameters
    """

    name: ClassVar = "autograd"

    def __init__(
        self,
        structure: Structure,
        lagrangians: Callable[[Mapping[str, Tensor]], Sequence[PartialLagrangian]],
        parameters: Mapping[str, Any],
    ) -> None:
        super().__init__(structure, (), parameters)
        self.lagrangians = lagrangians

    @property
    def modules(self) -> Sequence[PartialLagrangian]:
        """One nn.Module per link; module(q, qd) is its Lagrangian in J."""
        return self.lagrangians(self.parameters)

    def arrays(self, named: Mapping[str, Tensor], n: int) -> Sequence[Tensor]:
        """The motion, checked and broadcast to a common shape (..., n); errors name the argument."""
        if torch._C._are_functorch_transforms_active():
            raise TypeError("this back end does not run inside torch.func; take torch")
        return super().arrays(named, n)

    def decomposition(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Sequence[Tensor]:
        """c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        parts = self._each("decomposition", q, qd, qdd)
        return [self.concatenate(column) for column in zip(*parts, strict=True)]

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """tau (..., count) in the order of `Layout.torque`."""
        return self.concatenate(self._each("torque", q, qd, qdd))

    def position_gradient(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """c0 (..., count) in the order of `Layout.velocity`."""
        return self.concatenate(self._each("position_gradient", q, qd, qdd))

    def _each(self, call: str, q: Tensor, qd: Tensor, qdd: Tensor) -> list[Any]:
        """One answer per link of the Lagrangians' method `call`."""
        if torch.is_inference_mode_enabled():
            # Nothing can be differentiated in that mode, and the answer would be zeros.
            with torch.inference_mode(False), torch.no_grad():
                return self._each(call, q.clone(), qd.clone(), qdd.clone())
        return [getattr(lagrangian, call)(q, qd, qdd) for lagrangian in self.lagrangians(self._values(q))]
