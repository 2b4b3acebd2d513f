"""Differentiating by torch inside a call, whatever grad mode the caller is in."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor


@dataclass(frozen=True)
class Recording:
    """What a call has to know while it differentiates under torch.enable_grad()."""

    like: Tensor
    """One value a sample, shape (...)."""
    wanted: bool
    """Whether the caller may differentiate the results."""
    keep: bool
    """Whether gradients must be differentiable in their turn."""

    @classmethod
    def of(cls, motion: Sequence[Tensor], parameters: Iterable[Tensor], again: bool = False) -> "Recording":
        """Begin a call in the caller's grad mode; `again` if it differentiates its own gradients."""
        recorded = any(t.requires_grad for t in (*motion, *parameters))
        wanted = recorded and torch.is_grad_enabled()
        return cls(motion[0][..., 0], wanted, wanted or again)

    def finish(self, *groups: Sequence[Tensor]) -> list[Tensor]:
        """Each group of values (...) as one tensor (..., count), as the caller's grad mode wants them."""
        empty = self.like.new_zeros((*self.like.shape, 0))
        packed = [
            torch.stack([v.expand(self.like.shape) for v in group], -1) if group else empty
            for group in groups
        ]
        return packed if self.wanted else [p.detach() for p in packed]


def variable(a: Tensor) -> Tensor:
    """A tensor of its own to differentiate by: its values may also be a direction, which must stay fixed."""
    return a.view_as(a) if a.requires_grad else a.detach().requires_grad_()


def gradient(value: Any, inputs: Sequence[Tensor], keep: bool) -> Sequence[Tensor]:
    """Gradients of the sum of `value`; zeros where it doesn't depend on an input."""
    if not (torch.is_tensor(value) and value.requires_grad):
        return [torch.zeros_like(a) for a in inputs]
    return torch.autograd.grad(
        value.sum(), inputs, create_graph=keep, retain_graph=True, materialize_grads=True
    )
