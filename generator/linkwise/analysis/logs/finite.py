"""Check of a block of a log for values that are not finite."""

from collections.abc import Sequence

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.package.load import Array


def require_finite(block: Array, names: Sequence[str], first_row: int) -> None:
    """Raise LinkwiseError for the first value of a block (rows, names) that is not finite."""
    if np.isfinite(block).all():
        return
    at, column = np.argwhere(~np.isfinite(block))[0]
    raise LinkwiseError(
        f"row {first_row + at}, column {names[column]!r}: {block[at, column]} is not a sample; fill the gap"
    )
