"""Whether the last row of a text log looks cut off."""

from pathlib import Path

TAIL = 1 << 16
"""Bytes looked at."""


def doubts_of_the_end(path: Path, delimiter: str | None) -> tuple[str, ...]:
    """A warning if the last row has no line end, and its last number fewer digits than all before it."""
    with path.open("rb") as handle:
        handle.seek(max(0, path.stat().st_size - TAIL))
        *rows, last = handle.read().decode("utf-8", "replace").split("\n")
    ends = [len((row.split(delimiter) or [""])[-1].strip()) for row in [*rows[-20:], last]]
    if not last.strip() or len(ends) < 3 or ends[-1] >= min(ends[1:-1]):
        return ()
    number = (last.split(delimiter) or [""])[-1].strip()
    return (
        f"the last row has no line end, and its last number {number!r} is shorter than those before:"
        " the file may be cut off there",
    )
