"""Hash-consing, derivatives and substitution on the expression graph."""

import math
import random

import numpy as np
import pytest
import sympy as sp
from helpers.evaluation import evaluate
from linkwise.expression.count import count_operations, in_words
from linkwise.expression.differentiate import derivative, substitute
from linkwise.expression.expression import Expression
from linkwise.expression.expression_graph import FUNCTIONS, Graph, Node
from linkwise.expression.from_sympy import Lowering
from linkwise.expression.vector import Matrix, Vector, sum_of

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
    assert [g.nodes[g.mul(g.const(number), x)][0] for number in (2.0, -2.0)] == ["mul", "neg"]


def test_simplifications_are_these() -> None:
    g = Graph()
    x, y, two = g.symbol("x"), g.symbol("y"), g.const(2.0)
    same = [
        (g.add(g.neg(x), g.neg(y)), g.neg(g.add(x, y))),
        (g.add(x, g.neg(y)), g.sub(x, y)),
        (g.add(g.neg(x), y), g.sub(y, x)),
        (g.add(g.const(-2.0), x), g.sub(x, two)),
        (g.add(x, g.const(-2.0)), g.sub(x, two)),
        (g.sub(x, g.const(-2.0)), g.add(x, two)),
        (g.sub(x, g.neg(y)), g.add(x, y)),
        (g.sub(g.neg(x), y), g.neg(g.add(x, y))),
        (g.sub(g.zero, x), g.neg(x)),
        (g.sub(x, g.zero), x),
        (g.add(x, x), g.mul(two, x)),
        (g.sub(x, g.sub(x, y)), y),
        (g.neg(g.neg(x)), x),
        (g.mul(x, g.const(-2.0)), g.neg(g.mul(two, x))),
        (g.mul(g.neg(x), g.neg(y)), g.mul(x, y)),
        (g.mul(y, x), g.mul(x, y)),
        (g.div(x, g.const(4.0)), g.mul(g.const(0.25), x)),
        (g.div(g.neg(x), y), g.neg(g.div(x, y))),
        (g.div(g.zero, x), g.zero),
        (g.call("cos", g.neg(x)), g.call("cos", x)),
        (g.call("sin", g.neg(x)), g.neg(g.call("sin", x))),
        (g.call("abs", g.neg(x)), g.call("abs", x)),
        (g.const(-0.0), g.zero),
        (g.add(g.const(1.5), g.const(-1.5)), g.zero),
        (g.atan2(g.const(0.0), g.const(-2.0)), g.const(np.pi)),
    ]
    assert [at for at, (one, other) in enumerate(same) if one != other] == []
    assert g.call("tanh", g.neg(x)) != g.call("tanh", x)
    with pytest.raises(ZeroDivisionError, match="an expression divides by zero"):
        g.div(x, g.zero)


def test_constants_fold_by_their_decimals() -> None:
    g = Graph()
    assert g.value(g.add(g.const(0.1), g.const(0.2))) == 0.3
    assert g.value(g.sub(g.const(0.3), g.const(0.1))) == 0.2
    assert g.value(g.mul(g.const(0.1), g.const(3.0))) == 0.3
    third = g.div(g.one, g.const(3.0))
    assert g.value(g.mul(third, g.const(3.0))) == 1.0
    root = g.call("sqrt", g.const(2.0))
    assert g.value(g.mul(root, root)) == 2.0
    assert g.value(g.call("sin", g.const(0.5))) == math.sin(0.5)


@pytest.mark.parametrize("seed", range(40))
def test_what_folds_keeps_its_value(seed: int) -> None:
    choice, g = random.Random(seed), Graph()
    at = {"x": 0.7, "y": -0.4, "z": 1.1}
    known = {g.symbol(name): value for name, value in at.items()}
    known |= {g.const(value): value for value in (0.0, 1.0, -1.0, 2.0, -0.3, 0.5)}
    results = []
    for _ in range(60):
        a, b = (choice.choice(list(known)) for _ in range(2))
        (u, v), operation = (
            (known[a], known[b]),
            choice.choice(("add", "sub", "mul", "div", "neg", "cos", "sin")),
        )
        if operation in ("cos", "sin"):
            node, value = g.call(operation, a), getattr(math, operation)(u)
        elif operation == "neg":
            node, value = g.neg(a), -u
        elif operation == "div":
            if abs(v) < 0.05:
                continue
            node, value = g.div(a, b), u / v
        else:
            node = getattr(g, operation)(a, b)
            value = {"add": u + v, "sub": u - v, "mul": u * v}[operation]
        if abs(value) < 1e3:
            results.append((node, value))
            known[node] = value
    found = evaluate(g, [node for node, _ in results], at)
    assert found == pytest.approx([value for _, value in results], rel=1e-9, abs=1e-12)


def test_operations_are_counted_once_and_by_kind() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    shared = g.mul(x, y)
    outputs = [g.add(shared, x), g.sub(shared, y), g.neg(g.div(g.call("sin", shared), g.add(y, x)))]
    count = count_operations(g, outputs)
    assert (count.additions, count.multiplications, count.divisions, count.functions) == (3, 1, 1, 1)
    assert count.arithmetic == 5
    assert (count + count).arithmetic == 10
    assert (count + count).functions == 2
    assert in_words(count) == "4 additions and multiplications, 1 division, 1 sine or the like"
    without = count_operations(g, outputs, {shared})
    assert (without.multiplications, without.arithmetic) == (0, 4)
    assert in_words(count_operations(g, [shared])) == "1 addition or multiplication"
    assert in_words(count + count).endswith("2 divisions, 2 sines, cosines and the like")


X, Y = sp.symbols("x y")
LOWERED = [
    X**3 / Y,
    -X / (2 * Y**2),
    sp.sqrt(X) * Y,
    X ** sp.Rational(3, 2),
    X ** sp.Rational(-1, 2),
    X ** sp.Rational(1, 3) + X ** sp.Rational(-2, 3),
    X**Y,
    Y * sp.sin(X) ** 2 + sp.exp(-X) - sp.log(Y) / 7,
    sp.atan(X * Y) + sp.pi * X - sp.sqrt(2),
]


@pytest.mark.parametrize("expression", LOWERED, ids=str)
def test_a_sympy_expression_keeps_its_value(expression: sp.Expr) -> None:
    g = Graph()
    lower = Lowering(g, {X: g.symbol("x"), Y: g.symbol("y")})
    at = {"x": 1.7, "y": 0.6}
    assert evaluate(g, [lower(expression)], at) == pytest.approx([float(expression.subs(at))], rel=1e-14)


@pytest.mark.parametrize("relation", [sp.Eq, sp.Ne, sp.Lt, sp.Le, sp.Gt, sp.Ge])
@pytest.mark.parametrize("x", [-0.5, 0.25, 1.0])
def test_a_branch_is_taken_where_its_condition_holds(relation: type[sp.Rel], x: float) -> None:
    expression = sp.Piecewise((3 * X, relation(X, Y)), (X - 1, True))
    g = Graph()
    (found,) = evaluate(
        g, [Lowering(g, {X: g.symbol("x"), Y: g.symbol("y")})(expression)], {"x": x, "y": 0.25}
    )
    assert found == (3 * x if bool(relation(x, 0.25)) else x - 1)


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
        slope = derivative(Expression(g, output), Expression(g, leaf))
        (exact,) = evaluate(g, [slope.node], at)
        (above,), (below,) = (evaluate(g, [output], at | {name: at[name] + h}) for h in (1e-6, -1e-6))
        assert exact == pytest.approx((above - below) / 2e-6, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("function", SMOOTH_AT_HALF)
def test_derivative_of_every_function_is_the_slope(function: str) -> None:
    g = Graph()
    x = Expression(g, g.symbol("x"))
    (exact,) = evaluate(g, [derivative(x.call(function), x).node], {"x": 0.5})
    f = FUNCTIONS[function]
    assert exact == pytest.approx((f(0.5 + 1e-6) - f(0.5 - 1e-6)) / 2e-6, rel=1e-8)


def test_power_is_a_short_product() -> None:
    g = Graph()
    x = g.symbol("x")
    assert evaluate(g, [g.power(x, 5), g.power(x, -2)], {"x": 1.5}) == pytest.approx([1.5**5, 1.5**-2])
    assert [op for op, _, _ in g.nodes].count("mul") == 3


def test_substitution_folds_what_becomes_constant() -> None:
    g = Graph()
    x, y = (Expression(g, g.symbol(name)) for name in "xy")
    output = x * y.call("cos") + y * y
    assert substitute(output, {x: x.number(0.0)}) == y * y
    assert substitute(output, {x: x.number(1.0), y: x.number(2.0)}).value == math.cos(2.0) + 4.0


def test_a_vector_names_its_parts_by_their_axes() -> None:
    g = Graph()
    one, two = g.symbol("q1"), g.symbol("q2")
    parts = g.add(one, two), g.sub(one, two), g.mul(one, two)
    assert Vector(g, *parts).named("v3").nodes == parts
    assert [g.names[part] for part in parts] == ["v3_x", "v3_y", "v3_z"]


@pytest.mark.parametrize("x", [-20.0, -3.0, 0.0, 15.0])
def test_the_slope_of_tanh_keeps_its_digits_where_tanh_is_near_one(x: float) -> None:
    g = Graph()
    at = Expression(g, g.symbol("x"))
    (slope,) = evaluate(g, [derivative(at.call("tanh"), at).node], {"x": x})
    assert slope == pytest.approx(4.0 / (math.exp(x) + math.exp(-x)) ** 2, rel=1e-14)


def test_operators_make_the_nodes_of_the_graph() -> None:
    g = Graph()
    x, y = (Expression(g, g.symbol(name)) for name in "xy")
    a, b = x.node, y.node
    assert (x + y).node == g.add(a, b)
    assert (x - y).node == g.sub(a, b)
    assert (x * y).node == g.mul(a, b)
    assert (x / y).node == g.div(a, b)
    assert (-x).node == g.neg(a)
    assert (2.0 + x).node == g.add(g.const(2.0), a)
    assert (2.0 - x).node == g.sub(g.const(2.0), a)
    assert (2.0 * x).node == g.mul(g.const(2.0), a)
    assert x.call("sin").named("sin1").node == g.call("sin", a)
    assert g.names[g.call("sin", a)] == "sin1"
    assert (x - x).is_zero
    assert not x.is_zero
    assert (x.number(0.5).value, x.value) == (0.5, None)


def test_expressions_are_equal_where_they_are_one_node_of_one_graph() -> None:
    g, other = Graph(), Graph()
    x, y = (Expression(g, g.symbol(name)) for name in "xy")
    assert x + y == y + x
    assert len({x + y, y + x, x}) == 2
    assert x != y
    assert x != Expression(other, other.symbol("x"))
    assert x != x.node


@pytest.mark.parametrize("seed", range(5))
def test_vectors_and_matrices_compute_what_numpy_does(seed: int) -> None:
    draw, g, at = np.random.default_rng(seed), Graph(), dict[str, float]()

    def vector(name: str, values: np.ndarray) -> Vector:
        at.update({f"{name}{axis}": value for axis, value in zip("xyz", values, strict=True)})
        return Vector(g, *(g.symbol(f"{name}{axis}") for axis in "xyz"))

    def numbers(*vectors: Vector) -> np.ndarray:
        return np.array([evaluate(g, v.nodes, at) for v in vectors]).squeeze()

    (a, b, c), m, rotation = draw.normal(size=(3, 3)), draw.normal(size=(3, 3)), draw.normal(size=(3, 3))
    m = m + m.T
    u, v, w = vector("a", a), vector("b", b), vector("c", c)
    k = Matrix(*(vector(f"m{i}", row) for i, row in enumerate(m)))
    turn = Matrix(*(vector(f"r{i}", row) for i, row in enumerate(rotation)))
    found = [
        (numbers(u + v), a + b),
        (numbers(u - v), a - b),
        (numbers(-u), -a),
        (numbers(2.0 * u), 2.0 * a),
        (numbers(v[0] * u), b[0] * a),
        (numbers(u.cross(v)), np.cross(a, b)),
        (numbers(sum_of(u, v, w)), a + b + c),
        (numbers(k @ u), m @ a),
        (numbers(*(k @ turn)), m @ rotation),
        (numbers(*turn.T), rotation.T),
        (numbers(*k.rotated(turn)), rotation @ m @ rotation.T),
        (numbers(*Matrix.symmetric(lambda i, j: k[i][j])), m),
        (numbers(*Matrix.of(lambda i, j: turn[i][j])), rotation),
        (numbers(*Matrix.identity(g)), np.eye(3)),
        (numbers(Vector.zero(g)), np.zeros(3)),
        (np.array(evaluate(g, [u.dot(v).node], at)), np.array([a @ b])),
    ]
    for ours, expected in found:
        np.testing.assert_allclose(ours, expected, rtol=1e-13, atol=1e-14)
