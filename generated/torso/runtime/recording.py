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

    @classmethod
    def of(cls, motion: Sequence[Tensor], parameters: Iterable[Tensor]) -> "Recording":
        """Begin a call in the caller's grad mode."""
        recorded = any(t.requires_grad for t in (*motion, *parameters))
        return cls(motion[0][..., 0], recorded and torch.is_grad_enabled())

    def lanes(self, values: Tensor) -> Tensor:
        """One value a lane, (lanes,), for every sample: shape (lanes, ...)."""
        return values.reshape(-1, *[1] * self.like.dim()).expand(-1, *self.like.shape)

    def finish(self, values: Tensor) -> Tensor:
        """Values (count, ...) as (..., count), as the caller's grad mode wants them."""
        packed = values.movedim(0, -1).contiguous()
        return packed if self.wanted else packed.detach()


def variable(a: Tensor) -> Tensor:
    """A tensor of its own to differentiate by: its values may also be a direction, which must stay fixed."""
    return a.view_as(a) if a.requires_grad else a.detach().requires_grad_()


def gradient(
    values: Sequence[Any], weights: Sequence[Tensor] | None, inputs: Sequence[Tensor], keep: bool, last: bool
) -> Sequence[Tensor]:
    """Gradients of the weighted sum of `values`, of their sum if no weights are given.

    Zeros where it doesn't depend on an input. With `keep` gradients can be differentiated in turn; after the
    `last` sweep without it the graph is gone, and its memory with it.
    """
    chosen = [
        (value, torch.ones_like(value) if weights is None else weights[i])
        for i, value in enumerate(values)
        if torch.is_tensor(value) and value.requires_grad
    ]
    if not chosen or not inputs:
        return [torch.zeros_like(a) for a in inputs]
    outputs, given = zip(*chosen, strict=True)
    return torch.autograd.grad(
        outputs, inputs, given, retain_graph=keep or not last, create_graph=keep, materialize_grads=True
    )
