"""The pages of the reports, and the templates that they are made from."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import sympy as sp
from linkwise.errors import LinkwiseError
from linkwise.escape import printable
from linkwise.progress import silent
from linkwise.render import render, variables
from linkwise.report import (
    DerivationTime,
    TermQuery,
    Timing,
    measure,
    read_seconds,
    reduction_markdown,
    reduction_page,
    seconds,
    seconds_json,
    seconds_markdown,
    seconds_page,
    study,
    terms_files,
    terms_markdown,
    terms_page,
    terms_report,
)
from linkwise.robot import Coordinate, Options, read_robot
from linkwise.symbolic.system import LinkEnergy, System, rigid_system
from linkwise.symbolic.user_energies import energy_system
from markdown_it import MarkdownIt

DERIVED = (DerivationTime(2, None, 0.25, 0.125),)


def planar(n: int) -> System:
    return rigid_system(read_robot(f"planar{n}", Options(parameters="symbolic")))


def test_each_template_uses_every_field_of_its_view_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: dict[str, set[str]] = {}

    def recording(template: str, view: Mapping[str, Any]) -> str:
        seen[template] = set(view)
        return render(template, view)

    for module in (terms_page, reduction_page, seconds_page, seconds):
        monkeypatch.setattr(module, "render", recording)
    arm = planar(1)
    result = study("arm", arm, 1, 1, 1, 100, silent)
    terms_markdown(terms_report(arm, TermQuery(), 100, False, silent))
    reduction_markdown(result)
    seconds_markdown(result, seconds_json("arm", measure(arm, (1,), silent), DERIVED))
    assert seen.keys() == {
        f"report/{name}.j2" for name in ("terms.md", "reduction.md", "measured.md", "row.py")
    }
    for template, fields in seen.items():
        assert fields == variables(template), template


def test_a_joint_that_is_in_no_term_has_no_column() -> None:
    report = terms_report(planar(4), TermQuery(joint=0, link=1), 100, False, silent)
    assert "| torque | gravity | acc 1 | acc 2 | vel 1 | vel 2 |\n" in terms_markdown(report)


def test_the_data_of_the_terms_hold_what_the_page_shows() -> None:
    report = terms_report(planar(2), TermQuery(), 100, False, silent)
    files, page = terms_files(report), terms_markdown(report)
    assert files["terms.csv"].decode().splitlines() == [
        "joint,link,terms,kept,reduction,gravity,acceleration_1,acceleration_2,velocity_1,velocity_2",
        "1,1,3,2,0.333333,1,2,0,0,0",
        "1,2,11,4,0.636364,2,4,3,1,2",
        "1,all,14,6,0.571429,3,6,3,1,2",
    ]
    for costs in json.loads(files["terms.json"])["operations"]:
        whole, kept = (tuple(costs[of]["1"].values()) for of in ("torque", "kept"))
        assert "| τ_1,{} as a whole | {} | {} |".format(costs["link"], *whole) in page
        assert "| τ_1,{}, the part kept alone | {} | {} |".format(costs["link"], *kept) in page


def test_measured_seconds_are_held_against_the_terms() -> None:
    result = study("arm", planar(2), 1, 2, 2, 100, silent)
    timings = [Timing(2, "closed form", 1.0, 2.0, 3.0), Timing(2, "autograd", 1.0, 10.0, 11.0)]
    said = seconds_markdown(result, seconds_json("arm", timings, DERIVED))
    assert "**Closed form**: at 2 DoF extracting saves 50.0% of the time, weaker than the 57.1%" in said
    assert "**Autograd**: at 2 DoF extracting saves 90.0% of the time, stronger than the 57.1%" in said
    longer = seconds_json("arm", [Timing(2, "autograd", 12.8, 10.0, 11.0)], DERIVED)
    assert "at 2 DoF extracting saves no time: it takes 28.0% more." in seconds_markdown(result, longer)


def test_an_arm_whose_first_joint_moves_no_inertia_is_refused() -> None:
    a = Coordinate("a")
    spring = energy_system("spring", (a,), (LinkEnergy("coil", sp.S.Zero, a.q**2),))
    with pytest.raises(LinkwiseError, match="no term of τ_1 contains q̈_1"):
        study("spring", spring, 1, 1, 1, 100, silent)


TIMING = {"dof": 1, "method": "autograd", "extract": 1.0, "whole": 2.0, "everything": 3.0}
MEASURED = {
    "robot": "arm",
    "batch": 1024,
    "machine": "a",
    "python": "3",
    "numpy": "2",
    "torch": "2",
    "timings": [TIMING],
    "derivations": [{"dof": 1, "whole": 2.0, "link": None, "rule": 0.5}],
    "derivation_limit": 20.0,
}


@pytest.mark.parametrize(
    "change",
    [
        {"robot": ["arm"]},
        {"machine": None},
        {"batch": "many"},
        {"timings": 3},
        {"timings": [TIMING | {"method": "**guess**"}]},
        {"timings": [TIMING | {"whole": 0}]},
        {"timings": [TIMING | {"dof": math.inf}]},
        {"timings": [TIMING | {"extract": math.nan}]},
        {"remark": math.nan},
        {"derivations": [{"dof": 1}]},
    ],
    ids=str,
)
def test_a_measurement_that_is_none_is_told(change: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "measured.json"
    path.write_text(json.dumps(MEASURED), encoding="utf-8")
    assert read_seconds(path) == MEASURED
    path.write_text(json.dumps(MEASURED | change), encoding="utf-8")
    with pytest.raises(LinkwiseError, match=r"measured\.json: not a measurement; give the measured\.json"):
        read_seconds(path)


@pytest.mark.parametrize("text", ["[" * 100_000, "9" * 5000, '{"timings": "', "\ufeff{}", "[]"], ids=range(5))
def test_json_that_is_no_measurement_is_told(text: str, tmp_path: Path) -> None:
    (tmp_path / "measured.json").write_text(text, encoding="utf-8")
    with pytest.raises(LinkwiseError, match=r"measured\.json: not a measurement"):
        read_seconds(tmp_path / "measured.json")


def tables(page: str) -> list[list[list[str]]]:
    """Tables of a Markdown page as a reader sees them: rows of cells, the head among them."""
    found: list[list[list[str]]] = []
    for token, cell in pairwise(MarkdownIt("commonmark").enable("table").parse(page)):
        if token.type == "table_open":
            found.append([])
        elif token.type == "tr_open":
            found[-1].append([])
        elif token.type in ("td_open", "th_open"):
            found[-1][-1].append("".join(child.content for child in cell.children or []))
    return found


def test_every_table_of_a_page_is_read_as_one() -> None:
    """Terms counted by hand: m r² q̈ + I q̈ + m r g cos q of link 1, eleven of link 2."""
    result = study("arm", planar(2), 1, 2, 2, 100, silent)
    timings = [Timing(2, method, 1.0, 2.0, 3.0) for method in ("closed form", "autograd")]
    report = terms_report(planar(2), TermQuery(), 100, False, silent)
    summary, motions, operations = tables(terms_markdown(report))
    assert summary == [
        ["torque", "link", "terms", "kept", "reduction"],
        ["τ_1,1", "link1", "3", "2", "33.3 %"],
        ["τ_1,2", "link2", "11", "4", "63.6 %"],
        ["τ_1", "all counted", "14", "6", "57.1 %"],
    ]
    assert motions == [
        ["torque", "gravity", "acc 1", "acc 2", "vel 1", "vel 2"],
        ["τ_1,1", "1", "2", "0", "0", "0"],
        ["τ_1,2", "2", "4", "3", "1", "2"],
        ["τ_1", "3", "6", "3", "1", "2"],
    ]
    assert [len(row) for row in operations] == [3] * 9
    terms, uncombined, costs = tables(reduction_markdown(result))
    assert [row[:4] for row in terms[1:]] == [["1", "3", "2", "0.3333"], ["2", "14", "6", "0.5714"]]
    assert [row[:3] for row in uncombined[1:]] == [["1", "4", "3"], ["2", "22", "10"]]
    assert [len(row) for row in (*terms, *costs)] == [7] * 3 + [8] * 3
    seconds, derivations = tables(seconds_markdown(result, seconds_json("arm", timings, DERIVED)))
    assert seconds == [
        ["DoF", "method", "extract", "whole", "everything", "reduction 1 − extract/whole"],
        ["2", "closed form", "1.000", "2.000", "3.000", "0.500"],
        ["2", "autograd", "1.000", "2.000", "3.000", "0.500"],
    ]
    assert derivations[1:] == [["2", "–", "0.250", "0.125"]]
    assert all(cell for table in (operations, terms, costs, seconds) for row in table for cell in row)


@pytest.mark.parametrize("name", ["a|b`c`\\|d", "_a_ *b* <img src=x>", "$x^$ \x1b[31m\n# b |---|"])
def test_tables_keep_their_cells_whatever_the_names(name: str, tmp_path: Path) -> None:
    robot = replace(read_robot("planar1", Options(parameters="symbolic")), name=name)
    robot = replace(robot, links=tuple(replace(link, name=name) for link in robot.links))
    page = terms_markdown(terms_report(rigid_system(robot), TermQuery(), 1000, False, silent))
    assert [row[1] for row in tables(page)[0]] == ["link", printable(name), "all counted"]
    parsed = MarkdownIt("commonmark").enable("table").parse(page)
    assert parsed[0].tag == "h1"
    heading = "".join(child.content for child in parsed[1].children)
    assert heading == f"Terms in the partial torques of {printable(name)}"
