"""Parts of wrenches on joints: every packed number, from joints and links in motion.

Matrix products answer for whole groups of links and joints; what is packed is picked from them.

A compiler makes one loop of many operations, but not across a matrix product. For it every pair of a link and
a joint on its way has the wrenches of `rigid`, written by components: the loop over pairs and samples
then reads each number once and computes all of them. What later loops pick from is stacked, so that it is
kept and not computed again.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..interface import Namespace, Numbers
from .kinematics import Twists, gather
from .rigid import (
    LinkNumbers,
    LinkStates,
    decomposition_columns,
    gradient_columns,
    gradient_matrices,
    link_matrices,
    second_rates,
)
from .tables import RuleTables

Vector = Numbers | Sequence[Numbers]
"""Components, (pairs, samples) each; a wrench has six: moment, then force."""
Columns = Numbers | Sequence[Vector]
"""Columns of a matrix."""


class Moment(NamedTuple):
    """Motion of joints and links, and the links' numbers, with samples side by side."""

    xp: Namespace
    tables: RuleTables
    numbers: LinkNumbers
    moved: Twists
    states: LinkStates

    def coefficients(self) -> list[Numbers]:
        """Return packed c2 and c1."""
        dense = _products(self.xp, self, self._matrices(), decomposition_columns(self.xp, self.moved))
        return [packed(self.xp, dense, positions) for positions in self.tables.positions[:2]]

    def gradient(self) -> list[Numbers]:
        """Return packed c0."""
        xp, tables = self.xp, self.tables
        matrices = gradient_matrices(xp, tables.links, self._matrices(), self.states.wrenches[:, 0])
        dense = _products(xp, self, matrices, gradient_columns(xp, self.moved))
        return [packed(xp, dense, tables.positions[2])]

    def own_bends(self) -> Numbers | None:
        """Return dS/dq . (wrench) of tau, S by its own coordinate, packed as tau; None without curves."""
        bends = self.moved.bends
        return (
            None if bends is None else self._replace(moved=self.moved._replace(screws=bends)).singles((4,))[0]
        )

    def singles(self, fields: Sequence[int]) -> list[Numbers]:
        """Return packed S_e . (wrench) of g or tau, or both."""
        xp = self.xp
        axes, wrenches = _outermost(xp, _screws(xp, self.moved)), _outermost(xp, self.states.wrenches)
        samples, joints, links = axes.shape[0], axes.shape[2], wrenches.shape[3]
        answer = xp.swapaxes(axes, 1, 2) @ wrenches.reshape(samples, 6, 2 * links)
        dense = answer.reshape(samples, joints * 2 * links)
        return [packed(xp, dense, self.tables.positions[field]) for field in fields]

    def _matrices(self) -> Numbers:
        return link_matrices(self.xp, self.tables.links, self.numbers, self.states.moments)


def _products(xp: Namespace, at: Moment, matrices: Numbers, columns: Numbers) -> Numbers:
    """Return S_e . (L column) for each group's links and any two joints e and f on its path.

    The answer is (samples, entries). Entries are ordered by e, link, column, f; groups stand in a row.
    """
    screws = _screws(xp, at.moved)
    left, axes, right = (_outermost(xp, a) for a in (matrices, screws, columns))
    samples, size, kinds = left.shape[0], left.shape[1], right.shape[2]
    answers = []
    for links, path in at.tables.groups:
        block, s, behind = (gather(a, i, -1) for a, i in ((left, links), (axes, path), (right, path)))
        count, depth = block.shape[-1], s.shape[-1]
        rows = xp.swapaxes(block.reshape(samples, size, 6 * count), 1, 2)
        wrench = rows @ behind.reshape(samples, size, kinds * depth)
        answer = xp.swapaxes(s, 1, 2) @ wrench.reshape(samples, 6, count * kinds * depth)
        answers.append(answer.reshape(samples, depth * count * kinds * depth))
    return xp.concat(answers, 1) if len(answers) > 1 else answers[0]


def _screws(xp: Namespace, moved: Twists) -> Numbers:
    """Return z and s of the joints, (6, joints, samples)."""
    return xp.concat([moved.screws[:3, 0, :-1], moved.screws[:3, 1, :-1]], 0)


def _outermost(xp: Namespace, a: Numbers) -> Numbers:
    """Return an array (..., samples) as (samples, ...), in one piece of memory."""
    shape, samples = tuple(a.shape[:-1]), a.shape[-1]
    flat: Any = xp.swapaxes(a.reshape(math.prod(shape), samples), 0, 1)
    flat = np.ascontiguousarray(flat) if isinstance(flat, np.ndarray) else flat.contiguous()
    outermost: Numbers = flat.reshape(samples, *shape)
    return outermost


def packed(xp: Namespace, values: Numbers, positions: Sequence[Numbers]) -> Numbers:
    """Return entries (samples, count) of values (samples, entries), or sums of some.

    For sums, a zero stands behind the values.
    """
    if len(positions) > 1:
        values = xp.concat([values, 0.0 * values[:, :1]], 1)
    found = gather(values, positions[0], -1)
    for index in positions[1:]:
        found = found + gather(values, index, -1)
    return found


class FusedMoment(NamedTuple):
    """Motion of joints and links, for compilers; its methods are those of `Moment`."""

    xp: Namespace
    tables: RuleTables
    moved: Twists
    states: LinkStates

    def coefficients(self) -> list[Numbers]:
        """Return packed c2 and c1."""
        link, (z, s), (zd, sd) = self._links(), *map(self._pairs, (self.moved.screws, self.moved.rates))
        c1 = _sum(link.inertial_wrench(zd, sd), link.turning(z))
        kept = self.xp.stack([*link.inertial_wrench(z, s), *c1], 0)
        entries = self.tables.entries[:2]
        return [self._gathered(w, rows) for w, rows in zip((kept[:6], kept[6:]), entries, strict=True)]

    def gradient(self) -> list[Numbers]:
        """Return packed c0: wrenches for joints behind joint f, then for it and those before."""
        moved, link = self.moved, self._links()
        (z, s), (zd, _), (zdd, sdd) = map(
            self._pairs, (moved.screws, moved.rates, second_rates(self.xp, moved))
        )
        after = _sum(link.inertial_wrench(zdd, sdd), [2.0 * a for a in link.turning(zd)])
        wrench = gather(self.states.wrenches[:, 0], self.tables.pairs[0])
        n, f = wrench[:3], wrench[3:]
        before = _sum(after, [*_sum(_cross(z, n), _cross(s, f)), *_cross(z, f)])
        kept = self.xp.stack([self.xp.concat(both, 0) for both in zip(after, before, strict=True)], 0)
        return [self._gathered(kept, self.tables.entries[2])]

    def own_bends(self) -> Numbers | None:
        """Return dS/dq . (wrench) of tau, S by its own coordinate, packed as tau; None without curves."""
        bends = self.moved.bends
        return (
            None if bends is None else self._replace(moved=self.moved._replace(screws=bends)).singles((4,))[0]
        )

    def singles(self, fields: Sequence[int]) -> list[Numbers]:
        """Return packed S_e . (wrench) of g or tau, or both."""
        wrenches = self.states.wrenches
        flat = wrenches.reshape(6, wrenches.shape[1] * wrenches.shape[2], wrenches.shape[3])
        return [self._gathered(flat, self.tables.entries[field]) for field in fields]

    def _links(self) -> "_Links":
        """Return the moments of each pair's link."""
        m, h, inertia, momentum, b = (gather(a, self.tables.pairs[0]) for a in self.states.moments)
        # Of a symmetric matrix each entry is read once.
        upper = [[inertia[min(i, k), max(i, k)] for i in range(3)] for k in range(3)]
        return _Links(m, h[:3], upper, momentum[:3], b)

    def _pairs(self, screws: Numbers) -> tuple[Numbers, Numbers]:
        """Return z and s of each pair's joint, from pairs of vectors (5, 2, frames, samples)."""
        found = gather(screws, self.tables.pairs[1])
        return found[:3, 0], found[:3, 1]

    def _gathered(self, wrenches: Numbers, entries: Sequence[tuple[Numbers, Numbers]]) -> Numbers:
        """Return sums of S_e . (wrench), of wrenches (6, rows, samples), as (samples, count)."""
        screws = self.moved.screws
        parts = [
            gather(screws[axis % 3, axis // 3], e) * gather(wrenches[axis], row)
            for e, row in entries
            for axis in range(6)
        ]
        return self.xp.swapaxes(sum(parts[1:], parts[0]), 0, 1)


class _Links(NamedTuple):
    """Link of each pair: m, h, I, P and B of `LinkMoments`."""

    m: Numbers
    h: Vector
    inertia: Columns
    momentum: Vector
    b: Columns

    def inertial_wrench(self, z: Vector, s: Vector) -> Vector:
        """Return N = h x s + I z over f = m s + z x h."""
        moment = _sum(_cross(self.h, s), _applied(self.inertia, z))
        return [*moment, *_sum([self.m * a for a in s], _cross(z, self.h))]

    def turning(self, z: Vector) -> Vector:
        """Return N = B z over f = z x P."""
        return [*_applied(self.b, z), *_cross(z, self.momentum)]


def _applied(matrix: Columns, z: Vector) -> Vector:
    """Return a matrix, columns first, times a vector."""
    return [matrix[0][i] * z[0] + matrix[1][i] * z[1] + matrix[2][i] * z[2] for i in range(3)]


def _cross(a: Vector, b: Vector) -> Vector:
    return [a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3] for i in range(3)]


def _sum(a: Vector, b: Vector) -> Vector:
    return [x + y for x, y in zip(a, b, strict=True)]
