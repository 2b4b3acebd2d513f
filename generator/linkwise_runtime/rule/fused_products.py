"""Packed numbers of the rigid-link rule for a compiler, which makes one loop of many operations.

A matrix product is a wall to it. So every pair of a link and a joint on its way has the wrenches of
`rigid_rule`, written by components: the loop over pairs and samples then reads each number once and works out
all of them. What later loops pick from is stacked, which makes it kept and not worked out again.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from .kinematics import Twists, taken
from .rigid_rule import LinkStates, second_rates
from .rule_tables import RuleTables

Vector = Sequence[Any]
"""Components, (pairs, samples) each; of a wrench six: moment, then force."""


class FusedMoment(NamedTuple):
    """How joints and links move; its methods are those of `Moment`."""

    xp: Any
    tables: RuleTables
    moved: Twists
    states: LinkStates

    def coefficients(self) -> list[Any]:
        """Packed c2 and c1."""
        link, (z, s), (zd, sd) = self._links(), *map(self._pairs, (self.moved.screws, self.moved.rates))
        c1 = _sum(link.accelerated(zd, sd), link.turning(z))
        kept = self.xp.stack([*link.accelerated(z, s), *c1], 0)
        entries = self.tables.entries[:2]
        return [self._gathered(w, rows) for w, rows in zip((kept[:6], kept[6:]), entries, strict=True)]

    def gradient(self) -> list[Any]:
        """Packed c0: wrenches for joints behind joint f, then for it and those before."""
        moved, link = self.moved, self._links()
        (z, s), (zd, _), (zdd, sdd) = map(
            self._pairs, (moved.screws, moved.rates, second_rates(self.xp, moved))
        )
        after = _sum(link.accelerated(zdd, sdd), [2.0 * a for a in link.turning(zd)])
        wrench = taken(self.states.wrenches[:, 0], self.tables.pairs[0])
        n, f = wrench[:3], wrench[3:]
        before = _sum(after, [*_sum(_cross(z, n), _cross(s, f)), *_cross(z, f)])
        kept = self.xp.stack([self.xp.concat(both, 0) for both in zip(after, before, strict=True)], 0)
        return [self._gathered(kept, self.tables.entries[2])]

    def own_bends(self) -> Any:
        """What tau's wrench does along how S changes by its own coordinate, packed as tau; or None."""
        bends = self.moved.bends
        return (
            None if bends is None else self._replace(moved=self.moved._replace(screws=bends)).singles((4,))[0]
        )

    def singles(self, fields: Sequence[int]) -> list[Any]:
        """Packed S_e . (wrench) of g or tau, or both."""
        wrenches = self.states.wrenches
        flat = wrenches.reshape(6, wrenches.shape[1] * wrenches.shape[2], wrenches.shape[3])
        return [self._gathered(flat, self.tables.entries[field]) for field in fields]

    def _links(self) -> "_Links":
        """The moments of each pair's link."""
        m, h, inertia, momentum, b = (taken(a, self.tables.pairs[0]) for a in self.states.moments)
        # Of a symmetric matrix each entry is read once.
        upper = [[inertia[min(i, k), max(i, k)] for i in range(3)] for k in range(3)]
        return _Links(m, h[:3], upper, momentum[:3], b)

    def _pairs(self, screws: Any) -> tuple[Any, Any]:
        """z and s of each pair's joint, of pairs of vectors (5, 2, frames, samples)."""
        found = taken(screws, self.tables.pairs[1])
        return found[:3, 0], found[:3, 1]

    def _gathered(self, wrenches: Any, entries: Sequence[tuple[Any, Any]]) -> Any:
        """Sums of S_e . (wrench), of wrenches (6, rows, samples), as (samples, count)."""
        screws = self.moved.screws
        parts = [
            taken(screws[axis % 3, axis // 3], e) * taken(wrenches[axis], row)
            for e, row in entries
            for axis in range(6)
        ]
        return sum(parts[1:], parts[0]).swapaxes(0, 1)


class _Links(NamedTuple):
    """The link of each pair: m, h, I, P and B of `LinkMoments`."""

    m: Any
    h: Vector
    inertia: Sequence[Vector]
    momentum: Vector
    b: Sequence[Vector]

    def accelerated(self, z: Vector, s: Vector) -> Vector:
        """N = h x s + I z over f = m s + z x h."""
        moment = _sum(_cross(self.h, s), _applied(self.inertia, z))
        return [*moment, *_sum([self.m * a for a in s], _cross(z, self.h))]

    def turning(self, z: Vector) -> Vector:
        """N = B z over f = z x P."""
        return [*_applied(self.b, z), *_cross(z, self.momentum)]


def _applied(matrix: Sequence[Vector], z: Vector) -> Vector:
    """A matrix, columns first, times a vector."""
    return [matrix[0][i] * z[0] + matrix[1][i] * z[1] + matrix[2][i] * z[2] for i in range(3)]


def _cross(a: Vector, b: Vector) -> Vector:
    return [a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3] for i in range(3)]


def _sum(a: Vector, b: Vector) -> Vector:
    return [x + y for x, y in zip(a, b, strict=True)]
