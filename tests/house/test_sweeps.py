"""The page of sweeps: every long target has its row, and a run writes its own and no other."""

import re
import sys
from pathlib import Path

import pytest
from tools import sweeps

ROOT = Path(__file__).parents[2]
MAKEFILE = """fine:
	@true
	{python} -c "print('first'); print('all | well')"
	{python} -c "print('and again')"
bad:
	{python} -c "print('3 differ'); exit(3)"
"""


def test_every_sweep_is_a_target_and_has_its_row() -> None:
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(sweeps.SWEEPS) <= targets
    page = sweeps.PAGE.read_text(encoding="utf-8")
    assert list(sweeps.rows_of(page)) == list(sweeps.SWEEPS)
    assert sweeps.written(page, {}) == page


def test_a_run_is_told_by_the_last_lines_of_its_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "Makefile").write_text(MAKEFILE.format(python=sys.executable))
    monkeypatch.setattr(sweeps, "ROOT", tmp_path)
    fine, bad = (sweeps.run(name, (), tmp_path / "out") for name in ("fine", "bad"))
    assert (fine.status, fine.said) == (0, ("all | well", "and again"))
    assert (bad.status, bad.said) == (3, ("3 differ",))
    row = fine.row("2026-11-28", "abcdef12", "here")
    assert row == "| `make fine` | 2026-11-28 | abcdef12 | here | 0 | all \\| well; and again |"
    assert "**ended with 3**; 3 differ" in bad.row("2026-11-28", "abcdef12", "here")
    assert "first" in (tmp_path / "out/fine.log").read_text()


def test_a_new_row_takes_the_place_of_the_former_one() -> None:
    page = sweeps.PAGE.read_text(encoding="utf-8")
    row = sweeps.Ran("random", 0, 7.2, ("0 wrong",)).row("2026-11-28", "abcdef12", "here")
    after = sweeps.written(page, {"random": row})
    assert sweeps.rows_of(after)["random"] == row
    before, now = set(page.splitlines()), set(after.splitlines())
    assert now - before == {row}
    assert len(before - now) == 1
