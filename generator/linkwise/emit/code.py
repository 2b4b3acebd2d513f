"""Straight-line code: a graph's outputs as assignments and final expressions."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from linkwise.emit.printer import ATOM, Printer, Text
from linkwise.graph.expression import Graph, Node, operands, reachable

MAX_WIDTH = 88
"""An expression that would grow longer than this gets a name."""


@dataclass(frozen=True)
class Code:
    """Assignments (variable, expression) in order, the outputs' expressions, and the inputs used."""

    assignments: tuple[tuple[str, str], ...]
    outputs: tuple[str, ...]
    symbols: frozenset[str]


def straight_line(graph: Graph, outputs: Sequence[Node], printer: Printer) -> Code:
    """Code for `outputs`: what is used twice or has a name of its own becomes a variable, the rest is inlined."""
    order = reachable(graph, outputs)
    uses = Counter(operand for node in order for operand in operands(graph.nodes[node]))
    kept = set(outputs)
    names = _Names(graph.nodes[node][1] for node in order if graph.nodes[node][0] == "symbol")
    texts: dict[Node, Text] = {}
    assignments: list[tuple[str, str]] = []
    symbols = set()
    for node in order:
        entry = graph.nodes[node]
        text, precedence = printer.print(entry, tuple(texts[o] for o in operands(entry)))
        if entry[0] == "symbol":
            symbols.add(text)
        leaf = entry[0] in ("const", "symbol", "neg")
        shared = uses[node] + (node in kept) > 1 or node in graph.names
        shared = shared or (len(text) > MAX_WIDTH and node not in kept)
        if shared and not leaf:
            name = names.take(graph.names.get(node))
            assignments.append((name, text))
            text, precedence = name, ATOM
        texts[node] = text, precedence
    return Code(tuple(assignments), tuple(texts[o][0] for o in outputs), frozenset(symbols))


class _Names:
    """Variable names: the suggested one, made unique, or t1, t2, …"""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = set(taken)
        self._number = 0

    def take(self, suggestion: str | None) -> str:
        if suggestion is not None and suggestion not in self._taken:
            self._taken.add(suggestion)
            return suggestion
        while True:
            self._number += 1
            name = f"t{self._number}"
            if name not in self._taken:
                self._taken.add(name)
                return name
