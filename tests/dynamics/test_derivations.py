"""Closed forms of rigid links from their SymPy energies, beside those of the rigid-link rule."""

import json
import re
from pathlib import Path

import pytest
from linkwise import LinkwiseError, check_package, generate, read_system, write_package


def test_derivations_are_held_together_by_check(tmp_path: Path) -> None:
    files = generate(read_system("puma560"), ["numpy", "autograd"], "puma", derivation="energy")
    write_package(files, tmp_path / "puma")
    results = {result.name: result for result in check_package(tmp_path / "puma", samples=20)}
    assert not any(result.failed for result in results.values())
    for pair in (
        "closed forms (from energies) against rule",
        "closed forms (from energies) against Lagrangians",
        "rule against Lagrangians",
    ):
        assert results[f"derivations: {pair}"].error < 1e-9


def test_energies_cost_more_than_the_rule() -> None:
    def operations(derivation: str) -> int:
        text = generate(read_system("planar3"), ["numpy"], derivation=derivation)["manifest.json"]
        return int(json.loads(text)["operations"])

    assert operations("rule") < operations("energy") < 2 * operations("rule")


@pytest.mark.parametrize("derivation", ["rule", "energy"])
def test_sines_and_cosines_are_named_so_and_explained(derivation: str) -> None:
    files = generate(read_system("puma560"), ["numpy"], derivation=derivation)
    text = "".join(text for path, text in files.items() if path.startswith("forms/link_"))
    called = re.findall(r"^    ([a-z]+)\w+ = xp\.(sin|cos)\(", text, re.MULTILINE)
    assert set(called) == {("sin", "sin"), ("cos", "cos")}
    names = set(re.findall(r"^    ([a-z]+)\d+(?:_[xyz])? = ", text, re.MULTILINE))
    explained = set(re.findall(r"\b([a-z]+)[13]", files["forms/__init__.py"]))
    assert names <= explained | {"q", "qd", "qdd"}
    if derivation == "rule":  # axes of frames, velocities of their origins
        assert {"x", "y", "z", "v"} <= names


def test_loops_derive_nothing_and_a_derivation_has_a_name() -> None:
    robot = read_system("planar2")
    with pytest.raises(LinkwiseError, match="--kernel loops derives nothing, and --derivation energy does"):
        generate(robot, kernel="loops", derivation="energy")
    with pytest.raises(LinkwiseError, match="no derivation 'sympy'; choose rule or energy"):
        generate(robot, derivation="sympy")  # type: ignore[arg-type]
