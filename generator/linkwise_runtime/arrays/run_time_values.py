"""Run-time parameters of a robot as a module that owns their tensors; links that share one ask it."""

from collections.abc import Collection, ItemsView, Iterable, Iterator, KeysView, Mapping, ValuesView
from typing import Any, cast

import torch
from torch import Tensor


class RunTimeValues(torch.nn.Module):
    """Tensors by the parameters' names: buffers, but nn.Parameters where they are given or `learned`."""

    def __init__(self, values: Mapping[str, Any], learned: Collection[str] = ()) -> None:
        super().__init__()
        self._keys = dict(zip(values, attribute_names(values, self), strict=True))
        for name, value in values.items():
            hold(self, self._keys[name], value, name in learned)

    def __getitem__(self, name: str) -> Tensor:
        key = self._keys[name]
        tensor = self._parameters.get(key)
        return cast(Tensor, self._buffers[key]) if tensor is None else tensor

    def __setitem__(self, name: str, value: Tensor) -> None:
        setattr(self, self._keys[name], value)

    def __iter__(self) -> Iterator[str]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)

    def _as_dict(self) -> dict[str, Tensor]:
        return {name: self[name] for name in self._keys}

    def keys(self) -> KeysView[str]:
        """Names."""
        return self._keys.keys()

    def values(self) -> ValuesView[Tensor]:
        """Tensors."""
        return self._as_dict().values()

    def items(self) -> ItemsView[str, Tensor]:
        """Names and tensors."""
        return self._as_dict().items()


def hold(module: torch.nn.Module, key: str, value: Any, learned: bool) -> None:
    """Register a number of the robot: as it is if it is a tensor, of float64 otherwise."""
    tensor = value if torch.is_tensor(value) else torch.as_tensor(value, dtype=torch.float64)
    if learned and not isinstance(tensor, torch.nn.Parameter):
        real = tensor if tensor.is_floating_point() else tensor.double()
        tensor = torch.nn.Parameter(real.detach().clone())
    if isinstance(tensor, torch.nn.Parameter):
        module.register_parameter(key, tensor)
    else:
        module.register_buffer(key, tensor)


def attribute_names(names: Iterable[str], module: torch.nn.Module) -> list[str]:
    """Names as keys of a state_dict: without dots, and none that the module has for something else."""
    found: list[str] = []
    for name in names:
        key = name.replace(".", "_") or "_"
        while hasattr(module, key) or key in found:
            key += "_"
        found.append(key)
    return found
