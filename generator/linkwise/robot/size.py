"""Limits on the number of joints and constraints of a robot, wherever it is described."""

from linkwise.errors import LinkwiseError

MOST_JOINTS = 1000
"""Most joints: an arm of N has some N³/3 coefficients of each order; 1000 are far beyond what is feasible."""
FOR_EACH = 10
"""Most constraints for each joint that moves: one that holds nothing that others leave free is redundant."""


def check_joints(count: int, remedy: str) -> None:
    """Raise LinkwiseError where more joints move than linkwise accepts; `remedy` in words."""
    if count > MOST_JOINTS:
        raise LinkwiseError(
            f"{count:,} joints move, and {MOST_JOINTS:,} are the most, as the number of coefficients grows"
            f" with N³; {remedy}"
        )


def check_constraint_count(constraints: int, joints: int) -> None:
    """Raise LinkwiseError for far more constraints than joints that they could hold.

    To find where constraints close, and which follow from others, takes time that grows at least with the
    square of their number.
    """
    most = min(FOR_EACH * joints, MOST_JOINTS)
    if constraints > most:
        raise LinkwiseError(
            f"joints that move are {joints:,}, and constraints {constraints:,}, of which {most:,} are the"
            " most, as each is to hold what others leave free; remove those that follow from others"
        )
