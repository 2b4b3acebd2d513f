"""Differentiation by torch inside a call, whatever grad mode the caller is in."""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.autograd import forward_ad


@dataclass(frozen=True)
class Recording:
    """State of a call while it differentiates under torch.enable_grad()."""

    like: Tensor
    """One value for each sample, shape (...)."""
    wanted: bool
    """True if the caller may differentiate the results."""

    @classmethod
    def of(cls, motion: Sequence[Tensor], wanted: bool) -> "Recording":
        """Begin a call whose results, where `wanted`, may be differentiated by more than the motion."""
        recorded = torch.is_grad_enabled() and any(t.requires_grad for t in motion)
        return cls(motion[0][..., 0], recorded or wanted)

    def lanes(self, values: Tensor) -> Tensor:
        """Return values (lanes,) repeated for every sample: shape (lanes, ...)."""
        return values.reshape(-1, *[1] * self.like.dim()).expand(-1, *self.like.shape)

    def finish(self, values: Tensor) -> Tensor:
        """Return values (count, ...) as (..., count), detached unless the caller may differentiate them."""
        packed = values.movedim(0, -1).contiguous()
        return packed if self.wanted else packed.detach()


def transformed() -> bool:
    """Return whether torch.func, torch.compile or forward mode is active, from which sweeps hide the call."""
    return (
        torch.compiler.is_compiling()
        or torch._C._are_functorch_transforms_active()
        or forward_ad._current_level >= 0
    )


def variable(a: Tensor) -> Tensor:
    """Return a separate tensor to differentiate by.

    Its values may also serve as a direction, which must stay fixed.
    """
    return a.view_as(a) if a.requires_grad else a.detach().requires_grad_()


def gradient(
    values: Sequence[Tensor | float],
    weights: Sequence[Tensor] | None,
    inputs: Sequence[Tensor],
    keep: bool,
    last: bool,
) -> Sequence[Tensor]:
    """Return gradients of the weighted sum of `values`, or of their sum if no weights are given.

    They are zeros where the sum does not depend on an input. With `keep`, gradients can be differentiated in
    turn; without it, the `last` sweep frees the graph and its memory.
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
