"""Output is a function of the input alone; `make same` changes one thing at a time, also the Python."""

from pathlib import Path

from same_bytes import ALL_AT_ONCE, PLAIN, differing, files, make_locales


def test_the_surroundings_leave_no_trace_in_any_file(tmp_path: Path) -> None:
    locales = make_locales(tmp_path / "locales")
    plain = files(PLAIN, tmp_path / "plain", locales)
    other = files(ALL_AT_ONCE, tmp_path / "other", locales)
    assert len(plain) > 150
    assert plain.keys() == other.keys()
    assert not differing(plain, other)
