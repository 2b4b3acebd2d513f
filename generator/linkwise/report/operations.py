"""Operations of the emitted code: of a whole link, of one torque, of one bucket alone."""

from collections.abc import Iterator
from dataclasses import dataclass

from linkwise.graph.count import count_operations
from linkwise.graph.derive import link_kernel
from linkwise.graph.expression import Graph, Node, operands, reachable
from linkwise.graph.forms import LinkForms
from linkwise.report.question import Question
from linkwise.symbolic.system import System

ARITHMETIC = frozenset({"add", "sub", "mul", "div"})


@dataclass(frozen=True)
class Operations:
    """Additions, multiplications and divisions, sines and cosines apart.

    written: with every shared expression written out wherever it is used
    shared: with every shared expression computed once, as emitted
    """

    written: int
    shared: int

    def __add__(self, other: "Operations") -> "Operations":
        return Operations(self.written + other.written, self.shared + other.shared)


NO_OPERATIONS = Operations(0, 0)


@dataclass(frozen=True)
class LinkOperations:
    """Link j's cost: everything (c2, c1, g, τ of all joints); by joint i, τ_ij and its bucket."""

    link: int
    everything: Operations
    torque: dict[int, Operations]
    bucket: dict[int, Operations]


def link_operations(system: System, joints: tuple[int, ...], question: Question) -> Iterator[LinkOperations]:
    """Operations of each link's own kernel, link after link."""
    for j in range(len(system.links)):
        kernel = link_kernel(system, j)
        graph, forms = kernel.graph, kernel.forms[0]
        rows = [i for i in joints if i in forms.path]
        yield LinkOperations(
            j,
            operations(graph, list(forms.decomposition())),
            {i: operations(graph, [forms.torque[i]]) for i in rows},
            {i: operations(graph, bucket(forms, i, question)) for i in rows},
        )


def bucket(forms: LinkForms, i: int, question: Question) -> list[Node]:
    """Node of the coefficient asked for; none where it is zero, its coordinate off the path."""
    k = question.coordinate
    if question.order == 0:
        return [forms.gravity[i]]
    if k not in forms.path:
        return []
    if question.order == 1:
        return [forms.velocity[i, k]]
    return [forms.acceleration[min(i, k), max(i, k)]]


def operations(graph: Graph, outputs: list[Node]) -> Operations:
    """Cost of `outputs`, with and without sharing."""
    cost: dict[Node, int] = {}
    for node in reachable(graph, outputs):
        entry = graph.nodes[node]
        cost[node] = (entry[0] in ARITHMETIC) + sum(cost[o] for o in operands(entry))
    return Operations(sum(cost[output] for output in outputs), count_operations(graph, outputs).arithmetic)
