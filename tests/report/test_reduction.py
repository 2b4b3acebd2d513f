"""The cost-reduction curve against the goldens, its fit, and the polynomials behind it."""

import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from linkwise.dynamics.derive import derive
from linkwise.errors import LinkwiseError
from linkwise.plotstyle import styled
from linkwise.progress import silent
from linkwise.render import render
from linkwise.report import (
    PAPER,
    CurvePoint,
    SavingsLine,
    Timing,
    count_polynomial,
    curve,
    derivation_seconds,
    draw_savings,
    fit,
    held_against,
    link_operations,
    measure_derivations,
    reduction_json,
    reduction_markdown,
    savings_lines,
    study,
    verdicts,
)
from linkwise.report.reduction_verdicts import _limit_verdict
from linkwise.report.seconds import _elapsed, first_links, row_view
from linkwise.report.spatial_arms import is_spatial
from linkwise.report.uncombined_terms import uncombined_terms
from linkwise.robot import Options, read_robot
from linkwise.symbolic.chain_rule import partial_torques
from linkwise.symbolic.system import RigidSystem, System, rigid_system
from matplotlib.figure import Figure

GOLDEN = json.loads((Path(__file__).parents[1] / "data" / "term_counts.json").read_text())


def planar(n: int) -> System:
    return rigid_system(read_robot(f"planar{n}", Options(parameters="symbolic")))


@pytest.fixture(scope="module")
def points() -> tuple[CurvePoint, ...]:
    return curve(planar(14), 14, 10**6, silent)


def test_counts_are_the_goldens(points: tuple[CurvePoint, ...]) -> None:
    ten = points[:10]
    assert [p.dof for p in ten] == GOLDEN["n"]
    assert [p.total for p in ten] == GOLDEN["total"]
    assert [p.kept for p in ten] == GOLDEN["kept"]
    assert [round(p.reduction, 6) for p in ten] == GOLDEN["reduction"]


def test_the_fit_and_the_papers_curve_meet_the_points(points: tuple[CurvePoint, ...]) -> None:
    dof, y = [p.dof for p in points[:10]], [p.reduction for p in points[:10]]
    free, paper = fit(dof, y), held_against(0.95, 0.44, dof, y)
    assert free is not None
    assert (free.a, free.rate) == pytest.approx((0.9432, 0.4508), abs=1e-4)
    assert free.rmse == pytest.approx(0.0064, abs=1e-4)
    assert paper.rmse == pytest.approx(0.0074, abs=1e-4)
    assert paper.largest == pytest.approx(0.0155, abs=1e-4)


def test_polynomials_from_eight_counts_predict_the_next_six(points: tuple[CurvePoint, ...]) -> None:
    total = count_polynomial([p.total for p in points[:8]])
    kept = count_polynomial([p.kept for p in points[:8]])
    assert total is not None
    assert kept is not None
    assert total.coefficients == (3, 11, 19, 19, 10, 2)
    assert kept.coefficients == (2, 4, 3, 1)
    assert [total(p.dof) for p in points[8:]] == [p.total for p in points[8:]]
    assert [kept(p.dof) for p in points[8:]] == [p.kept for p in points[8:]]


T = sp.Symbol("t")
Q = [sp.Function(f"q{k}")(T) for k in range(3)]
POLAR = """schema = 1
name = "polar"
gravity = [0, -9.81, 0]
[[link]]
name = "beam"
mass = 2.0
com = [0.5, 0, 0]
inertia = { xx = 0.01, yy = 0.3, zz = 0.3 }
[[link]]
name = "carriage"
mass = 3.0
com = [0.25, 0, 0]
inertia = { xx = 0.02, yy = 0.1, zz = 0.1 }
[[joint]]
name = "turn"
type = "revolute"
parent = "base"
child = "beam"
axis = [0, 0, 1]
[[joint]]
name = "slide"
type = "prismatic"
parent = "beam"
child = "carriage"
axis = [1, 0, 0]
"""


def terms_by_sympy(
    places: Sequence[tuple[sp.Expr, sp.Expr]], angles: Sequence[sp.Expr]
) -> list[tuple[int, int]]:
    """Terms of τ_1 of the first 1, 2, … links, and those with q̈_1, of energies in the world's axes."""
    counts, total, kept = [], 0, 0
    for j, ((x, y), angle) in enumerate(zip(places, angles, strict=True)):
        m, inertia, g = sp.symbols(f"m{j} I{j} g")
        kinetic = m * (sp.diff(x, T) ** 2 + sp.diff(y, T) ** 2) / 2 + inertia * sp.diff(angle, T) ** 2 / 2
        lagrangian = kinetic - m * g * y
        torque = sp.diff(sp.diff(lagrangian, sp.diff(Q[0], T)), T) - sp.diff(lagrangian, Q[0])
        terms = sp.Add.make_args(sp.expand(torque))
        total, kept = total + len(terms), kept + sum(term.has(sp.diff(Q[0], T, 2)) for term in terms)
        counts.append((total, kept))
    return counts


def counts(system: System, links: int) -> list[tuple[int, int]]:
    assert isinstance(system, RigidSystem)
    return [(pair.total, pair.kept) for pair in uncombined_terms(system, links, 10**6)]


def test_uncombined_terms_of_a_planar_arm_are_those_that_sympy_expands() -> None:
    x = y = sp.S.Zero
    angles, places = [sum(Q[: j + 1]) for j in range(3)], []
    for j, angle in enumerate(angles):
        length, r = sp.symbols(f"l{j} r{j}")
        places.append((x + r * sp.cos(angle), y + r * sp.sin(angle)))
        x, y = x + length * sp.cos(angle), y + length * sp.sin(angle)
    assert counts(planar(3), 3) == terms_by_sympy(places, angles)


def test_uncombined_terms_of_a_slide_are_those_that_sympy_expands(tmp_path: Path) -> None:
    (tmp_path / "polar.toml").write_text(POLAR)
    system = rigid_system(read_robot(str(tmp_path / "polar.toml"), Options(parameters="nonzero")))
    r, s = sp.symbols("r s")
    places = [(a * sp.cos(Q[0]), a * sp.sin(Q[0])) for a in (r, Q[1] + s)]
    assert counts(system, 2) == terms_by_sympy(places, [Q[0], Q[0]])


def test_both_conventions_give_sixteen_redundant_terms_and_one_gives_the_papers_curve() -> None:
    result = study("planar arm", planar(10), 1, 10, 10, 10**6, silent)
    assert [(p.total, p.kept) for p in result.uncombined[3:5]] == [(204, 44), (464, 75)]
    assert round(result.points[9].redundant_per_kept) == round(result.uncombined[9].redundant_per_kept) == 16
    assert result.uncombined_fit is not None
    assert (result.uncombined_fit.a, result.uncombined_fit.rate) == pytest.approx((0.9626, 0.4004), abs=1e-3)
    assert "misses these points by up to 0.0882" in " ".join(verdicts(result))


def test_the_report_of_a_spatial_arm_says_what_differs_and_that_no_fit_is_a_share() -> None:
    puma = rigid_system(read_robot("puma560", Options()))
    result = study("puma560", puma, 1, 4, 4, 10**6, silent)
    *before, remark = verdicts(result)
    assert remark.startswith(
        "**A spatial arm differs.** The paper's claim is about arms that move in a plane"
    )
    shares = (result.points[-1].reduction, result.uncombined[-1].reduction)
    assert "{:.1%} of the terms are saved at 4 DoF, {:.1%} where".format(*shares) in remark
    assert "Of its first link all terms are kept: that axis carries no weight" in remark
    assert result.fitted is not None
    assert result.fitted.a > 1
    assert "an A above 1 tells of no limit" in before[0]


def test_arms_in_a_plane_are_told_from_spatial_ones(tmp_path: Path) -> None:
    (tmp_path / "polar.toml").write_text(POLAR)
    flat = planar(4), rigid_system(read_robot(str(tmp_path / "polar.toml"), Options()))
    assert [is_spatial(system, len(system.links)) for system in flat] == [False, False]
    puma = rigid_system(read_robot("puma560", Options()))
    assert [is_spatial(puma, links) for links in (1, 2)] == [False, True]
    assert "spatial" not in " ".join(verdicts(study("arm", planar(3), 1, 3, 3, 10**6, silent)))


def test_uncombined_terms_end_at_the_budget() -> None:
    system = planar(5)
    assert isinstance(system, RigidSystem)
    assert len(list(uncombined_terms(system, 5, 100))) == 3


def test_seconds_are_those_that_pass() -> None:
    assert 0.02 <= _elapsed(lambda: time.sleep(0.01), 2) < 60.0


def test_an_arms_first_links_are_an_arm_of_their_own() -> None:
    for spec in ("planar5", "puma560"):
        whole = rigid_system(read_robot(spec, Options()))
        part = first_links(whole, 3)
        assert isinstance(part, RigidSystem)
        assert [link.name for link in part.robot.links] == [link.name for link in whole.robot.links[:3]]
        assert [link.name for link in part.links] == [link.name for link in whole.links[:3]]
        assert len(part.coordinates) == 3


def test_what_is_timed_derives_the_torques() -> None:
    system, rng = planar(2), np.random.default_rng(4)
    state = dict(system.parameters) | {
        s: rng.uniform(-1.0, 1.0) for c in system.coordinates for s in (c.q, c.qd, c.qdd)
    }
    for link, lagrangian in enumerate(derivation_seconds._lagrangians(system, 2)):
        for i, torque in partial_torques(system, link).items():
            timed = derivation_seconds._torque(lagrangian, system.coordinates[i], system.coordinates)
            assert float(timed.subs(state)) == pytest.approx(float(torque.subs(state)), rel=1e-12)


def test_deriving_by_sympy_stops_at_its_limit_of_time() -> None:
    first, second = measure_derivations(planar(2), (1, 2), silent, limit=0.0)
    assert (first.whole, first.link, second.whole, second.link) == (None, None, None, None)
    assert min(first.rule, second.rule) > 0.0


def _derive_for_seconds(folder: Path, _: object, answer: Any) -> None:
    answer.send("ready")
    time.sleep(5.0)
    (folder / "done").touch()


def test_a_derivation_past_its_limit_of_time_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(derivation_seconds, "_derive", _derive_for_seconds)
    bounded: Any = derivation_seconds._bounded
    assert bounded(tmp_path, (), 0.0) is None
    assert list(tmp_path.iterdir()) == []


def test_deriving_by_sympy_is_timed_up_to_the_last_link(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(derivation_seconds, "_bounded", lambda lagrangian, moving, limit: float(len(moving)))
    times = measure_derivations(planar(3), (1, 3), silent)
    assert [(n.dof, n.whole, n.link) for n in times] == [(1, 1.0, 1.0), (3, 3.0, 3.0)]


def test_a_curve_whose_counts_grow_alike_has_a_limit_below_one() -> None:
    total, kept = (count_polynomial([k * n**2 + 1 for n in range(1, 9)]) for k in (3, 2))
    assert total is not None
    assert kept is not None
    assert total.degree == kept.degree == 2
    assert _limit_verdict(total, kept).startswith("**Weaker: many DoF.**")
    result = study("arm", planar(3), 1, 3, 3, 10**6, silent)
    for told, known in ((True, (total, kept)), (False, (None, kept)), (False, (total, None))):
        said = " ".join(verdicts(replace(result, total=known[0], kept=known[1])))
        assert ("many DoF" in said) == told


def test_no_polynomial_is_claimed_without_counts_to_confirm_it() -> None:
    assert count_polynomial([1, 2, 4, 8, 16, 32]) is None
    assert count_polynomial([3, 14, 44, 112, 247, 490, 896]) is None


def test_emitted_code_saves_less_than_the_terms_promise(points: tuple[CurvePoint, ...]) -> None:
    ten = points[9]
    assert ten.operations_reduction < ten.written_reduction < ten.reduction
    assert ten.part.shared < ten.part.written


def test_operations_hold_the_product_with_the_motion_and_the_sum_over_links(
    points: tuple[CurvePoint, ...],
) -> None:
    costs = list(link_operations(planar(10), (0,), PAPER))
    rows = [cost.rows[0] for cost in costs]
    one, ten = points[0], points[9]
    assert (one.part.shared, one.torque.shared) == (4, 7)
    # n coefficients, n − 1 additions, one multiplication; n torques, n − 1 additions.
    assert ten.part.shared == sum(row.coefficient.shared for row in rows if row.coefficient) + 9 + 1
    assert ten.torque.shared == sum(row.torque.shared for row in rows if row.torque) + 9


def test_what_is_timed_is_the_part_and_the_whole() -> None:
    system = planar(3)
    module: dict[str, Any] = {}
    exec(render("report/row.py.j2", row_view(system, derive(system))), module)
    draw = np.random.default_rng(3)
    q, qd, qdd = draw.standard_normal((3, 5, 3))
    p = {symbol.name: value for symbol, value in system.parameters.items()}
    without = qdd * [0.0, 1.0, 1.0]
    part = module["whole"](q, qd, qdd, p) - module["whole"](q, qd, without, p)
    np.testing.assert_allclose(module["extract"](q, qd, qdd, p), part, rtol=1e-12, atol=1e-12)


def test_further_counts_stop_at_the_budget_silently() -> None:
    assert len(curve(planar(14), 3, 150, silent, beyond=14)) == 4
    assert len(curve(planar(4), 3, 10**6, silent, beyond=14)) == 4


def drawn(lines: Sequence[SavingsLine]) -> Any:
    """Axes of the comparison, drawn with the plots' own settings."""
    with styled():
        figure = Figure(figsize=(6.3, 4.0), layout="constrained")
        draw_savings(figure, "arm", lines)
        return figure.axes[0]


def test_the_comparison_is_titled_by_what_is_shown_and_its_legend_tells_dashes() -> None:
    result = study("arm", planar(9), 1, 4, 9, 10**6, silent)
    timings = [Timing(n, method, 1.0, 2.0, 3.0) for n in (1, 2) for method in ("closed form", "autograd")]
    assert drawn(savings_lines(result)).get_title("left") == "arm: savings in terms and operations"
    assert drawn(savings_lines(result)).get_xlabel().startswith("degrees of freedom")
    assert not [line.label for line in savings_lines(result) if "paper" in line.label]  # it names no form
    measured = drawn(savings_lines(result, timings))
    assert measured.get_title("left") == "arm: savings in terms, operations and seconds"
    legend = measured.get_legend()
    for line in legend.get_lines():
        length = legend.handlelength * legend.prop.get_size()
        _, dashes = line._dash_pattern
        assert dashes is None or length >= 2 * sum(dashes)


def test_the_study_says_where_the_claim_holds() -> None:
    said = " ".join(verdicts(study("planar arm", planar(14), 1, 10, 14, 10**6, silent)))
    assert "Holds: the curve" in said
    assert "Stronger: 5 DoF.** 5.2 redundant" in said
    assert "the paper says about 3, and its curve gives 5.4." in said
    assert "Holds: 10 DoF.** 15.9 redundant" in said
    assert "the paper says about 16, and its curve gives 15.2." in said
    assert "The paper does not say how it counted: that it was as above is inferred" in said
    assert "falls like 10/n^2" in said
    assert "it ends at A = 0.95, which y passes at 12 DoF." in said
    assert "Weaker: emitted code" in said


def test_the_page_holds_every_count_and_what_it_saves() -> None:
    result = study("arm", planar(9), 1, 3, 9, 10**6, silent)
    rows = [line.strip("| ").split(" | ") for line in reduction_markdown(result).splitlines() if "| " in line]
    table = [row for row in rows if row[0].isdigit()]
    assert [row[:5] for row in table[:3]] == [
        ["1", "3", "2", "0.3333", "0.5"],
        ["2", "14", "6", "0.5714", "1.3"],
        ["3", "44", "13", "0.7045", "2.4"],
    ]
    assert result.fitted is not None
    for at, (row, point) in enumerate(zip(table[:3], result.points, strict=True)):
        y = 1 - point.kept / point.total
        assert float(row[5]) == pytest.approx(y - result.fitted(point.dof), abs=1e-4)
        assert float(row[6]) == pytest.approx(y - 0.95 * (1 - np.exp(-0.44 * point.dof)), abs=1e-4)
        pair = result.uncombined[at]
        assert table[3 + at][1:3] == [str(pair.total), str(pair.kept)]
        torque, part, reduction, written, kept, saved, everything = map(float, table[6 + at][1:])
        assert reduction == pytest.approx(1 - part / torque, abs=1e-4)
        assert saved == pytest.approx(1 - kept / written, abs=1e-4)
        assert part <= torque <= written
        assert everything == sum(forms.decomposition_cost for forms in derive(planar(3))[: at + 1])


def test_the_data_hold_what_the_page_shows() -> None:
    result = study("arm", planar(9), 1, 3, 9, 10**6, silent)
    data = reduction_json(result)
    assert [row["reduction"] for row in data["points"]] == [0.333333, 0.571429, 0.704545]
    for row in data["points"]:
        assert row["operations_reduction"] == pytest.approx(
            1 - row["kept_operations"] / row["operations"], abs=1e-6
        )
        saved = 1 - row["kept_operations_written_out"] / row["operations_written_out"]
        assert row["written_out_reduction"] == pytest.approx(saved, abs=1e-6)
    assert data["polynomials"]["total"]["newton_coefficients"][:3] == [3, 11, 19]
    assert data["polynomials"]["kept"] == {
        "newton_coefficients": [2, 4, 3, 1],
        "fitted_to_dof": 4,
        "checked_to_dof": 9,
    }


def test_an_arm_beyond_the_budget_says_what_to_ask_for() -> None:
    with pytest.raises(LinkwiseError, match=r"4 links need more than 100 terms; ask for at most 3"):
        curve(planar(8), 8, 100, silent)
