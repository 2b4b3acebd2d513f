"""Straight-line code: a graph's outputs as assignments and final expressions."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from linkwise.dynamics.link_forms import parameter_names
from linkwise.emit.printer import ATOM, Printer, Text
from linkwise.escape import python_literal
from linkwise.expression.expression_graph import CONDITIONS, Entry, Graph, Node, operands, reachable
from linkwise.symbolic.system import System

MAX_WIDTH = 88
"""Most characters of an expression; parts of a longer one get names."""


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
    """Return code for `outputs`.

    Nodes used twice or with a name of their own become variables, the rest is inlined. `given` names nodes
    that the code need not compute.
    """
    given = given or {}
    order = reachable(graph, outputs, given)
    writer = _Writer(graph, order, outputs, printer, given)
    for node in order:
        writer.write(node)
    return Code(
        tuple(writer.assignments),
        tuple(writer.texts[o][0] for o in outputs),
        tuple(writer.latest[o] for o in outputs),
        frozenset(writer.symbols),
    )


class _Writer:
    """Texts of nodes in turn, operands before users, and the assignments that they depend on."""

    def __init__(
        self,
        graph: Graph,
        order: Sequence[Node],
        outputs: Sequence[Node],
        printer: Printer,
        given: Mapping[Node, str],
    ) -> None:
        self.graph, self.printer, self.given = graph, printer, given
        computed = [node for node in order if node not in given]
        self.uses = Counter(o for node in computed for o in operands(graph.nodes[node])) + Counter(outputs)
        for node in reversed(computed):  # a negation is no variable: its operand is used as often
            if graph.nodes[node][0] == "neg":
                self.uses[operands(graph.nodes[node])[0]] += self.uses[node] - 1
        leaves = (graph.nodes[node][1] for node in order if graph.nodes[node][0] == "symbol")
        self.names = _Names([*leaves, *given.values()])
        self.texts: dict[Node, Text] = {}
        self.latest: dict[Node, int] = {}
        self.assignments: list[tuple[str, str]] = []
        self.symbols: set[str] = set()

    def write(self, node: Node) -> None:
        """Find the text of a node; it is a variable where it is used twice or has a name."""
        entry = self.graph.nodes[node]
        if node in self.given or entry[0] == "symbol":
            name = self.given.get(node, entry[1])
            self.texts[node], self.latest[node] = (name, ATOM), 0
            self.symbols.add(name)
            return
        self.texts[node] = self._short(entry)
        self.latest[node] = max((self.latest[o] for o in operands(entry)), default=0)
        if entry[0] not in ("const", "neg", *CONDITIONS) and (
            self.uses[node] > 1 or node in self.graph.names
        ):
            self._assign(node)

    def _short(self, entry: Entry) -> Text:
        """Return the text of an entry; if it would be long, its longest operands become variables first."""
        while True:
            text = self.printer.print(entry, tuple(self.texts[o] for o in operands(entry)))
            longest = max(operands(entry), key=lambda o: len(self.texts[o][0]), default=None)
            if len(text[0]) <= MAX_WIDTH or longest is None or self.texts[longest][1] == ATOM:
                return text
            self._assign(longest)

    def _assign(self, node: Node) -> None:
        name = self.names.take(self.graph.names.get(node))
        self.printer.named(self.texts[node][0], name)
        self.assignments.append((name, self.texts[node][0]))
        self.texts[node], self.latest[node] = (name, ATOM), len(self.assignments)


def fetched(system: System, code: Code, subscript: str = "[{}]") -> tuple[str, ...]:
    """Return lines that take coordinates, velocities and parameters out of q, qd, qdd and p, in Python."""
    lines = []
    for prefix in ("q", "qd", "qdd"):
        used = [k for k in range(len(system.coordinates)) if f"{prefix}{k + 1}" in code.symbols]
        lines += [f"{prefix}{k + 1} = {prefix}{subscript.format(k)}" for k in used]
    for symbol, name in parameter_names(system).items():
        if name in code.symbols:
            lines.append(f"{name} = p[{python_literal(symbol.name)}]")
    return tuple(lines)


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
