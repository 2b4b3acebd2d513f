"""Many points of a motion side by side, so that one sweep differentiates the Lagrangians of all links.

A lane is one velocity at which one link's energies are evaluated, for every sample. Each link has lanes of
its own, which no other link's energy depends on: the gradient of the sum of all energies then holds the
gradient of each of them. What a link passes on to the links it carries is computed once, for all their lanes.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, wraps
from typing import NamedTuple, TypeVar, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

Indices = NDArray[np.intp]

NOWHERE = -1
"""Index of a lane that holds zeros."""

Method = TypeVar("Method", bound=Callable[..., object])

Leaf = Callable[[int, slice], Tensor]
"""Value of coordinate k in the lanes of a slice, shape (lanes, ...), as a variable to differentiate by."""


@dataclass(frozen=True, eq=False)
class Lanes:
    """Values of the coordinates of `path` in some lanes, each made when it is first asked for.

    dim: number of axes of a tensor that has lanes; a tensor with fewer axes is the same in all lanes
    parts: how many of the lanes belong to the link itself, and to each branch that it carries
    whole: the lanes of which these are part number `part`
    """

    rows: slice
    path: tuple[int, ...]
    leaf: Leaf
    dim: int
    parts: tuple[int, ...] = ()
    whole: "Lanes | None" = None
    part: int = 0
    variables: dict[int, Tensor] = field(default_factory=dict)
    states: dict[Callable[..., object], Sequence[object]] = field(default_factory=dict)

    def __getitem__(self, k: int) -> Tensor:
        if k not in self.path:
            raise ValueError(f"an energy asks for coordinate {k}, which is not on its path {self.path}")
        if k not in self.variables:
            self.variables[k] = self.leaf(k, self.rows)
        return self.variables[k]

    def divided(self, state: object) -> Sequence[object]:
        """Split values in all these lanes, nested in tuples, by part.

        A value without lanes goes to every part.
        """
        if state.__class__ is tuple:
            columns = [self.divided(value) for value in state]
            return list(zip(*columns, strict=True)) if columns else [()] * len(self.parts)
        if torch.is_tensor(state) and state.dim() == self.dim:
            return state.split_with_sizes(self.parts)
        return [state] * len(self.parts)


@dataclass(frozen=True, eq=False)
class SharedValues:
    """One tensor for each coordinate, shared by all links whose energies are evaluated."""

    values: Sequence[Tensor]
    states: dict[Callable[..., object], object] = field(default_factory=dict)

    def __getitem__(self, k: int) -> Tensor:
        return self.values[k]


def carried(function: Method) -> Method:
    """Let a method of (q, ...) or (q, qd, ...), called for part of a link's lanes, run once for all."""

    @wraps(function)
    def part(*arguments: object) -> object:
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

    return cast(Method, part)


class Plan(NamedTuple):
    """Order of the lanes: each link's own, `counts` of them, then those of the branches it carries.

    A compiler makes one of its fields, as it cannot follow how these are computed once and kept.
    """

    paths: tuple[tuple[int, ...], ...]
    parents: tuple[int | None, ...]
    counts: tuple[int, ...]
    totals: tuple[int, ...]
    """Number of lanes of each link and of all links that it carries."""
    starts: tuple[int, ...]
    """First lane of each link."""
    branches: tuple[tuple[int, ...], ...]
    """Links that each link carries directly."""
    lanes: int
    """Number of lanes of all links together."""

    @classmethod
    def of(
        cls, paths: tuple[tuple[int, ...], ...], parents: tuple[int | None, ...], counts: tuple[int, ...]
    ) -> "Plan":
        """Return the plan for links with so many lanes each."""
        totals, starts = list(counts), list[int]()
        branches: list[list[int]] = [[] for _ in parents]
        for j, parent in reversed(list(enumerate(parents))):
            if parent is not None:
                totals[parent] += totals[j]
        free: dict[int | None, int] = {None: 0}
        for j, (count, parent) in enumerate(zip(counts, parents, strict=True)):
            starts.append(free[parent])
            free[j] = free[parent] + count
            free[parent] += totals[j]
            if parent is not None:
                branches[parent].append(j)
        carried_by = tuple(map(tuple, branches))
        return cls(paths, parents, counts, tuple(totals), tuple(starts), carried_by, sum(counts))

    def lay(self, leaf: Leaf, dim: int) -> "Motion":
        """Return the lanes of one quantity, q or qd, whose variables, of `dim` axes, `leaf` makes."""
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
    """One quantity in the lanes of every link: its `own`, and the `whole` with all that it carries."""

    own: tuple[Lanes, ...]
    whole: tuple[Lanes, ...]

    def places(self) -> Iterator[tuple[int, slice]]:
        """Yield coordinate and lanes of each variable."""
        return ((k, lanes.rows) for lanes in (*self.own, *self.whole) for k in lanes.variables)

    def variables(self) -> list[Tensor]:
        """Return all variables that were asked for, in the order of `places`."""
        return [v for lanes in (*self.own, *self.whole) for v in lanes.variables.values()]


@dataclass(frozen=True)
class LaneEntries:
    """Pairs (i, k) of coordinates of every link's path, and the lanes that belong to them."""

    paths: tuple[tuple[int, ...], ...]
    parents: tuple[int | None, ...]

    @cached_property
    def plan(self) -> Plan:
        """Plan with a lane of link j for each k on its path."""
        return Plan.of(self.paths, self.parents, tuple(map(len, self.paths)))

    @cached_property
    def single(self) -> Plan:
        """Plan with one lane for each link."""
        return Plan.of(self.paths, self.parents, (1,) * len(self.paths))

    @cached_property
    def paths_in_lanes(self) -> tuple[Indices, Indices]:
        """Coordinates i of each link's path, link by link, and the link's lane of `single`."""
        lanes = np.repeat(self.single.starts, [len(path) for path in self.paths])
        return np.array([i for path in self.paths for i in path], np.intp), lanes.astype(np.intp)

    @cached_property
    def lanes(self) -> Indices:
        """Rows (link, k): the lane at e_k."""
        rows = [(j, k) for j, path in enumerate(self.paths) for k in path]
        return np.array(rows, np.intp).reshape(-1, 2)

    @cached_property
    def pairs(self) -> Indices:
        """Rows (i, k, lanes at e_i and e_k), link by link."""
        rows = [
            (i, k, start + a, start + b)
            for path, start in zip(self.paths, self.plan.starts, strict=True)
            for a, i in enumerate(path)
            for b, k in enumerate(path)
        ]
        return np.array(rows, np.intp).reshape(-1, 4)

    @cached_property
    def upper(self) -> Indices:
        """Pairs with i <= k."""
        return np.flatnonzero(self.pairs[:, 0] <= self.pairs[:, 1])


class Rows:
    """Values in the lanes of variables, by coordinate and lane; zeros where no variable was asked for.

    lanes: number of lanes of the plan, whichever of them an energy asks for
    """

    def __init__(
        self,
        places: Iterable[tuple[int, slice]],
        values: Sequence[Tensor],
        lanes: int,
        n: int,
        like: Tensor,
    ) -> None:
        self.values = torch.cat([*values, like.new_zeros(1, *like.shape)])
        self.tables: list[Indices] = []
        none, at = len(self.values) - 1, 0
        for k, rows in places:
            room = (t for t in self.tables if (t[rows, k] == none).all())
            found = next(room, None)
            if found is None:
                found = np.full((lanes + 1, n), none)  # the last row is NOWHERE's
                self.tables.append(found)
            found[rows, k] = np.arange(at, at + rows.stop - rows.start)
            at += rows.stop - rows.start

    def __call__(self, k: Indices, lanes: Indices) -> Tensor:
        """Return the value of coordinate k[e] in lane lanes[e] for each entry e, shape (entries, ...)."""
        found = [pick(self.values, table[lanes, k]) for table in self.tables]
        return sum(found[1:], found[0]) if found else pick(self.values, 0 * k)


def pick(values: Tensor, rows: Indices) -> Tensor:
    """Return these rows of values."""
    return values.index_select(0, torch.from_numpy(rows).to(values.device))
