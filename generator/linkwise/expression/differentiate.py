"""Exact derivatives and substitutions of graph expressions, node by node."""

from collections.abc import Mapping

from linkwise.expression.expression_graph import Graph, Node, reachable


def derivative(graph: Graph, output: Node, symbol: Node) -> Node:
    """Return ∂output/∂symbol by the chain rule in forward order; shared parts are differentiated once."""
    tangent: dict[Node, Node] = {symbol: graph.one}
    for node in reachable(graph, [output]):
        if node not in tangent:
            tangent[node] = _tangent(graph, node, tangent)
    return tangent[output]


def _tangent(g: Graph, node: Node, tangent: Mapping[Node, Node]) -> Node:
    op, a, b = g.nodes[node]
    if op in ("const", "symbol"):
        return g.zero
    if op == "neg":
        return g.neg(tangent[a])
    if op == "add":
        return g.add(tangent[a], tangent[b])
    if op == "sub":
        return g.sub(tangent[a], tangent[b])
    if op == "mul":
        return g.add(g.mul(tangent[a], b), g.mul(a, tangent[b]))
    if op == "div":
        return g.div(g.sub(tangent[a], g.mul(node, tangent[b])), b)
    return _call_tangent(g, a, node, b, tangent[b])


def _call_tangent(g: Graph, function: str, node: Node, a: Node, da: Node) -> Node:
    """Return d f(a) with node = f(a)."""
    if da == g.zero:
        return g.zero
    match function:
        case "sin":
            return g.mul(g.call("cos", a), da)
        case "cos":
            return g.neg(g.mul(g.call("sin", a), da))
        case "tan":
            return g.mul(g.add(g.one, g.mul(node, node)), da)
        case "asin":
            return g.div(da, g.call("sqrt", g.sub(g.one, g.mul(a, a))))
        case "acos":
            return g.neg(g.div(da, g.call("sqrt", g.sub(g.one, g.mul(a, a)))))
        case "atan":
            return g.div(da, g.add(g.one, g.mul(a, a)))
        case "sinh":
            return g.mul(g.call("cosh", a), da)
        case "cosh":
            return g.mul(g.call("sinh", a), da)
        case "tanh":
            cosh = g.call("cosh", a)  # 1 − tanh² would leave nothing but rounding where tanh is near 1
            return g.div(da, g.mul(cosh, cosh))
        case "exp":
            return g.mul(node, da)
        case "log":
            return g.div(da, a)
        case "sqrt":
            return g.div(da, g.mul(g.const(2.0), node))
    raise ValueError(f"no derivative is known for {function}")


def substitute(graph: Graph, output: Node, values: Mapping[Node, Node]) -> Node:
    """Return `output` with nodes replaced; constants fold again on the way."""
    g, new = graph, dict(values)
    for node in reachable(graph, [output]):
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
    return new[output]
