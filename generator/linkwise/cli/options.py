"""The command line's reading options, for every command that reads a robot."""

import math
from collections.abc import Iterable

from linkwise.errors import LinkwiseError
from linkwise.robot import Options


def reading_options(
    lock: Iterable[str] | None, parameters: str = "numeric", base: str = "fixed", **others: object
) -> Options:
    """Options of the flags' values; `others` are fields of Options. Raises LinkwiseError naming the flag."""
    if parameters not in ("numeric", "symbolic"):
        raise LinkwiseError(f"--parameters is {parameters!r}; choose numeric or symbolic")
    if base not in ("fixed", "floating"):
        raise LinkwiseError(f"--base is {base!r}; choose fixed or floating")
    return Options(parameters, _locks(lock or ()), base, **others)  # type: ignore[arg-type]


def _locks(items: Iterable[str]) -> dict[str, float]:
    """Values of the held joints, from JOINT=VALUE."""
    locked: dict[str, float] = {}
    for item in items:
        joint, _, text = item.rpartition("=")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not joint or not math.isfinite(value):
            raise LinkwiseError(f"--lock {item!r} is not of the form JOINT=VALUE, such as --lock elbow=0.5")
        if joint in locked:
            raise LinkwiseError(f"--lock holds {joint!r} twice; give it one value")
        locked[joint] = value
    return locked
