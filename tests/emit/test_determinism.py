"""Output is a function of the input alone; `make same` changes one thing at a time, also the Python."""

import builtins
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from conftest import DATA
from linkwise import Options, generate, read_system
from tools.same_bytes import (
    ALL_AT_ONCE,
    PLAIN,
    Surroundings,
    differing,
    files,
    make_locales,
    on_another_system,
)


@pytest.fixture(scope="module")
def locales(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_locales(tmp_path_factory.mktemp("locales"))


@pytest.fixture(scope="module")
def plain(locales: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return files(PLAIN, tmp_path_factory.mktemp("plain"), locales)


@pytest.mark.ship
@pytest.mark.parametrize("other", [ALL_AT_ONCE, on_another_system("windows")], ids=["Linux", "Windows"])
def test_the_surroundings_leave_no_trace_in_any_file(
    other: Surroundings, plain: dict[str, bytes], locales: Path, tmp_path: Path
) -> None:
    found = files(other, tmp_path, locales)
    assert len(plain) > 150
    assert plain.keys() == found.keys()
    assert not differing(plain, found)


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
