"""The closed forms of one link, as nodes of a graph, and what they are derived from."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import sympy as sp

from linkwise.escape import identifiers
from linkwise.expression.count import count_operations
from linkwise.expression.expression import Expression
from linkwise.expression.expression_graph import Graph, Node
from linkwise.expression.from_sympy import Lowering
from linkwise.symbolic.system import System

Key = TypeVar("Key", int, tuple[int, int], tuple[int, str])


@dataclass(frozen=True)
class Inputs:
    """Symbols q1…, qd1…, qdd1…: q, q̇ and q̈ by coordinate."""

    q: tuple[Expression, ...]
    qd: tuple[Expression, ...]
    qdd: tuple[Expression, ...]


@dataclass(frozen=True)
class LinkForms:
    """Link j's closed forms over its path(j), coordinates ascending; every dictionary is keyed (i, k) or i.

    graph: the graph of the nodes
    inputs: the motion
    frame: the common frame of its vectors in words, axes and origin; empty for hand-written energies
    acceleration: c2_ijk for i ≤ k, link j's mass matrix M^j, which is symmetric
    velocity: c1_ijk, of the closing convention
    velocity_excess: h1_ijk = 2 c1_ijk − ∂τ_ij/∂q̇_k; empty where that is zero, as for energies quadratic in q̇
    gravity: g_ij, the sum of all shares that have names of their own
    torque: τ_ij
    decomposed_torque: τ_ij where the coefficients are computed too, the same value in the cheaper of two ways
    position_gradient: c0_ijk = ∂τ_ij/∂q_k
    shares: by joint i and name, those shares of a link that was written by hand
    energy: K, P and the power R of such a link: d(K + P)/dt = Σ_i τ_ij q̇_i + R
    """

    graph: Graph
    inputs: Inputs
    path: tuple[int, ...]
    frame: tuple[str, ...]
    acceleration: dict[tuple[int, int], Node]
    velocity: dict[tuple[int, int], Node]
    gravity: dict[int, Node]
    torque: dict[int, Node]
    decomposed_torque: dict[int, Node]
    position_gradient: dict[tuple[int, int], Node]
    velocity_excess: dict[tuple[int, int], Node] = field(default_factory=dict)
    shares: dict[tuple[int, str], Node] = field(default_factory=dict)
    energy: dict[int, Node] = field(default_factory=dict)

    def decomposition(self) -> Iterator[Node]:
        """Yield every output of the full decomposition, in the packed order: c2, c1, g, τ, h1."""
        yield from self.acceleration.values()
        yield from self.velocity.values()
        yield from self.gravity.values()
        yield from self.decomposed_torque.values()
        yield from self.velocity_excess.values()

    @property
    def decomposition_cost(self) -> int:
        """Additions, multiplications and divisions of the full decomposition."""
        return count_operations(self.graph, self.decomposition()).arithmetic


def nodes(values: Mapping[Key, Expression]) -> dict[Key, Node]:
    """Return the nodes of expressions."""
    return {key: value.node for key, value in values.items()}


def lowering(system: System) -> tuple[Lowering, Inputs]:
    """Return a lowering to an empty graph with symbols for q, q̇, q̈ and the parameters, and its inputs."""
    graph, n = Graph(), len(system.coordinates)

    def symbols_of(prefix: str) -> tuple[Expression, ...]:
        return tuple(Expression(graph, graph.symbol(f"{prefix}{k + 1}")) for k in range(n))

    x = Inputs(symbols_of("q"), symbols_of("qd"), symbols_of("qdd"))
    symbols = {c.q: q.node for c, q in zip(system.coordinates, x.q, strict=True)}
    symbols |= {c.qd: qd.node for c, qd in zip(system.coordinates, x.qd, strict=True)}
    symbols |= {p: graph.symbol(name) for p, name in parameter_names(system).items()}
    return Lowering(graph, symbols), x


def parameter_names(system: System) -> dict[sp.Symbol, str]:
    """Return identifiers of the run-time parameters: safe names, distinguished where they then agree."""
    symbols = list(system.parameters)
    return dict(zip(symbols, identifiers([symbol.name for symbol in symbols], "p_"), strict=True))
