"""How many joints and constraints a robot may have, wherever it is described."""

from linkwise.errors import LinkwiseError

MOST_JOINTS = 1000
"""An arm of N joints has some N³/3 coefficients of each order: 1000 are far beyond what can be generated."""
FOR_EACH = 10
"""Constraints for each joint that moves: one that holds nothing that others leave free is redundant."""


def check_joints(count: int, mend: str) -> None:
    """Raise LinkwiseError where more joints move than linkwise takes, with what to do about it."""
    if count > MOST_JOINTS:
        raise LinkwiseError(
            f"{count:,} joints move, and {MOST_JOINTS:,} are the most, as the number of coefficients grows"
            f" with N³; {mend}"
        )


def check_constraint_count(constraints: int, joints: int) -> None:
    """Raise LinkwiseError for far more constraints than joints that they could hold.

    Where constraints close, and which follow from others, takes time that grows with their square at least.
    """
    most = min(FOR_EACH * joints, MOST_JOINTS)
    if constraints > most:
        raise LinkwiseError(
            f"joints that move are {joints:,}, and constraints {constraints:,}, of which {most:,} are the"
            " most, as each is to hold what others leave free; remove those that follow from others"
        )
