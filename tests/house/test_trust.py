"""docs/trust.md names tests and commands that exist."""

import re
from pathlib import Path

import pytest
from mutation.rooms import ROOMS
from mutation.verdicts import END, HEAD, MARK

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/trust.md").read_text(encoding="utf-8")


def test_every_file_named_is_there() -> None:
    named = set(re.findall(r"`((?:tests|docs|generator|templates)/[\w/.]+)`", PAGE))
    assert len(named) >= 15
    assert not [path for path in named if not (ROOT / path).is_file()]


def test_every_make_target_named_is_there() -> None:
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = set(re.findall(r"`make (\w+)`", PAGE))
    assert {"test", "corpus", "random", "fuzz", "same"} <= named
    assert named <= targets


def test_every_promise_says_what_holds_it() -> None:
    rows = [line for line in PAGE.partition(MARK)[0].splitlines() if line.startswith("|")]
    rows += [line for line in PAGE.partition(END)[2].splitlines() if line.startswith("|")]
    promises = [row for row in rows if not re.match(r"\| (promise|figure) |\|--", row)]
    assert not [row for row in promises if "tests/" not in row and "`make " not in row]


def test_each_room_is_in_the_table_of_slips_and_95_of_100_are_caught() -> None:
    table = PAGE.partition(MARK)[2].partition(END)[0].removeprefix(HEAD)
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    assert [row[0] for row in rows] == list(ROOMS)
    for room, mutants, caught, equivalent, score in rows:
        share = 100 * int(caught) / (int(mutants) - int(equivalent))
        assert float(score.removesuffix(" %")) == pytest.approx(share, abs=0.051), room
        assert share >= 95, room


def test_the_readme_points_there() -> None:
    assert "(docs/trust.md)" in (ROOT / "README.md").read_text(encoding="utf-8")
