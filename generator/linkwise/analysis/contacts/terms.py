"""Terms of torques of a robot on contacts, packed as those of the free robot are."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.contacts.ground import GroundContacts, Standing
from linkwise.analysis.term_rows import NAMES, TermArrays
from linkwise.arrays import Array, Index


@dataclass(frozen=True, eq=False)
class _Kind:
    """Values of one kind: a block (joints, pairs) for joints that contacts load, then those of others."""

    rows: tuple[tuple[int, ...], ...]
    block: tuple[int, int]
    places: tuple[Index, Index]
    """Row and column in the block of each packed value of its joints."""
    sources: Index
    """Index of these packed values."""
    others: Index
    """Index of the packed values of the other joints."""

    @classmethod
    def of(cls, rows: Sequence[tuple[int, ...]], joints: Sequence[int]) -> "_Kind":
        """Return the kind for rows (i, j[, k], source) of the free robot."""
        mine = [row for row in rows if row[0] in joints]
        rest = [row for row in rows if row[0] not in joints]
        pairs = sorted({row[1:-1] for row in mine})
        place = {pair: at for at, pair in enumerate(pairs)}
        size = len(joints) * len(pairs)
        made = [(i, *pair, a * len(pairs) + b) for a, i in enumerate(joints) for b, pair in enumerate(pairs)]
        made += [(*row[:-1], size + at) for at, row in enumerate(rest)]
        return cls(
            tuple(sorted(made)),
            (len(joints), len(pairs)),
            (_index(joints.index(row[0]) for row in mine), _index(place[row[1:-1]] for row in mine)),
            _index(row[-1] for row in mine),
            _index(row[-1] for row in rest),
        )

    def left(self, packed: Array, standing: Standing, joints: Sequence[int], n: int) -> Array:
        """Return the values (S, count) that contacts leave, in the order of the sources of `rows`."""
        samples = len(packed)
        whole = np.zeros((samples, n, self.block[1]))
        whole[:, np.asarray(joints)[self.places[0]], self.places[1]] = packed[:, self.sources]
        block = standing.left(whole)[:, list(joints)].reshape(samples, -1)
        return np.concatenate([block, packed[:, self.others]], axis=1)


@dataclass(frozen=True, eq=False)
class ContactTerms:
    """Torque terms of a robot on contacts: each link's weight and motion load joints through the ground too.

    With T of `Standing.transfer`, each term c_ijk of the free robot becomes

        c^_ijk = c_ijk - sum_b T_ib c_bjk

    at joint i. It belongs to the link j and the cause k of c_bjk, and is no longer symmetric in i and k.
    """

    kinds: tuple[_Kind, ...]
    joints: tuple[int, ...]

    @classmethod
    def of(cls, free: TermArrays, contacts: GroundContacts) -> "ContactTerms":
        """Return the terms for those of the free robot."""
        kinds = tuple(_Kind.of(getattr(free, name), contacts.joints) for name in NAMES)
        return cls(kinds, contacts.joints)

    @property
    def rows(self) -> TermArrays:
        """Index (i, j[, k], source) of the values that `left` returns."""
        return TermArrays(*(kind.rows for kind in self.kinds))

    def left(self, packed: TermArrays, standing: Standing, n: int) -> TermArrays:
        """Return the values that contacts leave, from the packed ones of the free robot with n joints."""
        found = (
            kind.left(np.asarray(getattr(packed, name)), standing, self.joints, n)
            for name, kind in zip(NAMES, self.kinds, strict=True)
        )
        return TermArrays(*found)


def _index(numbers: Iterable[int]) -> Index:
    return np.fromiter(numbers, dtype=np.intp)
