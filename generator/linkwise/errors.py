"""The error that a user's mistake raises, and the warning for what may affect a result."""

from collections.abc import Iterator
from contextlib import contextmanager


class LinkwiseError(ValueError):
    """A mistake in the input; the message says where it is and how to correct it."""


@contextmanager
def within(place: str) -> Iterator[None]:
    """Prefix every LinkwiseError raised inside with `place`, the file or stage at fault."""
    try:
        yield
    except LinkwiseError as error:
        raise LinkwiseError(f"{place}: {error}") from error


class LinkwiseWarning(UserWarning):
    """A warning that a user must know before trusting a result; the command line prints it in one line."""
