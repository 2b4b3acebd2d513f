"""Arguments of a link's energies: coordinates, and the run-time parameters of the robot."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import torch
from torch import Tensor
from torch.utils._python_dispatch import _get_current_dispatch_mode

from .recording import transformed

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
    def linear(self) -> bool:
        """True if the kinetic energy has terms linear in the velocities."""

    @property
    def before(self) -> "Energies | None":
        """Link that carries this one; None where their energies share no work."""

    def kinetic(self, q: Values, qd: Values, p: Parameters) -> Number:
        """Return the kinetic energy in J: a tensor of the coordinates' shape, or one number for all."""

    def potential(self, q: Values, p: Parameters) -> Number:
        """Return the potential energy in J: a tensor of the coordinates' shape, or one number for all."""


def numbers_of(sources: Iterable[torch.nn.Module]) -> Iterator[Tensor]:
    """Yield every tensor that these modules and their submodules hold."""
    for source in sources:
        for module in source.modules() if source._modules else (source,):
            for held in (module._parameters, module._buffers):
                yield from (tensor for tensor in held.values() if tensor is not None)
