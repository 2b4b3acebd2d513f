"""Hash-consing, derivatives and substitution on the expression graph."""

import math
import random

import pytest
from evaluation import evaluate
from linkwise.expression.differentiate import derivative, substitute
from linkwise.expression.graph import FUNCTIONS, Graph, Node

SMOOTH_AT_HALF = sorted(FUNCTIONS)


def test_equal_expressions_are_one_node() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    assert g.add(x, y) == g.add(y, x)
    assert g.mul(x, g.call("sin", y)) == g.mul(g.call("sin", y), x)
    assert g.sub(y, x) == g.neg(g.sub(x, y))
    assert g.mul(g.neg(x), y) == g.neg(g.mul(x, y))


def test_constants_fold_and_units_vanish() -> None:
    g = Graph()
    x = g.symbol("x")
    assert g.mul(g.const(2.0), g.const(3.0)) == g.const(6.0)
    assert g.add(x, g.zero) == g.mul(x, g.one) == x
    assert g.mul(x, g.zero) == g.sub(x, x) == g.zero
    assert g.mul(g.const(2.0), g.mul(g.const(3.0), x)) == g.mul(g.const(6.0), x)


def random_expression(g: Graph, leaves: list[Node], steps: int, seed: int) -> Node:
    choice, nodes = random.Random(seed), list(leaves)
    for _ in range(steps):
        a, b = choice.choice(nodes), choice.choice(nodes)
        operation = choice.choice(("add", "sub", "mul", "div", "sin", "cos", "neg"))
        if operation == "div":
            nodes.append(g.div(a, g.add(g.const(3.0), g.mul(b, b))))
        elif operation in ("sin", "cos"):
            nodes.append(g.call(operation, a))
        elif operation == "neg":
            nodes.append(g.neg(a))
        else:
            nodes.append(getattr(g, operation)(a, b))
    return g.sum(nodes[-5:])


@pytest.mark.parametrize("seed", range(20))
def test_derivative_is_the_slope(seed: int) -> None:
    g = Graph()
    at = {"x": 0.7, "y": -0.4, "z": 1.1}
    leaves = [g.symbol(name) for name in at]
    output = random_expression(g, leaves, 15, seed)
    for name, leaf in zip(at, leaves, strict=True):
        (exact,) = evaluate(g, [derivative(g, output, leaf)], at)
        (above,), (below,) = (evaluate(g, [output], at | {name: at[name] + h}) for h in (1e-6, -1e-6))
        assert exact == pytest.approx((above - below) / 2e-6, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("function", SMOOTH_AT_HALF)
def test_derivative_of_every_function_is_the_slope(function: str) -> None:
    g = Graph()
    x = g.symbol("x")
    (exact,) = evaluate(g, [derivative(g, g.call(function, x), x)], {"x": 0.5})
    f = FUNCTIONS[function]
    assert exact == pytest.approx((f(0.5 + 1e-6) - f(0.5 - 1e-6)) / 2e-6, rel=1e-8)


def test_power_is_a_short_product() -> None:
    g = Graph()
    x = g.symbol("x")
    assert evaluate(g, [g.power(x, 5), g.power(x, -2)], {"x": 1.5}) == pytest.approx([1.5**5, 1.5**-2])
    assert [op for op, _, _ in g.nodes].count("mul") == 3


def test_substitution_folds_what_becomes_constant() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    output = g.add(g.mul(x, g.call("cos", y)), g.mul(y, y))
    assert substitute(g, output, {x: g.zero}) == g.mul(y, y)
    assert g.value(substitute(g, output, {x: g.one, y: g.const(2.0)})) == math.cos(2.0) + 4.0
