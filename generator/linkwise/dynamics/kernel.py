"""A kernel: the closed forms of one link, or of all, on one graph."""

from collections.abc import Iterable
from dataclasses import dataclass

import sympy as sp

from linkwise.dynamics.coefficients import Inputs, LinkForms, inputs
from linkwise.escape import identifiers
from linkwise.expression.count import count_operations
from linkwise.expression.expression_graph import Graph, Node
from linkwise.expression.from_sympy import Lowering
from linkwise.symbolic.system import System


@dataclass(frozen=True)
class Kernel:
    """A graph, its inputs, the nodes of the parameters by symbol, and the forms of the links it computes.

    frame: the common frame of its vectors in words, axes and origin; empty for hand-written energies
    energy: kinetic and potential energy of a link whose energies were written by hand
    """

    graph: Graph
    inputs: Inputs
    parameters: dict[sp.Symbol, Node]
    forms: tuple[LinkForms, ...]
    frame: tuple[str, ...]
    energy: tuple[Node, ...] = ()


def lowering(system: System) -> tuple[Lowering, Inputs]:
    """Return a lowering to an empty graph with symbols for q, q̇, q̈ and the parameters, and its inputs."""
    graph = Graph()
    x = inputs(graph, len(system.coordinates))
    symbols = {c.q: node for c, node in zip(system.coordinates, x.q, strict=True)}
    symbols |= {c.qd: node for c, node in zip(system.coordinates, x.qd, strict=True)}
    symbols |= {p: graph.symbol(name) for p, name in parameter_names(system).items()}
    return Lowering(graph, symbols), x


def parameter_names(system: System) -> dict[sp.Symbol, str]:
    """Return identifiers of the run-time parameters: safe names, distinguished where they then agree."""
    symbols = list(system.parameters)
    return dict(zip(symbols, identifiers([symbol.name for symbol in symbols], "p_"), strict=True))


def decomposition_cost(kernels: Iterable[Kernel]) -> int:
    """Return the additions, multiplications and divisions of full decompositions, each kernel by itself."""
    return sum(
        count_operations(k.graph, [node for forms in k.forms for node in forms.decomposition()]).arithmetic
        for k in kernels
    )


def parameter_nodes(system: System, lower: Lowering) -> dict[sp.Symbol, Node]:
    """Return the nodes of the run-time parameters."""
    return {symbol: lower.symbols[symbol] for symbol in system.parameters}
