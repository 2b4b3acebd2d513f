"""Value of graph nodes, computed node by node."""

import math
from collections.abc import Iterable, Mapping

from linkwise.expression.expression_graph import FUNCTIONS, Graph, Node, reachable


def evaluate(graph: Graph, outputs: Iterable[Node], inputs: Mapping[str, float]) -> list[float]:
    """Return the numbers that `outputs` are for the given values of the symbols."""
    outputs, value = list(outputs), {}
    for node in reachable(graph, outputs):
        op, a, b = graph.nodes[node]
        match op:
            case "const":
                value[node] = a
            case "symbol":
                value[node] = inputs[a]
            case "neg":
                value[node] = -value[a]
            case "call":
                value[node] = FUNCTIONS[a](value[b])
            case "add":
                value[node] = value[a] + value[b]
            case "sub":
                value[node] = value[a] - value[b]
            case "mul":
                value[node] = value[a] * value[b]
            case "div":
                value[node] = value[a] / value[b]
            case "atan2":
                value[node] = math.atan2(value[a], value[b])
            case "pow":
                value[node] = value[a] ** value[b]
            case "lt":
                value[node] = value[a] < value[b]
            case "le":
                value[node] = value[a] <= value[b]
            case "select":
                value[node] = value[b[0]] if value[a] else value[b[1]]
    return [value[node] for node in outputs]
