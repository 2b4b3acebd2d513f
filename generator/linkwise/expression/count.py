"""How much arithmetic a set of outputs costs."""

from collections import Counter
from collections.abc import Container, Iterable
from dataclasses import dataclass

from linkwise.expression.graph import Graph, Node, reachable


@dataclass(frozen=True)
class OperationCount:
    """Operations of one kernel; every shared expression counts once."""

    additions: int
    multiplications: int
    divisions: int
    functions: int

    @property
    def arithmetic(self) -> int:
        """Additions, subtractions, multiplications and divisions; sines and the like apart."""
        return self.additions + self.multiplications + self.divisions

    def __add__(self, other: "OperationCount") -> "OperationCount":
        return OperationCount(
            self.additions + other.additions,
            self.multiplications + other.multiplications,
            self.divisions + other.divisions,
            self.functions + other.functions,
        )


def count_operations(graph: Graph, outputs: Iterable[Node], given: Container[Node] = ()) -> OperationCount:
    """Count what computing `outputs` takes from what is `given`. A sign in front of a value is free."""
    needed = reachable(graph, outputs, given)
    ops = Counter(graph.nodes[node][0] for node in needed if node not in given)
    return OperationCount(ops["add"] + ops["sub"], ops["mul"], ops["div"], ops["call"])
