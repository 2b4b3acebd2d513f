"""A template's variables are exactly the fields of the view it is rendered with."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2
import pytest
import sympy as sp
from conftest import DATA
from helpers import urdf_text
from helpers.urdf_text import joint
from linkwise import Coordinate, LinkEnergy, Options, energy_system, generate, read_system
from linkwise import render as rendering
from linkwise.emit import (
    autograd,
    closed_forms,
    constraint_forms,
    formula_page,
    legend,
    shared_texts,
    tree_file,
)
from linkwise.emit.c import loops, sources
from linkwise.render import render, variables

ROBOTS = (
    ("planar2", Options()),
    ("planar2", Options("symbolic")),
    (DATA / "skew.toml", Options()),
    (DATA / "turntable.py", Options()),
    (DATA / "bead_on_wire.py", Options()),
)


@pytest.fixture(scope="module")
def views() -> dict[str, list[set[str]]]:
    """Fields of every view that generating a few robots renders, by template."""
    seen: dict[str, list[set[str]]] = {}

    def recording(template: str, view: Mapping[str, Any]) -> str:
        seen.setdefault(template, []).append(set(view))
        return render(template, view)

    with pytest.MonkeyPatch.context() as patch:
        python = autograd, closed_forms, constraint_forms, shared_texts, tree_file
        for module in (rendering, loops, sources, formula_page, legend, *python):
            patch.setattr(module, "render", recording)
        for robot, options in ROBOTS:
            generate(read_system(robot, options))
        generate(read_system("planar2", Options("symbolic")), kernel="loops")
        generate(read_system("planar2"), ["c"])
    return seen


def emitted_templates() -> list[str]:
    loader = jinja2.PackageLoader("linkwise.templates", "")
    return [
        t
        for t in loader.list_templates()
        if t.endswith(".j2") and t.split("/")[0] not in ("analysis", "report", "study")
    ]


@pytest.mark.parametrize("template", emitted_templates())
def test_template_uses_every_field_of_its_view_and_no_other(
    template: str, views: dict[str, list[set[str]]]
) -> None:
    assert template in views, "no robot renders it"
    for fields in views[template]:
        assert fields == variables(template)


def test_missing_field_raises() -> None:
    with pytest.raises(jinja2.UndefinedError):
        render("package/init.py.j2", {"package": "arm"})


@pytest.mark.parametrize("derivation", ["rule", "energy"])
def test_both_pages_of_formulas_in_steps_say_what_names_mean(derivation: str) -> None:
    text, latex = (
        formula_page.formula_page(ending, [("t1", "2*q_1"), (torque, "t1")], ["a"], ["b"], [], derivation)
        for ending, torque in (("txt", "tau_1_1"), ("tex", r"\tau_{1,1}"))
    )
    told = [line for line in text.partition("\n\nt1")[0].splitlines() if line]
    said = [line.removeprefix("%").removeprefix(" ") for line in latex.splitlines() if line.startswith("%")]
    assert len(told) > 8
    assert [line for line in said if line][1:] == told[1:]


def test_numbers_of_formulas_are_rounded_to_what_they_are_worth() -> None:
    files = generate(read_system(str(DATA / "skew.toml"), Options(tip="b")), ["formulas"], "skew")
    for name in ("formulas.txt", "formulas.tex"):
        assert max(len(digits) for digits in re.findall(r"[0-9]+", files[name])) <= 15


def test_fractions_of_many_digits_are_rounded() -> None:
    x = Coordinate("x", "m")
    steep = LinkEnergy("a", x.qd**2, sp.Rational(10**15 + 1, 7) * x.q**2)
    files = generate(energy_system("steep", [x], [steep]), ["formulas"])
    assert re.findall(r"[0-9]{13,}", files["formulas.txt"]) == []


RX = Coordinate("x", "m")
K, C = sp.symbols("k c")
KEPT = {
    "a power of e": (1e-13 * sp.exp(15 * RX.q) + K * RX.q, "exp(15*q_1)"),
    "a reciprocal": (1e-14 / (RX.q - 4) + K * RX.q, "1.0e-14/(q_1**2"),
    "a power of a place": (1e-15 * RX.q**9 + K * RX.q, "q_1**8"),
    "beside a power of e": (1e13 * sp.exp(-30 * RX.q) + sp.cos(RX.q), "sin(q_1)"),
    "a small parameter": (C * RX.q**2 + K * RX.q, "q_1"),
    "beside a small parameter": (1e-13 * K * sp.cos(RX.q) + C * sp.sin(RX.q), "sin(q_1)"),
}


@pytest.mark.parametrize("case", KEPT)
@pytest.mark.parametrize("symbolic", [False, True])
def test_terms_of_any_size_stay_in_formulas_however_small_their_numbers(case: str, symbolic: bool) -> None:
    energy, term = KEPT[case]
    link = LinkEnergy("a", RX.qd**2, energy)
    system = energy_system("spring", [RX], [link], {K: 40.0, C: 1e-14}, symbolic)
    assert term in generate(system, ["formulas"])["formulas.txt"].partition("tau_1_1 =")[2]


@pytest.mark.parametrize("robot", ["skew", "turned", "energies"])
def test_what_cancelling_leaves_is_not_shown(
    robot: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if robot == "skew":
        system = read_system(DATA / "skew.toml")
    elif robot == "turned":
        upright, slide = joint("j", "a", "b", axis="0 0 1"), joint("k", "b", "c", type="prismatic")
        (tmp_path / "turned.urdf").write_text(urdf_text.chain(upright, slide))
        system = read_system(tmp_path / "turned.urdf", Options("symbolic"))
    else:
        y = Coordinate("y")
        place = [0.7 * RX.q * f(y.q) + 0.1 * RX.q * f(y.q + 0.3) for f in (sp.sin, sp.cos)]
        rates = [sp.diff(p, RX.q) * RX.qd + sp.diff(p, y.q) * y.qd for p in place]
        system = energy_system("slide", [RX, y], [LinkEnergy("a", 1.3 * sum(v**2 for v in rates) / 2, 0)])
    small = re.compile("e-1[4-9]|e-[2-9]")
    assert not small.search(generate(system, ["formulas"])["formulas.txt"])
    monkeypatch.setattr("linkwise.emit.formulas.ROUNDING", 0.0)
    assert small.search(generate(system, ["formulas"])["formulas.txt"])


@pytest.mark.parametrize(
    ("file", "symbol"), [("formulas.txt", "p_m_load"), ("formulas.tex", r"p_{\mathrm{m\_load}}")]
)
def test_formulas_say_what_their_symbols_are(file: str, symbol: str) -> None:
    rail, load = Coordinate("rail x", "m"), sp.Symbol("m load")
    links = [LinkEnergy("box", load * rail.qd**2 / 2, sp.S.Zero)]
    cart = energy_system("cart", [rail], links, {load: 2.0}, symbolic=True)
    head = [line.removeprefix("% ") for line in generate(cart, ["formulas"])[file].splitlines()]
    assert [line for line in head if " is " in line] == [
        "q_1 is joint 'rail x'; qd_1 and qdd_1 are its velocity and acceleration.",
        "Link 1 is 'box'.",
        f"{symbol} is parameter 'm load'.",
    ]


@pytest.mark.parametrize(("robot", "told"), [("planar2", True), (str(DATA / "cart_pendulum.py"), False)])
def test_twists_are_explained_where_energies_have_them(robot: str, told: bool) -> None:
    text = generate(read_system(robot), ["autograd"])["energies/link_1.py"]
    assert ("`twist`" in text) == told
