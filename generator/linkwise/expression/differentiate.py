"""Exact derivatives and substitutions of graph expressions, node by node."""

from collections.abc import Mapping

from linkwise.expression.expression import Expression
from linkwise.expression.expression_graph import Graph, Node, reachable


def derivative(output: Expression, symbol: Expression) -> Expression:
    """Return ∂output/∂symbol by the chain rule in forward order; shared parts are differentiated once."""
    graph, tangent = output.graph, {symbol.node: Expression(output.graph, output.graph.one)}
    for node in reachable(graph, [output.node]):
        op, a, b = graph.nodes[node]
        # A node none of whose operands depends on the symbol has no tangent: it would be 0.
        if op == "call":
            if b in tangent:
                tangent[node] = _call_tangent(a, Expression(graph, node), Expression(graph, b), tangent[b])
        elif op not in ("const", "symbol") and (a in tangent or b in tangent):
            tangent[node] = _tangent(graph, node, tangent.get(a), tangent.get(b))
    return tangent.get(output.node, Expression(graph, graph.zero))


def _tangent(graph: Graph, node: Node, da: Expression | None, db: Expression | None) -> Expression:
    """Return the derivative of a node of arithmetic from those of its operands; None stands for zeros."""
    op, a, b = graph.nodes[node]
    if db is None and da is not None:
        if op in ("add", "sub"):
            return da
        return -da if op == "neg" else da * Expression(graph, b) if op == "mul" else da / Expression(graph, b)
    assert db is not None
    if op == "add":
        return db if da is None else da + db
    if op == "sub":
        return -db if da is None else da - db
    if op == "mul":
        if da is None:
            return Expression(graph, a) * db
        return da * Expression(graph, b) + Expression(graph, a) * db
    change = Expression(graph, node) * db
    return (-change if da is None else da - change) / Expression(graph, b)


def _call_tangent(function: str, f: Expression, a: Expression, da: Expression) -> Expression:
    """Return d f(a) with f = function(a)."""
    if da.is_zero:
        return da
    match function:
        case "sin":
            return a.call("cos") * da
        case "cos":
            return -(a.call("sin") * da)
        case "tan":
            return (1.0 + f * f) * da
        case "asin":
            return da / (1.0 - a * a).call("sqrt")
        case "acos":
            return -(da / (1.0 - a * a).call("sqrt"))
        case "atan":
            return da / (1.0 + a * a)
        case "sinh":
            return a.call("cosh") * da
        case "cosh":
            return a.call("sinh") * da
        case "tanh":
            cosh = a.call("cosh")  # 1 − tanh² would leave nothing but rounding where tanh is near 1
            return da / (cosh * cosh)
        case "exp":
            return f * da
        case "log":
            return da / a
        case "sqrt":
            return da / (2.0 * f)
    raise ValueError(f"no derivative is known for {function}")


def substitute(output: Expression, values: Mapping[Expression, Expression]) -> Expression:
    """Return `output` with expressions replaced; constants fold again on the way."""
    g = output.graph
    new = {old.node: value.node for old, value in values.items()}
    for node in reachable(g, [output.node]):
        if node in new:
            continue
        op, a, b = g.nodes[node]
        if op in ("const", "symbol"):
            new[node] = node
        elif op == "neg":
            new[node] = g.neg(new[a])
        elif op == "call":
            new[node] = g.call(a, new[b])
        else:
            new[node] = getattr(g, op)(new[a], new[b])
    return Expression(g, new[output.node])
