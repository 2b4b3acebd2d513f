"""A template's variables are exactly the fields of the view it is rendered with."""

import re
from collections.abc import Mapping
from typing import Any

import jinja2
import pytest
from conftest import DATA
from linkwise import Options, generate, read_system
from linkwise.emit import autograd, closed_forms, formulas, shared_texts
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
        for module in (rendering, autograd, sources, closed_forms, formulas, shared_texts):
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


def test_numbers_of_formulas_are_rounded_to_what_they_are_worth() -> None:
    files = generate(read_system(str(DATA / "skew.toml"), Options(tip="b")), ["formulas"], "skew")
    for name in ("formulas.txt", "formulas.tex"):
        assert max(len(digits) for digits in re.findall(r"[0-9]+", files[name])) <= 15
