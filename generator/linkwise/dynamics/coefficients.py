"""The closed forms of one link, as nodes of a graph."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from linkwise.expression.expression_graph import Graph, Node


@dataclass(frozen=True)
class Inputs:
    """Nodes of q, q̇ and q̈, by coordinate."""

    q: tuple[Node, ...]
    qd: tuple[Node, ...]
    qdd: tuple[Node, ...]


@dataclass(frozen=True)
class LinkForms:
    """Link j's closed forms over its path(j), coordinates ascending; every dictionary is keyed (i, k) or i.

    acceleration: c2_ijk for i ≤ k, link j's mass matrix M^j, which is symmetric
    velocity: c1_ijk, of the closing convention
    velocity_linear: the part ∂h1/∂q̇ of c1 that stems from energy terms linear in q̇, zero where they have no
    force; empty where the energy has no such terms
    gravity: g_ij                         torque: τ_ij
    decomposed_torque: τ_ij where the coefficients are computed too, the same value in the cheaper of two ways
    position_gradient: c0_ijk = ∂τ_ij/∂q_k
    """

    path: tuple[int, ...]
    acceleration: dict[tuple[int, int], Node]
    velocity: dict[tuple[int, int], Node]
    gravity: dict[int, Node]
    torque: dict[int, Node]
    decomposed_torque: dict[int, Node]
    position_gradient: dict[tuple[int, int], Node]
    velocity_linear: dict[tuple[int, int], Node] = field(default_factory=dict)

    def decomposition(self) -> Iterator[Node]:
        """Yield every output of the full decomposition, in the packed order: c2, c1, g, τ."""
        yield from self.acceleration.values()
        yield from self.velocity.values()
        yield from self.gravity.values()
        yield from self.decomposed_torque.values()


def inputs(graph: Graph, n: int) -> Inputs:
    """Return the symbols q1…, qd1…, qdd1… of n coordinates."""
    return Inputs(
        tuple(graph.symbol(f"q{k + 1}") for k in range(n)),
        tuple(graph.symbol(f"qd{k + 1}") for k in range(n)),
        tuple(graph.symbol(f"qdd{k + 1}") for k in range(n)),
    )
