"""docs/trust.md names tests and commands that exist."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
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
    rows = [line for line in PAGE.splitlines() if line.startswith("|")]
    promises = [row for row in rows if not re.match(r"\| (promise|figure) |\|--", row)]
    assert not [row for row in promises if "tests/" not in row and "`make " not in row]


def test_the_readme_points_there() -> None:
    assert "(docs/trust.md)" in (ROOT / "README.md").read_text(encoding="utf-8")
