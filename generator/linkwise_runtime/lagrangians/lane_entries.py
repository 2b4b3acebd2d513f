"""Where the entries of packed results stand among the lanes of all links."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from .lanes import Plan

Indices = NDArray[np.intp]

NOWHERE = -1
"""A lane that holds zeros."""


@dataclass(frozen=True)
class LaneEntries:
    """Pairs (i, k) of coordinates of every link's path, and the lanes that belong to them.

    linear: whether each link's kinetic energy has terms linear in the velocities
    """

    paths: tuple[tuple[int, ...], ...]
    parents: tuple[int | None, ...]
    linear: tuple[bool, ...]

    @cached_property
    def plan(self) -> Plan:
        """d lanes of link j at e_k; d + 1 more at rest for its linear terms."""
        counts = (len(path) * (1 + more) + more for path, more in zip(self.paths, self.linear, strict=True))
        return Plan(self.paths, self.parents, tuple(counts))

    @cached_property
    def single(self) -> Plan:
        """One lane for each link."""
        return Plan(self.paths, self.parents, (1,) * len(self.paths))

    @cached_property
    def paths_in_lanes(self) -> tuple[Indices, Indices]:
        """Coordinates i of each link's path, link by link, and the link's lane of `single`."""
        lanes = np.repeat(self.single.starts, [len(path) for path in self.paths])
        return np.array([i for path in self.paths for i in path], np.intp), lanes.astype(np.intp)

    @cached_property
    def lanes(self) -> Indices:
        """Rows (link, k, kind): kind 0 at e_k, 1 at rest along qd (no k), 2 at rest along e_k."""
        rows = np.zeros((self.plan.lanes, 3), np.intp)
        for j, (path, start) in enumerate(zip(self.paths, self.plan.starts, strict=True)):
            kinds = [(j, k, 0) for k in path]
            if self.linear[j]:
                kinds += [(j, NOWHERE, 1), *((j, k, 2) for k in path)]
            rows[start : start + len(kinds)] = kinds
        return rows

    @cached_property
    def pairs(self) -> Indices:
        """Rows (i, k, lanes at e_i and e_k, lanes at rest along qd, e_i and e_k), link by link."""
        rows = []
        for path, start, linear in zip(self.paths, self.plan.starts, self.linear, strict=True):
            d = len(path)
            rest = start + d
            for a, i in enumerate(path):
                for b, k in enumerate(path):
                    still = (rest, rest + 1 + a, rest + 1 + b) if linear else (NOWHERE,) * 3
                    rows.append((i, k, start + a, start + b, *still))
        return np.array(rows, np.intp).reshape(-1, 7)

    @cached_property
    def upper(self) -> Indices:
        """Pairs with i <= k."""
        return np.flatnonzero(self.pairs[:, 0] <= self.pairs[:, 1])

    @cached_property
    def moving(self) -> Indices:
        """Pairs of links with linear terms."""
        return np.flatnonzero(self.pairs[:, 4] != NOWHERE)


class Rows:
    """Values in the lanes of variables, by coordinate and lane; zeros where no variable was asked for.

    lanes: how many the plan has, whichever of them an energy asks for
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
        """Value of coordinate k[e] in lane lanes[e] for each entry e, shape (entries, ...)."""
        found = [pick(self.values, table[lanes, k]) for table in self.tables]
        return sum(found[1:], found[0]) if found else pick(self.values, 0 * k)


def pick(values: Tensor, rows: Indices) -> Tensor:
    """Rows of values."""
    return values.index_select(0, torch.from_numpy(rows).to(values.device))
