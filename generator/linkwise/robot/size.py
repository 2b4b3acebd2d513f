"""How many joints a robot may have, wherever it is described."""

from linkwise.errors import LinkwiseError

MOST_JOINTS = 1000
"""An arm of N joints has some N³/3 coefficients of each order: 1000 are far beyond what can be generated."""


def check_joints(count: int, mend: str) -> None:
    """Raise LinkwiseError where more joints move than linkwise takes, with what to do about it."""
    if count > MOST_JOINTS:
        raise LinkwiseError(
            f"{count:,} joints move, and {MOST_JOINTS:,} are the most, as the number of coefficients grows"
            f" with N³; {mend}"
        )
