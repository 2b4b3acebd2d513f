"""Degrees or radians: what the file says, what the user says, and whether the magnitudes agree."""

import math
from collections.abc import Sequence
from pathlib import Path

from linkwise.analysis.log import Log
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError

MANY_TURNS = 4 * math.pi
"""An angle past two turns in radians is more likely one in degrees."""


def scale(log: Log, reading: Reading) -> float:
    """Factor that brings the log's angles to radians."""
    told = None if reading.units is None else reading.units == "deg"
    if told is not None and log.degrees is not None and told != log.degrees:
        raise LinkwiseError(
            f"--units {reading.units} contradicts the file's"
            f" inDegrees={'yes' if log.degrees else 'no'}; leave --units away"
        )
    return math.pi / 180 if (log.degrees if told is None else told) else 1.0


def unsaid(log: Log, path: Path, reading: Reading) -> tuple[str, ...]:
    """A warning for a file that ought to say its unit, and does not."""
    if path.suffix.lower() not in {".mot", ".sto"} or log.degrees is not None or reading.units is not None:
        return ()
    return ("the header has no inDegrees: angles are taken for radians; say so with --units rad or deg",)


def doubts(peaks: Sequence[tuple[str, float]], factor: float) -> tuple[str, ...]:
    """Warnings for angles (column, largest magnitude as written) that look like the other unit."""
    if not peaks:
        return ()
    column, peak = max(peaks, key=lambda item: item[1])
    if factor == 1.0 and peak > MANY_TURNS:
        return (
            f"column {column!r} reaches {peak:.4g} rad, {peak / math.tau:.1f} turns: if that is"
            " degrees, pass --units deg",
        )
    if factor != 1.0 and 0 < peak <= math.pi:
        return (f"no angle exceeds {peak:.4g} degrees ({column!r}): if that is radians, pass --units rad",)
    return ()
