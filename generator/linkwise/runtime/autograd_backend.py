"""Lagrangians differentiated by torch."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import torch
from torch import Tensor

from .graph_calls import graph_of, graph_parts_of
from .partial_lagrangian import PartialLagrangian
from .structure import Structure
from .sweeps import decomposition, position_gradient, torque
from .torch_backend import TorchBackend

AT_A_TIME = 1 << 16
"""Samples times lanes in one sweep, so that memory does not grow with the batch."""


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
        parts: Sequence[Tensor] = self._of_links(decomposition, q, qd, qdd)
        return parts

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """tau (..., count) in the order of `Layout.torque`."""
        tau: Tensor = self._of_links(torque, q, qd, qdd)
        return tau

    def position_gradient(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """c0 (..., count) in the order of `Layout.velocity`."""
        c0: Tensor = self._of_links(position_gradient, q, qd, qdd)
        return c0

    def graph(self, *asked: Any) -> Any:
        """See `Dynamics.graph`."""
        return graph_of(self, *asked)

    def graph_parts(self, *asked: Any) -> Any:
        """See `Dynamics.graph_parts`."""
        return graph_parts_of(self, *asked)

    def _of_links(self, call: Callable[..., Any], q: Tensor, qd: Tensor, qdd: Tensor) -> Any:
        """What a function of sweeps.py makes of the Lagrangians."""
        if torch.is_inference_mode_enabled():
            # Nothing can be differentiated in that mode, and the answer would be zeros.
            with torch.inference_mode(False), torch.no_grad():
                return self._of_links(call, q.clone(), qd.clone(), qdd.clone())
        values, most = self._values(q), max(1, AT_A_TIME // self.structure.sizes.tau)
        if q[..., 0].numel() <= most:
            return call(self.lagrangians(values), q, qd, qdd)
        batch = q.shape[:-1]
        flat = [a.reshape(-1, a.shape[-1]) for a in (q, qd, qdd)]
        values = {name: p.expand(batch).reshape(-1) if p.dim() else p for name, p in values.items()}
        parts = []
        for at in range(0, len(flat[0]), most):
            some = {name: p[at : at + most] if p.dim() else p for name, p in values.items()}
            parts.append(call(self.lagrangians(some), *(a[at : at + most] for a in flat)))
        if torch.is_tensor(parts[0]):
            return torch.cat(parts).reshape(*batch, -1)
        return [torch.cat(part).reshape(*batch, part[0].shape[-1]) for part in zip(*parts, strict=True)]
