"""Torque terms that a model has values of, and their places among its packed values."""

from typing import Any, NamedTuple

from linkwise_runtime.structure import Layout


class TermArrays(NamedTuple):
    """Something of each kind of term, by the names that `Layout` and packed values have for these."""

    acceleration: Any
    velocity: Any
    gravity: Any
    torque: Any


NAMES = TermArrays._fields


def term_rows(layout: Layout) -> TermArrays:
    """Return rows (i, j, source), or (i, j, k, source), of each kind of term of a layout, sorted.

    The source is the term's place among the packed values.
    """

    def numbered(rows: list[list[int]]) -> tuple[tuple[int, ...], ...]:
        return tuple(sorted((*row, at) for at, row in enumerate(rows)))

    return TermArrays(
        tuple(mirrored(layout)),
        numbered(layout.velocity.tolist()),
        numbered(layout.gravity.tolist()),
        numbered(layout.torque.tolist()),
    )


def mirrored(layout: Layout) -> list[tuple[int, int, int, int]]:
    """Return all (i, j, k, source) of c2, sorted: only i ≤ k is stored, and c2 is symmetric in i and k."""
    rows = set()
    for source, (i, j, k) in enumerate(layout.acceleration.tolist()):
        rows |= {(i, j, k, source), (k, j, i, source)}
    return sorted(rows)
