"""Rows of constraints that a user wrote, as nodes of a graph: phi, A and dA/dt."""

from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.dynamics.link_forms import lowering
from linkwise.expression.differentiate import derivative
from linkwise.expression.expression import Expression
from linkwise.expression.expression_graph import Graph, Node
from linkwise.symbolic.system import EnergySystem


@dataclass(frozen=True)
class ConstraintForms:
    """Rows of constraints, one after the other: phi and A_k beside it, and dA_k/dt."""

    graph: Graph
    positions: Sequence[Sequence[Node]]
    rates: Sequence[Sequence[Node]]


def constraint_rows(system: EnergySystem) -> ConstraintForms:
    """Return the rows of a system's constraints.

    A_k = dphi/dq_k, of velocities alone d(sum)/dqd_k    dA_k/dt = sum_s dA_k/dq_s qd_s
    """
    lower, x = lowering(system)
    positions, rates = list[list[Node]](), list[list[Node]]()
    for one in system.constraints:
        zero = Expression(lower.graph, lower(one.expression))
        row = [derivative(zero, by) for by in (x.q if one.holonomic else x.qd)]
        phi = zero if one.holonomic else zero.number(0.0)
        changes = (
            sum((derivative(a, q) * qd for q, qd in zip(x.q, x.qd, strict=True)), zero.number(0.0))
            for a in row
        )
        positions.append([phi.node, *(a.node for a in row)])
        rates.append([change.node for change in changes])
    return ConstraintForms(lower.graph, positions, rates)
