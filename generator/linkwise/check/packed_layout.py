"""Where packed values belong by the manifest's paths, and packed values spread over dense arrays."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwise.check.compare import Entries
from linkwise.check.reference import Reference
from linkwise.package.load import Array

Rows = NDArray[np.intp]


@dataclass(frozen=True)
class IndexRows:
    """(i, j, k) of every packed c2, c1 and h1, (i, j) of every tau and g, in order."""

    c2: Rows
    c1: Rows
    tau: Rows
    h1: Rows

    @classmethod
    def of_paths(cls, paths: Sequence[Sequence[int]], linear: Sequence[int]) -> "IndexRows":
        """Link by link, then i, then k along the path; c2 for k from i on, h1 for links in `linear` only."""
        c1 = [(i, j, k) for j, path in enumerate(paths) for i in path for k in path]
        return cls(
            _table([row for row in c1 if row[0] <= row[2]], 3),
            _table(c1, 3),
            _table([(i, j) for j, path in enumerate(paths) for i in path], 2),
            _table([row for row in c1 if row[1] in linear], 3),
        )

    def of(self, what: str) -> Rows:
        """Indices of a quantity."""
        return {"c2": self.c2, "c1": self.c1, "c0": self.c1, "tau": self.tau, "g": self.tau, "h1": self.h1}[
            what
        ]

    def fields(self, packed: Any) -> dict[str, Array]:
        """What `packed` answers, by quantity; h1 only where there is any."""
        named = dict(zip(("c2", "c1", "g", "tau", "h1"), packed, strict=True))
        return (
            named if len(self.h1) or np.shape(named["h1"])[-1] else {k: named[k] for k in named if k != "h1"}
        )


def packed(what: str, value: Any, rows: Rows, reference: Reference, at: Rows) -> Entries:
    """Packed values (..., count) of samples `at`, of whose shape their batch is, beside the reference's."""
    value = np.asarray(value)
    picked, scale = (
        source[what][(at.reshape(-1, 1), *rows.T)] for source in (reference.values, reference.scales)
    )
    if value.shape != (*at.shape, len(rows)):
        return Entries(what, value, np.empty((*at.shape, len(rows))), scale)
    return Entries(what, value.reshape(picked.shape), picked, scale, rows)


def _table(rows: Sequence[Sequence[int]], width: int) -> Rows:
    return np.array(rows, dtype=np.intp).reshape(-1, width)
