"""Tests that cannot run here are counted, and say what to install."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.needed import missing

TESTS = Path(__file__).parents[1]
PAGES = "analysis/test_browser.py"


@pytest.mark.ship
def test_pages_without_a_browser_are_counted_with_what_to_install(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "pytest", str(TESTS / PAGES), "-k", "slider", "-p", "no:cacheprovider"]
    done = subprocess.run(
        command, env={"PATH": str(tmp_path)}, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    reason = "needs chromium, chromedriver: apt-get install chromium chromium-driver"
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"skipped 2 of {PAGES}: {reason}" in done.stdout.splitlines()


def test_what_is_missing_is_told_by_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    assert missing(sys.executable) == ""
    monkeypatch.setenv("PATH", "")
    assert missing("gcc", "dot") == "needs gcc, dot: apt-get install gcc graphviz"


@pytest.mark.parametrize("path", sorted(TESTS.rglob("test_*.py")), ids=lambda path: path.stem)
def test_every_reason_to_skip_says_what_is_needed(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            given = [k.value for k in node.keywords if k.arg == "reason"]
            if node.func.attr == "skip":
                given += node.args[:1]
            elif node.func.attr not in ("skipif", "importorskip"):
                continue
            for reason in given:
                if isinstance(reason, ast.Constant):
                    assert str(reason.value).startswith("needs "), f"{path.name}:{node.lineno}"
