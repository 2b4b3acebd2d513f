"""Figures of README.md and docs/ are those of the code; docs/trust.md says where others are held."""

import json
import re
from collections.abc import Callable
from math import exp
from pathlib import Path
from types import ModuleType

import pytest
from conftest import PANDA
from linkwise.progress import silent
from linkwise.report import CurvePoint, curve
from linkwise.robot import Options, read_robot
from linkwise.symbolic.system import rigid_system
from tools.corpus_report import COUNTS, LIMIT
from tools.pages import PAGES

TEXT = " ".join(" ".join(page.read_text(encoding="utf-8").split()) for page in PAGES)


def stated(pattern: str) -> tuple[float, ...]:
    """The numbers of the one sentence that matches."""
    found = re.findall(pattern, TEXT)
    assert len(found) == 1, f"{pattern}: {len(found)} times in README.md and docs/"
    groups = found[0] if isinstance(found[0], tuple) else (found[0],)
    return tuple(float(number.replace(",", "").replace("−", "-")) for number in groups)


@pytest.fixture(scope="module")
def points() -> tuple[CurvePoint, ...]:
    return curve(rigid_system(read_robot("planar10", Options("symbolic"))), 10, 10**6, silent)


def test_shares_of_terms_and_operations(points: tuple[CurvePoint, ...]) -> None:
    five, ten = points[4], points[9]
    (terms,) = stated(r"At 10 joints (\d+) % of the expanded terms")
    (operations,) = stated(r"so there about (\d+) % of the operations")
    assert round(100 * ten.reduction) == terms
    assert round(100 * ten.operations_reduction) == operations
    text = r"\(([\d.]+) redundant for each kept\) nor the paper's own curve \(([\d.]+)\).*?"
    said = stated(text + r"counted are (\d+\.\d), and its curve gives (\d+\.\d)")
    for point, counted, papers in ((five, *said[:2]), (ten, *said[2:])):
        assert round(point.redundant_per_kept, 1) == counted
        y = 0.95 * (1 - exp(-0.44 * point.dof))
        assert round(y / (1 - y), 1) == papers


def test_corrections_are_as_many_as_the_readme_says() -> None:
    root = Path(__file__).parents[2]
    listed = (
        (root / "docs/method.md").read_text().split("## Where the paper is corrected")[1].split("\n## ")[0]
    )
    count = len(re.findall(r"^\d+\. ", listed, re.MULTILINE))
    for name in ("README.md", "CHANGELOG.md"):
        words = re.findall(r"with (\w+) corrections", (root / name).read_text())
        assert [("zero", "one", "two", "three", "four", "five", "six", "seven")[count]] == words


def test_equations_are_cited_by_the_numbers_that_the_papers_own_text_gives_them() -> None:
    root = Path(__file__).parents[2]
    texts = [page.read_text(encoding="utf-8") for page in PAGES]
    texts += [path.read_text(encoding="utf-8") for path in (root / "generator").rglob("*.py")]
    texts += [path.read_text(encoding="utf-8") for path in (root / "templates").rglob("*.j2")]
    cited = {int(n) for text in texts for n in re.findall(r"Eq\. (\d+)", text)}
    cited |= {int(n) for text in texts for n in re.findall(r"Eq\. [\d, and]+[-–, and]+(\d+)", text)}
    assert {1, 10, 16} <= cited <= {*range(1, 18), 21, 22, 23}


def test_numbers_and_operations_of_panda(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    if not PANDA.is_file():
        pytest.skip("needs real robots: pip install example-robot-data")
    manifest = json.loads((directory_of(str(PANDA)) / "manifest.json").read_text())
    (operations,) = stated(r"The full decomposition costs ([\d,]+) additions and multiplications")
    assert manifest["operations"] == operations
    (numbers,) = stated(r"\(7 joints, (\d+) numbers a sample")
    assert sum(map(len, package_of(str(PANDA)).load("numpy").layout)) == numbers


def test_the_readme_says_of_accuracy_what_the_table_of_promises_says() -> None:
    pinocchio, others = stated(r"link by link, about ([\de-]+) of the largest apart; .*? within ([\de-]+) -")
    assert stated(r"of the largest; about ([\de-]+) is reached") == (pinocchio,)
    for name in ("mujoco", "sympy", "opensim"):
        assert stated(rf"`tests/numeric/test_against_{name}\.py`[^|]*\| ([\de-]+)\b") == (others,)


def test_counts_of_the_corpus_are_those_that_make_corpus_holds() -> None:
    pattern = r"runs the (\d+) URDFs .*? 1 to 101 joints: (\d+) generate as they are, (\d+) need"
    whole, plain, helped = stated(pattern)
    assert {"plain": plain, "helped": helped, "never": whole - plain - helped} == COUNTS
    (error,) = stated(r"own torque agree with Pinocchio to ([\de-]+) of the largest")
    assert error <= LIMIT <= 10 * error


def test_bounds_of_a_long_chain_are_those_of_its_values() -> None:
    links, values, arithmetic, memory = stated(
        r"A chain of (\d+), of ([\d,]+) values, .*? alone would take (\d+\.\d) and memory alone (\d+\.\d)"
    )
    # of link j: c2 of i <= k, c1 of i and k, g and tau of i
    assert values == sum(j * (j + 1) / 2 + j * j + 2 * j for j in range(1, int(links) + 1))
    each = stated(r"that is ([\d.]+) ns of arithmetic and ([\d.]+) ns of memory a value")
    assert [round(values * ns / 1000, 1) for ns in each] == [arithmetic, memory]


def test_the_history_of_speed_has_the_columns_that_the_bench_prints(monkeypatch: pytest.MonkeyPatch) -> None:
    tests = Path(__file__).parents[1]
    monkeypatch.syspath_prepend(str(tests / "benchmarks"))
    from speed.results import Results
    from speed.table import HISTORY, history

    lines = [
        line for line in (tests.parent / "docs" / "speed.md").read_text().splitlines() if line[:1] == "|"
    ]
    assert lines[0].strip("| ").split(" | ") == ["day", "linkwise", "machine", *HISTORY]
    results = Results({"date": "", "linkwise": "", "processor": "", "vectors": "AVX2"})
    assert {line.count("|") for line in lines} == {history(results).count("|")}
