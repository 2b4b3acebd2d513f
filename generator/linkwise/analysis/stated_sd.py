"""Standard deviations as a file states them: a number and its unit, of what has a name."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([%a-zA-Z*·]+)\s*")
EXAMPLES = {"mm": '"10 mm"', "%": '"10 %"', "deg": '"0.3 deg"', "N": '"5 N"', "N*m": '"1 N*m"'}


def stated(place: str, key: str, given: Any, units: Mapping[str, float]) -> tuple[float, str]:
    """Return a deviation in SI units, parts for %, and the unit as it is written.

    units: what brings each unit there; raises LinkwiseError, which names place and key, for anything else
    """
    known = tuple(units)
    found = QUANTITY.fullmatch(given) if isinstance(given, str) else None
    if found is None or found[2] not in known:
        raise LinkwiseError(
            f"{place}: {key} is {given!r}; write a number and its unit, {' or '.join(known)}, as in "
            f"{EXAMPLES[known[0]]}"
        )
    value = float(found[1])
    if value < 0 or not math.isfinite(value):
        raise LinkwiseError(f"{place}: {key} is {given}; a standard deviation is 0 or more, and finite")
    return value * units[found[2]], found[2]


def place_of(place: str, what: str, name: str, names: Sequence[str], robot: OpenedRobot) -> int:
    """Return the number of a link or a joint; raise LinkwiseError for one that is not there."""
    if name not in names:
        near = listed(nearest_first(name, names))
        payloads = [one.title for one in robot.payloads]
        if name in payloads:
            raise LinkwiseError(f"{place}: payloads count as certain; leave the table out")
        fixed = ", and bodies fixed to one are part of it" if what == "link" else ""
        raise LinkwiseError(f"{place}: {robot.name} has no {what} {name!r}; its {what}s are {near}{fixed}")
    return names.index(name)
