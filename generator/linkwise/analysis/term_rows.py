"""Torque terms that a model has values of, and their places among its packed values."""

from typing import NamedTuple

from linkwise_runtime.structure import Layout


class TermRows(NamedTuple):
    """Rows (i, j, source), or (i, j, k, source), of each kind of term, sorted.

    The source is the term's place among the packed values.
    """

    acceleration: tuple[tuple[int, ...], ...]
    velocity: tuple[tuple[int, ...], ...]
    gravity: tuple[tuple[int, ...], ...]
    torque: tuple[tuple[int, ...], ...]


def term_rows(layout: Layout) -> TermRows:
    """Return the rows of all terms of a layout."""

    def numbered(rows: list[list[int]]) -> tuple[tuple[int, ...], ...]:
        return tuple(sorted((*row, at) for at, row in enumerate(rows)))

    return TermRows(
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
