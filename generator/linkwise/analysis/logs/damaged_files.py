"""Errors of a library that parses a damaged file, as one line that names the file."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from linkwise.errors import LinkwiseError, within
from linkwise.escape import one_line

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
