"""Graphs too large to read, folded: the operations of one line, or of one link, drawn as one node.

Operations that one part needs, and no other, are never in one node with operations that several parts need,
so that no colour is lost. By line: operations that compute one line, or differentiate it equally often. By
link: operations of a link's file, of equal derivative, and everything that a part has for itself.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from linkwise.graphs.overlay import Overlay

FOLDS = ("none", "line", "link")
"""Ways to fold, from nothing to most."""
LEGIBLE = 110
"""Most nodes of a picture that is still legible."""


@dataclass(frozen=True)
class DrawnNode:
    """One node of a picture: a leaf, an operation, or several operations.

    part: number of the one part that needs it, None if several do
    inner: the operations (or the leaf) themselves
    """

    part: int | None
    source: str
    derivative: int
    inner: tuple[Any, ...]


@dataclass(frozen=True)
class Drawing:
    """Nodes in order, and for each key of the overlay the number of the node that shows it."""

    nodes: tuple[DrawnNode, ...]
    place: dict[str, int]

    def edges(self) -> list[tuple[int, int, int]]:
        """Return edges (from, to, number of values that go there)."""
        counts: dict[tuple[int, int], int] = {}
        for at, node in enumerate(self.nodes):
            for operation in node.inner:
                for operand in getattr(operation, "operands", ()):
                    if (before := self.place[operand]) != at:
                        counts[before, at] = counts.get((before, at), 0) + 1
        return [(a, b, count) for (a, b), count in counts.items()]


def folded(graph: Overlay, fold: str | None = None) -> Drawing:
    """Return the drawing of an overlay, folded.

    Without a `fold`, it has the least that makes the drawing legible, or the most there is.
    """
    for choice in FOLDS if fold is None else (fold,):
        drawing = _drawing(graph, choice)
        if len(drawing.nodes) <= LEGIBLE:
            break
    return drawing


def _drawing(graph: Overlay, fold: str) -> Drawing:
    groups: dict[Hashable, list[Any]] = {}
    for key, node in graph.nodes.items():
        groups.setdefault(_group(graph, key, node, fold), []).append(node)
    nodes: list[DrawnNode] = []
    place: dict[str, int] = {}
    for inner in groups.values():
        first = inner[0]
        users = graph.users[first.key]
        source, derivative = getattr(first, "source", ""), getattr(first, "derivative", 0)
        if len({(node.source, node.derivative) for node in inner if len(inner) > 1}) > 1:
            # They are those of a link's file, or all that a part has for itself.
            source = "" if len(users) == 1 else source.partition(":")[0]
            derivative = 0 if len(users) == 1 else derivative
        place.update({node.key: len(nodes) for node in inner})
        nodes.append(DrawnNode(users[0] if len(users) == 1 else None, source, derivative, tuple(inner)))
    return Drawing(tuple(nodes), place)


def _group(graph: Overlay, key: str, node: Any, fold: str) -> Hashable:
    """Return the key that all nodes drawn as one have in common."""
    if fold == "none" or not hasattr(node, "operands"):
        return key
    users = graph.users[key]
    if fold == "line":
        # A product with a motion belongs to no line: it shows what is computed, and stays.
        alone = users if len(users) == 1 else None
        return (alone, node.derivative, node.source) if node.source else key
    return users if len(users) == 1 else (None, node.derivative, node.source.partition(":")[0])
