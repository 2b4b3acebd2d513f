"""Parts of wrenches on joints: every packed number, from joints and links in motion.

Eager operations take matrix products, of whole groups of links and joints, and pick what is packed; where a
compiler makes one loop of many operations, every pair of a link and a joint has its own wrenches instead.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .kinematics import Twists, taken
from .rigid_rule import (
    LinkMoments,
    LinkNumbers,
    LinkStates,
    decomposition_columns,
    decomposition_wrenches,
    gradient_columns,
    gradient_matrices,
    gradient_wrenches,
    link_matrices,
)
from .rule_tables import RuleTables, Space


class Moment(NamedTuple):
    """Samples side by side: how joints and links move, and with which numbers."""

    space: Space
    tables: RuleTables
    numbers: LinkNumbers
    moved: Twists
    states: LinkStates

    def coefficients(self) -> list[Any]:
        """Packed c2 and c1."""
        xp, tables, moments = self.space.xp, self.tables, self.states.moments
        if self.space.fuses:
            links, joints = tables.pairs
            wrenches = decomposition_wrenches(xp, _of_pairs(moments, links), joints, self.moved)
            return [_gathered(self, w, rows) for w, rows in zip(wrenches, tables.entries[:2], strict=True)]
        matrices = link_matrices(xp, tables.links, self.numbers, moments)
        dense = _products(xp, self, matrices, decomposition_columns(xp, self.moved))
        return [packed(xp, dense, positions) for positions in tables.positions[:2]]

    def gradient(self) -> list[Any]:
        """Packed c0."""
        xp, tables, moments = self.space.xp, self.tables, self.states.moments
        wrench = self.states.wrenches[:, 0]
        if self.space.fuses:
            links, joints = tables.pairs
            moments, wrench = _of_pairs(moments, links), taken(wrench, links)
            wrenches = gradient_wrenches(xp, moments, joints, self.moved, wrench)
            return [_gathered(self, wrenches, tables.entries[2])]
        matrices = link_matrices(xp, tables.links, self.numbers, moments)
        matrices = gradient_matrices(xp, tables.links, matrices, wrench)
        dense = _products(xp, self, matrices, gradient_columns(xp, self.moved))
        return [packed(xp, dense, tables.positions[2])]

    def singles(self, fields: Sequence[int]) -> list[Any]:
        """Packed S_e . (wrench) of g or tau, or both."""
        xp, tables = self.space.xp, self.tables
        if self.space.fuses:
            flat = self.states.wrenches.reshape(6, -1, self.states.wrenches.shape[-1])
            return [_gathered(self, flat, tables.entries[field]) for field in fields]
        axes, wrenches = _outermost(xp, _screws(xp, self.moved)), _outermost(xp, self.states.wrenches)
        samples, joints, links = axes.shape[0], axes.shape[2], wrenches.shape[3]
        answer = xp.swapaxes(axes, 1, 2) @ wrenches.reshape(samples, 6, 2 * links)
        dense = answer.reshape(samples, joints * 2 * links)
        return [packed(xp, dense, tables.positions[field]) for field in fields]


def _of_pairs(moments: LinkMoments, links: Any) -> LinkMoments:
    """The moments of each pair's link."""
    return LinkMoments(*(taken(a, links) for a in moments))


def _gathered(at: Moment, wrenches: Any, entries: Sequence[tuple[Any, Any]]) -> Any:
    """Sums of S_e . (wrench), of wrenches (6, rows, samples), as (samples, count)."""
    screws = at.moved.screws
    parts = [
        taken(screws[axis % 3, axis // 3], e) * taken(wrenches[axis], row)
        for e, row in entries
        for axis in range(6)
    ]
    return sum(parts[1:], parts[0]).swapaxes(0, 1)


def _products(xp: Any, at: Moment, matrices: Any, columns: Any) -> Any:
    """S_e . (L column) for each group's links and any two joints e and f on its path, (samples, entries).

    Entries are ordered by e, link, column, f; groups stand in a row.
    """
    screws = _screws(xp, at.moved)
    left, axes, right = (_outermost(xp, a) for a in (matrices, screws, columns))
    samples, size, kinds = left.shape[0], left.shape[1], right.shape[2]
    answers = []
    for links, path in at.tables.groups:
        block, s, behind = (taken(a, i, -1) for a, i in ((left, links), (axes, path), (right, path)))
        count, depth = block.shape[-1], s.shape[-1]
        rows = xp.swapaxes(block.reshape(samples, size, 6 * count), 1, 2)
        wrench = rows @ behind.reshape(samples, size, kinds * depth)
        answer = xp.swapaxes(s, 1, 2) @ wrench.reshape(samples, 6, count * kinds * depth)
        answers.append(answer.reshape(samples, depth * count * kinds * depth))
    return xp.concat(answers, 1) if len(answers) > 1 else answers[0]


def _screws(xp: Any, moved: Twists) -> Any:
    """z and s of the joints, (6, joints, samples)."""
    return xp.concat([moved.screws[:3, 0, :-1], moved.screws[:3, 1, :-1]], 0)


def _outermost(xp: Any, a: Any) -> Any:
    """An array (..., samples) as (samples, ...), in one piece of memory."""
    shape, samples = tuple(a.shape[:-1]), a.shape[-1]
    flat = xp.swapaxes(a.reshape(math.prod(shape), samples), 0, 1)
    flat = np.ascontiguousarray(flat) if isinstance(flat, np.ndarray) else flat.contiguous()
    return flat.reshape(samples, *shape)


def packed(xp: Any, values: Any, positions: Sequence[Any]) -> Any:
    """Entries (samples, count) of values (samples, entries), or sums of some; behind them stands a zero."""
    if len(positions) > 1:
        values = xp.concat([values, 0.0 * values[:, :1]], 1)
    first, *others = (taken(values, index, -1) for index in positions)
    return sum(others, first)
