"""Leaves of graphs that are no motion: run-time parameters, and nn.Parameters of links, entry by entry."""

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

import torch
from torch import Tensor

from ..recorded.operation_recorder import Leaf
from .energy_interface import Parameters


def leaves_beside_motion(backend: Any) -> dict[Leaf, Tensor]:
    """Leaves that a graph may have, and their values as they are now."""
    given = {Leaf(f"p[{name}]", "parameter", name): value for name, value in backend.given.items()}
    return given | {Leaf(name, "parameter", name): entry for name, entry in learned_entries(backend).items()}


def learned_entries(backend: Any) -> dict[str, Tensor]:
    """Numbers of links that are nn.Parameters, as they are now, by names such as links.link2.com[0]."""
    return {
        name: entry
        for link, module in backend.modules.named_children()
        for key, tensor in module._parameters.items()
        for name, entry in zip(_names(link, key, tensor), tensor.reshape(-1).unbind(), strict=True)
    }


def seen_as_leaves(backend: Any, values: Mapping[str, Tensor]) -> Parameters:
    """What energies are recorded with: leaves by their keys, and numbers for all that nobody learns."""
    learned = {
        module: {
            key: _nested(iter([values[name] for name in _names(link, key, tensor)]), tensor.shape)
            for key, tensor in module._parameters.items()
        }
        for link, module in backend.modules.named_children()
    }
    run_time = {name: values[f"p[{name}]"] for name in backend.given}
    return Parameters(run_time, torch.zeros((), dtype=torch.float64), wanted=False, learned=learned)


def _names(link: str, key: str, tensor: Tensor) -> list[str]:
    """Name of each entry: that of the tensor in the robot's state_dict, and where the entry stands in it."""
    places = product(*map(range, tensor.shape))
    return [f"links.{link}.{key}{list(place) if place else ''}" for place in places]


def _nested(entries: Iterator[Tensor], shape: tuple[int, ...]) -> Any:
    """Entries in lists of lists, as `Tensor.tolist` nests numbers."""
    return [_nested(entries, shape[1:]) for _ in range(shape[0])] if shape else next(entries)
