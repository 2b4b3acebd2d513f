"""Ends of one kind of shares over bodies that could exist."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .feasible_bodies import End, FeasibleBodies
from .identifiability import NONE, Masks
from .pseudo_inertia import Floats

Place = tuple[int, ...]


class Asked(NamedTuple):
    """Shares that are asked for, and over which bodies."""

    own: Floats
    """Parameters of the robot's own links, (N, 10)."""
    bodies: FeasibleBodies
    joints: tuple[int, ...]
    """Loaded joints."""
    measured: tuple[int, ...]
    """Joints whose torques are measured, of shares that are torques."""

    def least(self, row: Floats, place: Place) -> End:
        """Return the least share at a place, by its row (10,)."""
        y = np.zeros_like(self.own)
        y[place[1]] = row
        return self.bodies.least(y, may_end=place[0] in self.measured)


@dataclass(frozen=True, eq=False)
class ShareEnds:
    """Ends of one kind of shares; of those that were not asked for, not a number."""

    value: Floats
    least: Floats
    greatest: Floats
    gap: Floats
    sized: Masks
    pairs: Mapping[Place, tuple[Floats, Floats]]

    @classmethod
    def of(cls, rows: Floats, follows: Masks, asked: Asked) -> "ShareEnds":
        """Return the ends of shares with these rows (m, N, ..., 10)."""
        over = (slice(None), *(None,) * (rows.ndim - 3))
        value = (rows * asked.own[over]).sum(-1)
        least, greatest, gap = value.copy(), value.copy(), np.zeros_like(value)
        sized, pairs = np.zeros(value.shape, dtype=bool), {}
        for place in _leaning(rows * asked.bodies.sizes[over], follows):
            if place[0] not in asked.joints:
                least[place] = greatest[place] = gap[place] = np.nan
                continue
            low, high = (asked.least(sign * rows[place], place) for sign in (1.0, -1.0))
            least[place], greatest[place] = low.bound, -high.bound
            gap[place], sized[place] = max(_gap(low), _gap(high)), low.sized or high.sized
            pairs[place] = low.parameters, high.parameters
        return cls(value, least, greatest, gap, sized, pairs)


def _leaning(rows: Floats, follows: Masks) -> Iterator[Place]:
    """Yield the places of shares that are not zero and lean on the file's masses.

    rows: rows of shares, in units of the parameters' sizes
    """
    lengths = np.linalg.norm(rows, axis=-1)
    for place in np.argwhere((lengths > NONE * lengths.max(initial=0.0)) & ~follows).tolist():
        yield tuple(place)


def _gap(end: End) -> float:
    return max(end.attained - end.bound, 0.0) if np.isfinite(end.bound) else 0.0
