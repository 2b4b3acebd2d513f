"""Closed forms on torch tensors."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

import torch
from torch import Tensor

from .arguments import same_kind
from .interface import ClosedForms
from .parameter_values import fits
from .structure import Structure


class TorchBackend:
    """Answers with tensors of the caller's dtype and device; gradients flow through motion and parameters."""

    name: ClassVar = "torch"
    takes_tensors: ClassVar = True

    def __init__(
        self, structure: Structure, links: Sequence[ClosedForms], parameters: Mapping[str, Any]
    ) -> None:
        self.structure = structure
        self.links = links
        self.parameters: dict[str, Any] = {
            k: v if torch.is_tensor(v) else torch.as_tensor(v, dtype=torch.float64)
            for k, v in parameters.items()
        }

    def arrays(self, named: Mapping[str, Tensor], n: int) -> Sequence[Tensor]:
        """The motion, checked and broadcast to a common shape (..., n); errors name the argument."""
        for name, a in named.items():
            if not torch.is_tensor(a):
                raise TypeError(f"{name} is {type(a).__name__}; this back end takes torch tensors")
            if a.dtype not in (torch.float32, torch.float64):
                raise TypeError(f"{name} has dtype {a.dtype}; give float32 or float64")
        if len({a.device for a in named.values()}) > 1:
            raise TypeError(f"{', '.join(named)} lie on different devices; move them to one")
        return torch.broadcast_tensors(*same_kind(named, n).values())  # type: ignore[no-any-return, no-untyped-call]

    def decomposition(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Sequence[Tensor]:
        """c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        p = self._values(q)
        groups: list[list[Tensor]] = [[] for _ in self.structure.sizes]
        for link in self.links:
            # Link by link, so that one link's values lend their memory to the next one's. A link without
            # energy terms linear in the velocities has no h1.
            for group, entries in zip(groups, link.decomposition(torch, q, qd, qdd, p), strict=False):
                group.append(_stacked(q, entries))
        return [self.concatenate(group) if group else self.zeros(q, 0) for group in groups]

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """tau (..., count) in the order of `Layout.torque`."""
        p = self._values(q)
        return self.concatenate(_stacked(q, link.torque(torch, q, qd, qdd, p)) for link in self.links)

    def position_gradient(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """c0 (..., count) in the order of `Layout.velocity`."""
        p = self._values(q)
        return self.concatenate(
            _stacked(q, link.position_gradient(torch, q, qd, qdd, p)) for link in self.links
        )

    def constant(self, values: Any, like: Tensor) -> Tensor:
        """A table of numbers, to compute with `like`."""
        with torch.inference_mode(False):  # it is kept, and a later call may need its gradient
            return torch.as_tensor(values, dtype=like.dtype, device=like.device)

    def index(self, values: Any, like: Tensor) -> Tensor:
        """A table of positions, to take from `like`."""
        with torch.inference_mode(False):  # it is kept, and a later call may need its gradient
            return torch.as_tensor(values, dtype=torch.long, device=like.device)

    def asarray(self, value: Any, like: Tensor) -> Tensor:
        """Anything array-like, in the dtype and on the device of `like`."""
        return torch.as_tensor(value, dtype=like.dtype, device=like.device)

    def zeros(self, like: Tensor, count: int) -> Tensor:
        """Zeros of shape (..., count) for `like` of shape (..., m)."""
        return like.new_zeros((*like.shape[:-1], count))

    def concatenate(self, parts: Iterable[Tensor]) -> Tensor:
        """The parts joined along the last axis."""
        return torch.cat(list(parts), -1)

    def _values(self, q: Tensor) -> dict[str, Tensor]:
        for name, value in self.parameters.items():
            if value.ndim:
                fits(name, value.shape, q.shape[:-1])
        return {k: v.to(q) for k, v in self.parameters.items()}


def _stacked(q: Tensor, entries: Sequence[Any]) -> Tensor:
    """Entries, numbers or tensors that broadcast to the batch of q (..., n), as one tensor (..., count)."""
    shape, like = q.shape[:-1], q[..., 0]
    columns = [
        v.to(q.dtype).expand(shape) if torch.is_tensor(v) else torch.full_like(like, v) for v in entries
    ]
    return torch.stack(columns, -1)
