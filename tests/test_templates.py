"""A template's variables are exactly the fields of the view it is rendered with."""

from collections.abc import Mapping
from typing import Any

import jinja2
import pytest
import sympy as sp
from conftest import DATA
from linkwise import Coordinate, LinkEnergy, Options, energy_system, generate, read_system
from linkwise.emit import assemble, autograd, closed_forms, formulas
from linkwise.emit import render as rendering
from linkwise.emit.c import sources
from linkwise.emit.render import render, variables

ROBOTS = (
    ("planar2", Options()),
    ("planar2", Options("symbolic")),
    (DATA / "skew.toml", Options()),
    (DATA / "turntable.py", Options()),
)


@pytest.fixture(scope="module")
def views() -> dict[str, list[set[str]]]:
    """Fields of every view that generating a few robots renders, by template."""
    seen: dict[str, list[set[str]]] = {}

    def recording(template: str, view: Mapping[str, Any]) -> str:
        seen.setdefault(template, []).append(set(view))
        return render(template, view)

    with pytest.MonkeyPatch.context() as patch:
        for module in (rendering, autograd, sources, closed_forms, formulas, assemble):
            patch.setattr(module, "render", recording)
        for robot, options in ROBOTS:
            generate(read_system(robot, options))
    return seen


def emitted_templates() -> list[str]:
    loader = jinja2.PackageLoader("linkwise.templates", "")
    return [
        t
        for t in loader.list_templates()
        if t.endswith(".j2") and t.split("/")[0] not in ("analysis", "report")
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
