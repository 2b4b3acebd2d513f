"""Check of the size that a file promises against its own: a kilobyte may promise more than any disk holds."""

from pathlib import Path

from linkwise.errors import LinkwiseError

LITTLE = 1 << 24
"""Bytes of numbers that every file may promise."""
DENSEST = 200
"""Bytes of numbers that a byte of a file may stand for; logs are compressed about ten times."""


def require_held(path: Path, promised: int) -> None:
    """Raise LinkwiseError, without the path, where a file is far too small for the bytes that it promises."""
    size = path.stat().st_size
    if promised > max(LITTLE, DENSEST * size):
        raise LinkwiseError(
            f"the file has {size:,} bytes and promises {promised:,} bytes of numbers; no log is packed so"
            " well: write it again, without compression, with the samples that there are"
        )
