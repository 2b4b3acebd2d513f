"""Columns that hold standard deviations of others: `sd/X` of X, and its part by noise of motion.

They are no quantities of their own: each is told and drawn beside its column, and neither tested, integrated
nor averaged as a curve.
"""

from collections.abc import Iterable, Sequence

from linkwise.analysis.column_patterns import LONGEST, fitting
from linkwise.errors import LinkwiseError
from linkwise.escape import short

WHOLE, RANDOM = "sd/", "sd-motion/"
"""Beginnings of the names of a deviation, and of its part that is new in each cycle."""


def is_deviation(name: str) -> bool:
    """Return whether a column holds standard deviations, or a part of them, as `sd-motion/tau/knee` does."""
    first = name.partition("/")[0]
    return first == "sd" or first.startswith("sd-")


def fitting_values(place: str, names: Iterable[str], patterns: Sequence[str]) -> list[str]:
    """Return the names that any pattern fits, in their order, without those of deviations.

    Raises LinkwiseError, with the place in the study's file, for a pattern that fits none, or these alone.
    """
    names = list(names)
    for pattern in patterns:
        if all(map(is_deviation, fitting(place, names, [pattern]))):
            raise LinkwiseError(
                f"{place} has {short(pattern, LONGEST)!r}, which fits standard deviations alone; they stand"
                " beside what they are of, so name that"
            )
    return [name for name in fitting(place, names, patterns) if not is_deviation(name)]
