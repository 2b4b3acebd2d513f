"""Many points of a motion side by side, so that one sweep differentiates the Lagrangians of all links.

A lane is one velocity at which one link's energies are looked at, for every sample. Each link has lanes of
its own, which no other link's energy depends on: the gradient of the sum of all energies then holds the
gradient of each of them. What a link hands on to those it carries is worked out once, for all their lanes.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, wraps
from typing import Any

import torch
from torch import Tensor

Leaf = Callable[[int, slice], Tensor]
"""Value of coordinate k in the lanes of a slice, shape (lanes, ...), as a variable to differentiate by."""


@dataclass(frozen=True, eq=False)
class Lanes:
    """Values of the coordinates of `path` in some lanes, each made when it is first asked for.

    dim: axes of what has lanes; whatever has fewer is the same in all of them
    parts: how many of the lanes belong to the link itself, and to each branch that it carries
    whole: the lanes that these are part number `part` of
    """

    rows: slice
    path: tuple[int, ...]
    leaf: Leaf
    dim: int
    parts: tuple[int, ...] = ()
    whole: "Lanes | None" = None
    part: int = 0
    variables: dict[int, Tensor] = field(default_factory=dict)
    states: dict[Callable[..., Any], Sequence[Any]] = field(default_factory=dict)

    def __getitem__(self, k: int) -> Tensor:
        if k not in self.path:
            raise ValueError(f"an energy asks for coordinate {k}, which is not on its path {self.path}")
        if k not in self.variables:
            self.variables[k] = self.leaf(k, self.rows)
        return self.variables[k]

    def divided(self, state: Any) -> Sequence[Any]:
        """Values in all these lanes, nested in tuples, for each part; what has no lanes is every part's."""
        if state.__class__ is tuple:
            columns = [self.divided(value) for value in state]
            return list(zip(*columns, strict=True)) if columns else [()] * len(self.parts)
        if torch.is_tensor(state) and state.dim() == self.dim:
            return state.split_with_sizes(self.parts)
        return [state] * len(self.parts)


@dataclass(frozen=True, eq=False)
class SharedValues:
    """One tensor for each coordinate, shared by all links whose energies are looked at."""

    values: Sequence[Tensor]
    states: dict[Callable[..., Any], Any] = field(default_factory=dict)

    def __getitem__(self, k: int) -> Tensor:
        return self.values[k]


def carried(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let a method of (q, ...) or (q, qd, ...), called for part of a link's lanes, run once for all."""

    @wraps(function)
    def part(*arguments: Any) -> Any:
        q = arguments[1]
        if isinstance(q, SharedValues):
            if function not in q.states:
                q.states[function] = function(*arguments)
            return q.states[function]
        if not isinstance(q, Lanes) or q.whole is None:
            return function(*arguments)
        if function not in q.whole.states:
            wide = [a.whole if isinstance(a, Lanes) else a for a in arguments]
            q.whole.states[function] = q.whole.divided(function(*wide))
        return q.whole.states[function][q.part]

    return part


@dataclass(frozen=True)
class Plan:
    """Which lanes are whose: each link's own, `counts` of them, then those of the branches it carries."""

    paths: tuple[tuple[int, ...], ...]
    parents: tuple[int | None, ...]
    counts: tuple[int, ...]

    @cached_property
    def lanes(self) -> int:
        """Lanes of all links together."""
        return sum(self.counts)

    @cached_property
    def totals(self) -> tuple[int, ...]:
        """Lanes of each link and of what it carries."""
        totals = list(self.counts)
        for j, parent in reversed(list(enumerate(self.parents))):
            if parent is not None:
                totals[parent] += totals[j]
        return tuple(totals)

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """First lane of each link."""
        starts: list[int] = []
        free: dict[int | None, int] = {None: 0}
        for count, total, parent in zip(self.counts, self.totals, self.parents, strict=True):
            starts.append(free[parent])
            free[len(starts) - 1] = free[parent] + count
            free[parent] += total
        return tuple(starts)

    @cached_property
    def branches(self) -> tuple[tuple[int, ...], ...]:
        """Links that hang on each link directly."""
        found: list[list[int]] = [[] for _ in self.parents]
        for j, parent in enumerate(self.parents):
            if parent is not None:
                found[parent].append(j)
        return tuple(map(tuple, found))

    def lay(self, leaf: Leaf, dim: int) -> "Motion":
        """Lanes of one quantity, q or qd, whose variables `leaf` makes, of `dim` axes."""
        whole: list[Lanes] = []
        own: list[Lanes] = []
        for j, (path, start, parent) in enumerate(zip(self.paths, self.starts, self.parents, strict=True)):
            parts = (self.counts[j], *(self.totals[branch] for branch in self.branches[j]))
            carrier = None if parent is None else whole[parent]
            part = 0 if parent is None else 1 + self.branches[parent].index(j)
            whole.append(Lanes(slice(start, start + sum(parts)), path, leaf, dim, parts, carrier, part))
            own.append(Lanes(slice(start, start + parts[0]), path, leaf, dim, (), whole[j]))
        return Motion(tuple(own), tuple(whole))


@dataclass(frozen=True)
class Motion:
    """One quantity in the lanes of every link: each one's `own`, and those with all that it carries."""

    own: tuple[Lanes, ...]
    whole: tuple[Lanes, ...]

    def places(self) -> Iterator[tuple[int, slice]]:
        """Coordinate and lanes of each variable."""
        return ((k, lanes.rows) for lanes in (*self.own, *self.whole) for k in lanes.variables)

    def variables(self) -> list[Tensor]:
        """All variables that were asked for, in the order of `places`."""
        return [v for lanes in (*self.own, *self.whole) for v in lanes.variables.values()]
