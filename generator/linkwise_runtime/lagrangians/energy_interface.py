"""Energies of a link as they are differentiated: their arguments, and torch's gradients inside a call.

Calls differentiate whatever grad mode the caller is in.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import torch
from torch import Tensor
from torch.autograd import forward_ad
from torch.utils._python_dispatch import _get_current_dispatch_mode

Number = Tensor | float
"""One number for all samples, or a tensor of one value or of one value for each sample."""
Nested = Number | Sequence["Nested"]
"""A number, or numbers in lists of lists, as `Tensor.tolist` nests them."""


class Values(Protocol):
    """One tensor for each coordinate: values[k] belongs to coordinate k, counted from 0."""

    def __getitem__(self, k: int, /) -> Tensor: ...


class Parameters(Mapping[str, Tensor]):
    """The robot's run-time parameters by name, and constants of links, as one call computes with them.

    like: one value for each sample, shape (...), of the call's dtype and device
    wanted: whether the call's results may be differentiated by constants
    learned: values, nested in lists, that constants of links take instead of those that modules hold
    """

    def __init__(
        self,
        values: Mapping[str, Tensor],
        like: Tensor,
        wanted: bool,
        learned: Mapping[torch.nn.Module, Mapping[str, Nested]] | None = None,
    ) -> None:
        self._values, self.like, self.wanted, self._learned = values, like, wanted, learned or {}
        self._followed = transformed() or _get_current_dispatch_mode() is not None
        self._constants: dict[torch.nn.Module, dict[str, Nested]] = {}

    def __getitem__(self, name: str) -> Tensor:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def with_value(self, name: str, value: Tensor) -> "Parameters":
        """Return the same parameters, but for one."""
        return Parameters({**self._values, name: value}, self.like, self.wanted, self._learned)

    def constants(self, module: torch.nn.Module) -> Mapping[str, Any]:
        """Return the constants of a link: Python numbers, nested; tensors where a transformation needs them.

        With numbers, a product with zero is left out, so that a shoulder without offset costs nothing.
        """
        if module not in self._constants:
            held = (*module._parameters.items(), *module._buffers.items())
            known = self._learned.get(module, {})
            self._constants[module] = {
                name: known[name] if name in known else self._seen(tensor)
                for name, tensor in held
                if tensor is not None
            }
        return self._constants[module]

    def _seen(self, tensor: Tensor) -> Nested:
        followed = self._followed or (self.wanted and tensor.requires_grad)
        return tensor.to(self.like) if followed or tensor.device.type != "cpu" else tensor.tolist()


class Energies(Protocol):
    """Kinetic and potential energy of one link in J."""

    @property
    def path(self) -> tuple[int, ...]:
        """Coordinates that the energies depend on, ascending, counted from 0."""

    @property
    def before(self) -> "Energies | None":
        """Link that carries this one; None where their energies share no work."""

    def kinetic(self, q: Values, qd: Values, p: Parameters) -> Number:
        """Return the kinetic energy in J: a tensor of the coordinates' shape, or one number for all."""

    def potential(self, q: Values, p: Parameters) -> Number:
        """Return the potential energy in J: a tensor of the coordinates' shape, or one number for all."""

    def check_quadratic(self, q: Tensor, qd: Tensor, seen: Callable[[Tensor], "Parameters"]) -> None:
        """Raise ValueError for a kinetic energy of the user's that coefficients of (..., n) do not tell."""


def numbers_of(sources: Iterable[torch.nn.Module]) -> Iterator[Tensor]:
    """Yield every tensor that these modules and their submodules hold."""
    for source in sources:
        for module in source.modules() if source._modules else (source,):
            for held in (module._parameters, module._buffers):
                yield from (tensor for tensor in held.values() if tensor is not None)


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
