"""Output is a function of the input alone; `make same` changes one thing at a time, also the Python."""

import builtins
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from conftest import DATA
from linkwise import Options, generate, read_system
from same_bytes import ALL_AT_ONCE, PLAIN, differing, files, make_locales


def test_the_surroundings_leave_no_trace_in_any_file(tmp_path: Path) -> None:
    locales = make_locales(tmp_path / "locales")
    plain = files(PLAIN, tmp_path / "plain", locales)
    other = files(ALL_AT_ONCE, tmp_path / "other", locales)
    assert len(plain) > 150
    assert plain.keys() == other.keys()
    assert not differing(plain, other)


def test_the_way_that_a_python_sums_leaves_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = DATA / "skew.toml"
    usual = [generate(read_system(robot, Options(p)), ["numpy", "autograd"]) for p in ("numeric", "symbolic")]

    def compensated(terms: Iterable[Any], /, start: Any = 0) -> Any:
        terms = list(terms)  # as from Python 3.12 on
        if type(start) in (int, float) and any(type(term) is float for term in terms):
            return math.fsum([start, *terms])
        return plain(terms, start)

    plain = builtins.sum
    monkeypatch.setattr(builtins, "sum", compensated)
    assert [
        generate(read_system(robot, Options(p)), ["numpy", "autograd"]) for p in ("numeric", "symbolic")
    ] == usual
