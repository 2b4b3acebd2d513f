"""Checks that formats of logs share: damaged files, promised sizes, unique names, finite numbers."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import one_line, short

LONGEST_REASON = 200
"""Most characters shown of a library's message."""


@contextmanager
def read_as(kind: str, path: Path, mend: str = "write the file again") -> Iterator[None]:
    """Raise LinkwiseError that begins with the path for every error in reading a file as `kind`."""
    with within(str(path)):
        try:
            yield
        except LinkwiseError:
            raise
        except PermissionError as error:
            raise LinkwiseError(f"cannot be read: {error.strerror}") from error
        except Exception as error:  # libraries promise nothing about damaged files
            reason = one_line(str(error), LONGEST_REASON) or type(error).__name__
            raise LinkwiseError(f"not {kind}, or damaged ({reason}); {mend}") from error


def require_finite(block: Array, names: Sequence[str], first_row: int) -> None:
    """Raise LinkwiseError for the first value of a block (rows, names) that is not finite."""
    if np.isfinite(block).all():
        return
    at, column = np.argwhere(~np.isfinite(block))[0]
    raise LinkwiseError(
        f"row {first_row + at}, column {names[column]!r}: {block[at, column]} is not a sample; fill the gap"
    )


SHOWN = 60
"""Most characters of a name that a message shows."""


def named_once(names: Sequence[str], what: str = "columns") -> tuple[str, ...]:
    """Return the names; raise LinkwiseError that says where two are the same, counted from 1."""
    seen: dict[str, int] = {}
    for at, name in enumerate(names, 1):
        if (first := seen.setdefault(name, at)) != at:
            raise LinkwiseError(f"{what} {first} and {at} are both named {short(name, SHOWN)!r}; rename one")
    return tuple(names)


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
