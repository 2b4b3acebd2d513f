"""The modules of a robot's links, by number or by name."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import cast

import torch

from ..arrays.torch_modules import RunTimeValues, attribute_names
from ..chosen_names import choice, position_of, short
from ..structure import Structure
from .partial_lagrangian import PartialLagrangian
from .rigid_lagrangian import RigidLagrangian

KINDS = ("mass", "com", "inertia", "place")
"""Constants of rigid links."""


class LinkModules(torch.nn.Module):
    """The links' modules: links[j] with j from 0, or links["name"].

    In a state_dict they have their names, without dots.
    """

    def __init__(self, names: Iterable[str], modules: Iterable[PartialLagrangian]) -> None:
        super().__init__()
        self.names = tuple(names)
        self._keys = attribute_names(self.names, self)
        for key, module in zip(self._keys, modules, strict=True):
            self.add_module(key, module)

    def __getitem__(self, link: int | str) -> PartialLagrangian:
        """Return a link's module; -1 is the last link. Raises ValueError for a link that is not there."""
        if isinstance(link, int) and -len(self.names) <= link < 0:
            link += len(self.names)
        link = position_of(link, self.names, "link", "the link")
        return cast(PartialLagrangian, self._modules[self._keys[link]])

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[PartialLagrangian]:
        return (self[j] for j in range(len(self)))


def links_and_values(
    structure: Structure,
    kinds: Sequence[type[PartialLagrangian]],
    values: Mapping[str, object],
    requires_grad: bool | str | Iterable[str],
) -> tuple[LinkModules, RunTimeValues]:
    """Return one module for each link, and the run-time parameters, which the modules share.

    requires_grad: as in the package's `load`
    """
    rigid = any(issubclass(kind, RigidLagrangian) for kind in kinds)
    learned = learned_names(requires_grad, values, rigid)
    given, made = RunTimeValues(values, learned), dict[type[PartialLagrangian] | None, PartialLagrangian]()
    for j, kind in enumerate(kinds):
        made[kind] = kind(structure.only(j), given, made.get(kind.parent), learned)
    if not isinstance(requires_grad, bool):
        _refuse_idle(learned.intersection(KINDS), made.values(), values)
    return LinkModules(structure.link_names, made.values()), given


def learned_names(asked: bool | str | Iterable[str], parameters: Iterable[str], rigid: bool) -> set[str]:
    """Return the names of constants and run-time parameters that become nn.Parameters.

    Raises ValueError for a name that is none of them, and TypeError for anything but names or a bool.
    """
    known = [*(KINDS if rigid else ()), *parameters]
    if isinstance(asked, bool):
        return set(known) if asked else set()
    if not isinstance(asked, Iterable):
        raise TypeError(f"requires_grad is {short(asked)}; give True, or names: {', '.join(known)}")
    names = {asked} if isinstance(asked, str) else set(asked)
    for name in sorted(names.difference(known), key=str):
        there = f"choose among {', '.join(known)}" if known else "this package has no number to learn"
        raise ValueError(f"requires_grad names {name!r}; {there}")
    return names


def _refuse_idle(
    kinds: Iterable[str], modules: Collection[PartialLagrangian], parameters: Mapping[str, object]
) -> None:
    """Raise ValueError for a kind of constants that no link has, as they depend on run-time parameters."""
    for kind in sorted(kinds):
        if not any(kind in module._parameters for module in modules):
            raise ValueError(
                f"requires_grad names {kind!r}, which hangs on run-time parameters in every link here; name "
                f"these: {choice(kind, parameters, 'parameters')}"
            )
