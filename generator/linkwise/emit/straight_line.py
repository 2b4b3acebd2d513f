"""Straight-line code: a graph's outputs as assignments and final expressions."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from linkwise.emit.printer import ATOM, Printer, Text
from linkwise.expression.graph import Graph, Node, operands, reachable

MAX_WIDTH = 88
"""An expression that would grow longer than this gets a name."""


@dataclass(frozen=True)
class Code:
    """Assignments (variable, expression) in order, the outputs' expressions, and the inputs used.

    `ready` says for each output how many assignments it has to wait for.
    """

    assignments: tuple[tuple[str, str], ...]
    outputs: tuple[str, ...]
    ready: tuple[int, ...]
    symbols: frozenset[str]


def straight_line(
    graph: Graph, outputs: Sequence[Node], printer: Printer, given: Mapping[Node, str] | None = None
) -> Code:
    """Code for `outputs`: what is used twice or has its own name becomes a variable, the rest is inlined.

    `given` names nodes that the code need not compute.
    """
    given = given or {}
    order = reachable(graph, outputs, given)
    uses = Counter(operand for node in order if node not in given for operand in operands(graph.nodes[node]))
    kept = set(outputs)
    leaves = (graph.nodes[node][1] for node in order if graph.nodes[node][0] == "symbol")
    names = _Names([*leaves, *given.values()])
    texts: dict[Node, Text] = {}
    latest: dict[Node, int] = {}
    assignments: list[tuple[str, str]] = []
    symbols = set()
    for node in order:
        entry = graph.nodes[node]
        if node in given:
            texts[node], latest[node] = (given[node], ATOM), 0
            symbols.add(given[node])
            continue
        text, precedence = printer.print(entry, tuple(texts[o] for o in operands(entry)))
        if entry[0] == "symbol":
            symbols.add(text)
        latest[node] = max((latest[o] for o in operands(entry)), default=0)
        leaf = entry[0] in ("const", "symbol", "neg")
        shared = uses[node] + (node in kept) > 1 or node in graph.names
        shared = shared or (len(text) > MAX_WIDTH and node not in kept)
        if shared and not leaf:
            name = names.take(graph.names.get(node))
            assignments.append((name, text))
            text, precedence = name, ATOM
            latest[node] = len(assignments)
        texts[node] = text, precedence
    return Code(
        tuple(assignments),
        tuple(texts[o][0] for o in outputs),
        tuple(latest[o] for o in outputs),
        frozenset(symbols),
    )


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
