"""Counted terms, held against derivations that share no code with the count."""

import json
import math
import random
from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp
from linkwise.dynamics.derive import link_forms
from linkwise.dynamics.link_forms import LinkForms, parameter_names
from linkwise.errors import LinkwiseError
from linkwise.expression.expression_graph import FUNCTIONS, Node, reachable
from linkwise.progress import silent
from linkwise.report import (
    LinkTorques,
    TermQuery,
    count_terms,
    link_torques,
    terms_json,
    terms_markdown,
    terms_report,
)
from linkwise.report.laurent import Laurent, exponents
from linkwise.robot import Options, read_robot
from linkwise.robot.robot import Coordinate
from linkwise.symbolic.system import LinkEnergy, System, rigid_system
from linkwise.symbolic.user_energies import energy_system
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols
from sympy.simplify.fu import TR8

GOLDEN = json.loads((Path(__file__).parents[1] / "data" / "term_counts.json").read_text())
KINDS = ("q", "qd", "qdd")
ARITHMETIC = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
}


def symbolic(name: str) -> System:
    return rigid_system(read_robot(name, Options(parameters="nonzero")))


def spring_pendulum() -> System:
    """A slide on a spring that carries a pendulum, whose driven pivot adds a term linear in q̇."""
    x, a = Coordinate("x", "m"), Coordinate("a")
    m, c, k, length, w, g = sp.symbols("m c k l w g", real=True)
    kinetic = m / 2 * (x.qd**2 + 2 * length * x.qd * a.qd * sp.cos(a.q) + length**2 * a.qd**2)
    links = (
        LinkEnergy("slide", c * x.qd**2 / 2, k * x.q**2 / 2 + k**2 / c * x.q**4 / 4),
        LinkEnergy("bob", kinetic + w * a.qd * sp.sin(2 * a.q), -m * g * length * sp.cos(a.q)),
    )
    values = dict.fromkeys((m, c, k, length, w, g), 1.0)
    return energy_system("spring_pendulum", (x, a), links, values, symbolic=True)


def geared(ratio: float) -> System:
    """planar3 whose third joint turns by `ratio` times the angle of the second."""
    robot = read_robot("planar3", Options(parameters="symbolic"))
    *links, last = robot.links
    joint = replace(last.joint, coordinate=1, ratio=ratio)
    arm = replace(robot, name=f"geared {ratio}", coordinates=robot.coordinates[:2])
    return rigid_system(replace(arm, links=(*links, replace(last, joint=joint))))


def values_at_random(system: System, seed: int) -> dict[str, float]:
    draw = random.Random(seed)
    n = len(system.coordinates)
    names = [f"{kind}{k + 1}" for kind in KINDS for k in range(n)]
    names += [symbol.name for symbol in system.parameters]
    return {name: draw.uniform(0.3, 1.7) for name in names}


def evaluated_expansion(p: Laurent, found: LinkTorques, system: System, at: dict[str, float]) -> complex:
    """A torque of `found`, from its polynomial in u_k = q_k/d_k at given q, q̇ and q̈."""
    x, n = found.variables, len(system.coordinates)
    at = at | {f"{kind}{k + 1}": at[f"{kind}{k + 1}"] / d for k, d in enumerate(x.units) for kind in KINDS}
    bare = {c.q: at[f"q{k + 1}"] for k, c in enumerate(system.coordinates)}
    value = [1j] + [complex(math.cos(at[f"q{k + 1}"]), math.sin(at[f"q{k + 1}"])) for k in range(n)]
    value += [at[f"qd{k + 1}"] for k in range(n)] + [at[f"qdd{k + 1}"] for k in range(n)]
    value += [bare[symbol] if symbol in bare else at[symbol.name] for symbol in x.others]
    total = 0j
    for key, c in p.terms.items():
        powers = zip(value, exponents(key, x.digits), strict=True)
        total += c * math.prod(v**e for v, e in powers if e)
    return total / p.denominator


def evaluated_graph(forms: LinkForms, system: System, output: Node, at: dict[str, float]) -> float:
    named = {name: at[symbol.name] for symbol, name in parameter_names(system).items()}
    value: dict[Node, float] = {}
    for node in reachable(forms.graph, [output]):
        op, a, b = forms.graph.nodes[node]
        if op == "const":
            value[node] = a
        elif op == "symbol":
            value[node] = named[a] if a in named else at[a]
        elif op == "neg":
            value[node] = -value[a]
        elif op == "call":
            value[node] = FUNCTIONS[a](value[b])
        else:
            value[node] = ARITHMETIC[op](value[a], value[b])
    return value[output]


@pytest.mark.parametrize(
    "system",
    [symbolic("puma560"), symbolic("planar4"), spring_pendulum(), geared(1.5), geared(-0.4)],
    ids=lambda s: s.name,
)
def test_expanded_torques_equal_the_closed_forms_of_the_graph(system: System) -> None:
    every = tuple(range(len(system.coordinates)))
    at = values_at_random(system, 5)
    for found in link_torques(system, every, 10**6, silent):
        forms = link_forms(system, found.link)
        for i, torque in found.torques.items():
            exact = evaluated_graph(forms, system, forms.torque[i], at)
            expanded = evaluated_expansion(torque, found, system, at) / found.variables.units[i]
            assert expanded == pytest.approx(exact, rel=1e-9, abs=1e-9)


def sympy_counts(n: int) -> tuple[int, int]:
    """Terms of τ_1, and those with q̈_1, of the planar arm by SymPy's own Lagrange and Fu."""
    t = dynamicsymbols._t
    q = dynamicsymbols(f"q1:{n + 1}")
    length, r, m, inertia = (sp.symbols(f"{name}1:{n + 1}") for name in "lrmI")
    lagrangian, x, y, angle = sp.S.Zero, sp.S.Zero, sp.S.Zero, sp.S.Zero
    for j in range(n):
        angle += q[j]
        cx, cy = x + r[j] * sp.cos(angle), y + r[j] * sp.sin(angle)
        speed = cx.diff(t) ** 2 + cy.diff(t) ** 2
        lagrangian += m[j] * speed / 2 + inertia[j] * angle.diff(t) ** 2 / 2 - m[j] * sp.Symbol("g") * cy
        x, y = x + length[j] * sp.cos(angle), y + length[j] * sp.sin(angle)
    torque = LagrangesMethod(lagrangian, q).form_lagranges_equations()[0]
    terms = sp.Add.make_args(sp.expand(TR8(sp.expand(torque))))
    return len(terms), sum(term.has(q[0].diff(t, 2)) for term in terms)


@pytest.mark.parametrize("n", [2, 3])
def test_counts_equal_those_of_an_independent_derivation(n: int) -> None:
    row = terms_report(symbolic(f"planar{n}"), TermQuery(), 10**6, False, silent).rows[-1]
    assert (row.count.total, row.kept) == sympy_counts(n)


def test_every_term_is_in_a_bucket_and_off_path_torques_have_none() -> None:
    report = terms_report(symbolic("puma560"), TermQuery(joint=None), 10**6, False, silent)
    for row in report.rows:
        count = row.count
        if row.link is not None and row.link < row.joint:
            assert count.total == 0
        assert sum(count.acceleration) + max(count.velocity) + count.gravity <= count.total
        assert sum(count.acceleration) + sum(count.velocity) + count.gravity >= count.total


def twisted(cosine: float, sine: float) -> System:
    """planar3 with its last two axes turned about x."""
    robot = read_robot("planar3", Options(parameters="symbolic"))
    turn = ((1.0, 0.0, 0.0), (0.0, cosine, -sine), (0.0, sine, cosine))
    links = [replace(link, joint=replace(link.joint, rotation=turn)) for link in robot.links[1:]]
    return rigid_system(replace(robot, links=(robot.links[0], *links)))


def test_rounded_rotations_leave_no_spurious_terms() -> None:
    exact = terms_report(twisted(0.6, 0.8), TermQuery(), 10**6, False, silent)
    rounded = terms_report(twisted(math.cos(0.7), math.sin(0.7)), TermQuery(), 10**6, False, silent)
    assert [row.count for row in rounded.rows] == [row.count for row in exact.rows]
    nearly = terms_report(twisted(5e-12, 1.0), TermQuery(None), 10**6, False, silent)
    square = terms_report(twisted(0.0, 1.0), TermQuery(None), 10**6, False, silent)
    assert [row.count for row in nearly.rows] == [row.count for row in square.rows]
    assert "decimals" in nearly.form
    assert "exact" in square.form


def test_an_angle_offset_leaves_no_spurious_terms() -> None:
    a, m = Coordinate("a"), sp.Symbol("m", real=True)
    sine, cosine = sp.sin(a.q + 0.3), sp.cos(a.q + 0.3)
    arm = LinkEnergy("arm", m * (sine**2 + cosine**2) * a.qd**2 / 2, m * cosine)
    system = energy_system("offset", (a,), (arm,), {m: 1.0}, symbolic=True)
    report = terms_report(system, TermQuery(), 100, False, silent)
    # m q̈, and cos 0.3 and sin 0.3 times one wave each.
    assert report.rows[0].count.total == 3


def test_beyond_the_budget_the_report_says_how_far_it_got() -> None:
    with pytest.raises(LinkwiseError, match=r"'link5' needs more than 300 terms, after 4 of 6 links"):
        terms_report(symbolic("puma560"), TermQuery(), 300, False, silent)
    report = terms_report(symbolic("puma560"), TermQuery(), 300, True, silent)
    assert not report.complete
    assert (report.counted, report.wanted) == (4, 6)
    assert report.rows[-1].count.total == sum(row.count.total for row in report.rows[:-1])


def test_a_robot_whose_first_link_exceeds_the_budget_is_refused() -> None:
    with pytest.raises(LinkwiseError, match=r"planar3: link 'link1' needs more than 1 terms, after 0"):
        terms_report(symbolic("planar3"), TermQuery(), 1, True, silent)


@pytest.mark.parametrize(
    ("energy", "complaint"),
    [
        (sp.exp(Coordinate("a").q), "exp"),
        (sp.cos(sp.sqrt(2) * Coordinate("a").q), "whole combinations"),
        (sp.cos(0.123 * Coordinate("a").q), "round the ratio to a simple fraction"),
        (sp.cos(sp.Symbol("k", real=True) / 2), "whole combinations"),
        (1 / (1 + sp.Symbol("k", real=True)), "below a fraction line"),
        (sp.Symbol("k", real=True) ** 99, "a power above 63"),
    ],
)
def test_an_energy_without_terms_is_refused_by_name(energy: sp.Expr, complaint: str) -> None:
    a = Coordinate("a")
    values = dict.fromkeys(energy.free_symbols - {a.q}, 1.0)
    system = energy_system("odd", (a,), (LinkEnergy("arm", a.qd**2, energy * a.q),), values, symbolic=True)
    with pytest.raises(LinkwiseError, match=f"link 'arm': .*{complaint}"):
        terms_report(system, TermQuery(), 10**6, False, silent)


def test_equal_parameters_on_two_links_are_collected_in_their_sum() -> None:
    numeric = rigid_system(read_robot("planar2", Options(parameters="numeric")))
    *links, total = terms_report(numeric, TermQuery(), 10**6, False, silent).rows
    assert total.count.total < sum(row.count.total for row in links)


def test_the_part_kept_is_counted_with_its_motion() -> None:
    leg = rigid_system(read_robot(Path(__file__).parents[1] / "data" / "leg.toml", Options("symbolic")))
    report = terms_report(leg, TermQuery(), 10**6, False, silent)
    # Each segment adds m q̈ to the force along the first slide; together (m1 + m2 + m3 + m4) q̈.
    parts = [cost.rows[0].part for cost in report.operations]
    assert [part and part.shared for part in parts] == [1, 1, 1, 1]
    torque, part = report.sums[0]
    assert (part.shared, part.written) == (4, 4)
    each = [cost.rows[0].torque for cost in report.operations]
    assert torque.shared == sum(t.shared for t in each if t) + 3
    said = terms_markdown(report)
    assert "| τ_1,4, the part kept alone | 1 | 1 |" in said
    assert "| τ_1 over all links, the part kept alone | 4 | 4 |" in said
    assert terms_json(report)["operations_of_sums"]["1"]["kept"]["after_sharing"] == 4


@pytest.mark.parametrize(
    ("order", "coordinate", "operations"),
    # τ_1 = m q̈1 + q̈2 + k cos q1: q̈2 alone is free, and a motion off the path is no part.
    [(2, 0, 1), (2, 1, 0), (2, 2, None), (0, 0, 1)],
)
def test_a_part_costs_what_its_product_costs(order: int, coordinate: int, operations: int | None) -> None:
    a, b, c = Coordinate("a"), Coordinate("b"), Coordinate("c")
    m, k = sp.symbols("m k", real=True)
    energy = LinkEnergy("arm", m * a.qd**2 / 2 + a.qd * b.qd, k * sp.sin(a.q))
    tail = LinkEnergy("tail", c.qd**2, sp.S.Zero)
    system = energy_system("odd", (a, b, c), (energy, tail), {m: 1.0, k: 1.0}, symbolic=True)
    (cost,) = terms_report(system, TermQuery(0, 0, coordinate, order), 100, False, silent).operations
    part = cost.rows[0].part
    assert (part and part.shared) == operations


def test_counts_rest_on_expressions_alone() -> None:
    (found,) = link_torques(symbolic("planar1"), (0,), 100, silent)
    assert count_terms(found.torques[0], found.variables).total == GOLDEN["total"][0]


def test_a_gear_of_a_fraction_has_the_terms_of_any_other() -> None:
    # No two angles of the sums q2 and r q2, r not ±1, ±2 or 0, meet in one term.
    counts = [
        [row.count for row in terms_report(geared(ratio), TermQuery(None), 10**6, False, silent).rows]
        for ratio in (5.0, 1.5, 0.4)
    ]
    assert counts[0] == counts[1] == counts[2]


def test_a_parameter_named_like_a_coordinate_is_not_a_motion() -> None:
    x, mass = Coordinate("x", "m"), sp.Symbol("x", real=True)
    cart = LinkEnergy("cart", mass * x.qd**2 / 2, x.q**2)
    system = energy_system("slide", (x,), (cart,), {mass: 1.0}, symbolic=True)
    (row, _) = terms_report(system, TermQuery(), 100, False, silent).rows
    assert (row.count.total, row.kept) == (2, 1)


def test_coefficients_beyond_any_float_are_held_against_each_other() -> None:
    huge = Laurent({0: 10**400, 1: 10**392, 2: 10**390})
    assert set(huge.pruned(1e-9).terms) == {0, 1}
