"""Parts of wrenches on joints: every packed number, from joints and links in motion.

Matrix products answer for whole groups of links and joints; what is packed is picked from them.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .kinematics import Twists, taken
from .rigid_rule import (
    LinkNumbers,
    LinkStates,
    decomposition_columns,
    gradient_columns,
    gradient_matrices,
    link_matrices,
)
from .rule_tables import RuleTables


class Moment(NamedTuple):
    """Samples side by side: how joints and links move, and with which numbers."""

    xp: Any
    tables: RuleTables
    numbers: LinkNumbers
    moved: Twists
    states: LinkStates

    def coefficients(self) -> list[Any]:
        """Packed c2 and c1."""
        dense = _products(self.xp, self, self._matrices(), decomposition_columns(self.xp, self.moved))
        return [packed(self.xp, dense, positions) for positions in self.tables.positions[:2]]

    def gradient(self) -> list[Any]:
        """Packed c0."""
        xp, tables = self.xp, self.tables
        matrices = gradient_matrices(xp, tables.links, self._matrices(), self.states.wrenches[:, 0])
        dense = _products(xp, self, matrices, gradient_columns(xp, self.moved))
        return [packed(xp, dense, tables.positions[2])]

    def own_bends(self) -> Any:
        """What tau's wrench does along how S changes by its own coordinate, packed as tau; or None."""
        bends = self.moved.bends
        return (
            None if bends is None else self._replace(moved=self.moved._replace(screws=bends)).singles((4,))[0]
        )

    def singles(self, fields: Sequence[int]) -> list[Any]:
        """Packed S_e . (wrench) of g or tau, or both."""
        xp = self.xp
        axes, wrenches = _outermost(xp, _screws(xp, self.moved)), _outermost(xp, self.states.wrenches)
        samples, joints, links = axes.shape[0], axes.shape[2], wrenches.shape[3]
        answer = xp.swapaxes(axes, 1, 2) @ wrenches.reshape(samples, 6, 2 * links)
        dense = answer.reshape(samples, joints * 2 * links)
        return [packed(xp, dense, self.tables.positions[field]) for field in fields]

    def _matrices(self) -> Any:
        return link_matrices(self.xp, self.tables.links, self.numbers, self.states.moments)


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
