"""Operations of the emitted code: of a whole link, of one torque, of the part with one motion alone.

part of τ_ij = c2_ijk q̈_k  or  c1_ijk q̇_k  or  g_ij
part of τ_i  = (Σ_j c2_ijk) q̈_k, and so on: the coefficients are added first, then multiplied once
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from linkwise.dynamics.derive import link_forms
from linkwise.dynamics.link_forms import LinkForms
from linkwise.expression.count import count_operations
from linkwise.expression.expression_graph import ARITHMETIC, Graph, Node, operands, reachable
from linkwise.report.term_count import TermQuery
from linkwise.symbolic.system import System


@dataclass(frozen=True)
class Operations:
    """Numbers of additions, multiplications and divisions, without sines and cosines.

    written: with every shared expression written out wherever it is used
    shared: with every shared expression computed once, as emitted
    """

    written: int
    shared: int

    def __add__(self, other: "Operations") -> "Operations":
        return Operations(self.written + other.written, self.shared + other.shared)


NO_OPERATIONS = Operations(0, 0)


@dataclass(frozen=True)
class PartOperations:
    """Operations of one τ_ij, and of its part: coefficient alone, and times the motion; None is a zero."""

    torque: Operations | None
    coefficient: Operations | None
    part: Operations | None


@dataclass(frozen=True)
class LinkOperations:
    """Link j's cost: everything (c2, c1, g, τ of all joints); τ_ij and its part by joint i."""

    link: int
    everything: Operations
    rows: dict[int, PartOperations]


def link_operations(system: System, joints: tuple[int, ...], query: TermQuery) -> Iterator[LinkOperations]:
    """Yield the operations of each link's own closed forms, link after link."""
    for j in range(len(system.links)):
        forms = link_forms(system, j)
        everything = cost_of(forms.graph, list(forms.decomposition()))
        rows = {i: _row(forms, i, query) for i in joints if i in forms.path}
        yield LinkOperations(j, everything, rows)


def _row(forms: LinkForms, i: int, query: TermQuery) -> PartOperations:
    graph, k = forms.graph, query.coordinate
    factor = coefficient(forms, i, query)
    motion = (graph.one, forms.inputs.qd[k].node, forms.inputs.qdd[k].node)[query.order]
    torque = forms.torque[i]
    return PartOperations(
        *(_cost_of_one(graph, node) for node in (torque, factor, graph.mul(factor, motion)))
    )


def coefficient(forms: LinkForms, i: int, query: TermQuery) -> Node:
    """Return the node of the requested coefficient; zero where its coordinate is off the path."""
    k = query.coordinate
    if query.order == 0:
        return forms.gravity[i]
    if k not in forms.path:
        return forms.graph.zero
    if query.order == 1:
        return forms.velocity[i, k]
    return forms.acceleration[min(i, k), max(i, k)]


def _cost_of_one(graph: Graph, node: Node) -> Operations | None:
    return None if node == graph.zero else cost_of(graph, [node])


def total_cost(costs: Sequence[LinkOperations], i: int, query: TermQuery) -> tuple[Operations, Operations]:
    """Return the cost of τ_i = Σ_j τ_ij and of its part, with each link computed by itself.

    Zeros are not added.
    """
    rows = [cost.rows[i] for cost in costs if i in cost.rows]
    torque = _sum([row.torque for row in rows if row.torque])
    parts = [row.part for row in rows if row.part]
    if len(parts) < 2:
        return torque, _sum(parts)
    product = Operations(1, 1) if query.order else NO_OPERATIONS
    return torque, _sum([row.coefficient for row in rows if row.coefficient]) + product


def _sum(terms: Sequence[Operations]) -> Operations:
    additions = max(0, len(terms) - 1)
    return sum(terms, Operations(additions, additions))


def cost_of(graph: Graph, outputs: list[Node]) -> Operations:
    """Return the cost of `outputs`, with and without sharing."""
    cost: dict[Node, int] = {}
    for node in reachable(graph, outputs):
        entry = graph.nodes[node]
        cost[node] = (entry[0] in ARITHMETIC) + sum(cost[o] for o in operands(entry))
    return Operations(sum(cost[output] for output in outputs), count_operations(graph, outputs).arithmetic)
