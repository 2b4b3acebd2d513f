"""Exact derivatives and substitutions of graph expressions, node by node."""

from collections.abc import Mapping

from linkwise.expression.expression import Expression
from linkwise.expression.expression_graph import CONDITIONS, Graph, Node, operands, reachable


def derivative(output: Expression, symbol: Expression) -> Expression:
    """Return ∂output/∂symbol by the chain rule in forward order; shared parts are differentiated once.

    Where expressions change at a condition, the derivative is that of the side on which they are evaluated.
    """
    graph, tangent = output.graph, {symbol.node: Expression(output.graph, output.graph.one)}
    for node in reachable(graph, [output.node]):
        op, a, b = graph.nodes[node]
        # A node none of whose operands depends on the symbol has no tangent: it would be 0.
        if op == "call":
            if b in tangent:
                tangent[node] = _call_tangent(a, Expression(graph, node), Expression(graph, b), tangent[b])
        elif op == "select":
            sides = [tangent.get(side) for side in b]
            if any(side is not None for side in sides):
                zero = Expression(graph, graph.zero)
                then, other = (zero if side is None else side for side in sides)
                tangent[node] = then.where(Expression(graph, a), other)
        elif any(part in tangent for part in operands(graph.nodes[node])) and op not in CONDITIONS:
            tangent[node] = _tangent(graph, node, tangent.get(a), tangent.get(b))
    return tangent.get(output.node, Expression(graph, graph.zero))


def _tangent(graph: Graph, node: Node, da: Expression | None, db: Expression | None) -> Expression:
    """Return the derivative of a node of arithmetic from those of its operands; None stands for zeros."""
    op, a, b = graph.nodes[node]
    if op == "atan2":
        y, x = Expression(graph, a), Expression(graph, b)
        zero = Expression(graph, graph.zero)
        return (x * (da or zero) - y * (db or zero)) / (x * x + y * y)
    if op == "pow":
        # Not f b / a, which is NaN where a is 0 and the slope is not.
        base, exponent = Expression(graph, a), Expression(graph, b)
        lower = Expression(graph, graph.pow(a, (exponent - exponent.number(1.0)).node))
        by_base = None if da is None else exponent * lower * da
        if db is None:
            assert by_base is not None
            return by_base
        by_exponent = Expression(graph, node) * base.call("log") * db
        return by_exponent if by_base is None else by_base + by_exponent
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
            # 1 − tanh² would leave nothing but rounding where tanh is near 1, and cosh² overflows there.
            small = (-2.0 * a.call("abs")).call("exp")
            return 4.0 * small / ((1.0 + small) * (1.0 + small)) * da
        case "exp":
            return f * da
        case "log":
            return da / a
        case "sqrt":
            return da / (2.0 * f)
        case "abs":
            return sign(a) * da
    raise ValueError(f"no derivative is known for {function}")


def sign(a: Expression) -> Expression:
    """Return 1, −1 or 0, as a is above, below or zero."""
    graph = a.graph
    above, below = (
        Expression(graph, graph.lt(graph.zero, a.node)),
        Expression(graph, graph.lt(a.node, graph.zero)),
    )
    return a.number(1.0).where(above, a.number(-1.0).where(below, a.number(0.0)))


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
        elif op == "select":
            new[node] = g.select(new[a], new[b[0]], new[b[1]])
        else:
            new[node] = getattr(g, op)(new[a], new[b])
    return Expression(g, new[output.node])
