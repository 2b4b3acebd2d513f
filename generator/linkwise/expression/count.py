"""Cost of a set of outputs in arithmetic operations."""

from collections import Counter
from collections.abc import Container, Iterable
from dataclasses import dataclass

from linkwise.expression.expression_graph import CONDITIONS, Graph, Node, reachable


@dataclass(frozen=True)
class OperationCount:
    """Operations of some outputs; every shared expression counts once.

    Comparisons, and choices by them, count as functions.
    """

    additions: int
    multiplications: int
    divisions: int
    functions: int

    @property
    def arithmetic(self) -> int:
        """Number of additions, subtractions, multiplications and divisions; sines and the like apart."""
        return self.additions + self.multiplications + self.divisions

    def __add__(self, other: "OperationCount") -> "OperationCount":
        return OperationCount(
            self.additions + other.additions,
            self.multiplications + other.multiplications,
            self.divisions + other.divisions,
            self.functions + other.functions,
        )


def count_operations(graph: Graph, outputs: Iterable[Node], given: Container[Node] = ()) -> OperationCount:
    """Return the operations that `outputs` take from what is `given`; a sign in front of a value is free."""
    needed = reachable(graph, outputs, given)
    ops = Counter(graph.nodes[node][0] for node in needed if node not in given)
    functions = sum(ops[op] for op in ("call", "atan2", "pow", "select", *CONDITIONS))
    return OperationCount(ops["add"] + ops["sub"], ops["mul"], ops["div"], functions)


def in_words(count: OperationCount) -> str:
    """Return a count in words.

    An example is "23 additions and multiplications, 1 division, 4 sines, cosines and the like".
    """
    parts = [
        _times(
            count.additions + count.multiplications,
            "addition or multiplication",
            "additions and multiplications",
        )
    ]
    if count.divisions:
        parts.append(_times(count.divisions, "division", "divisions"))
    if count.functions:
        parts.append(_times(count.functions, "sine or the like", "sines, cosines and the like"))
    return ", ".join(parts)


def _times(number: int, one: str, more: str) -> str:
    return f"{number} {one if number == 1 else more}"
