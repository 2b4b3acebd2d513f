"""Recorded markers, as files of several formats hold them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed, short

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Units of length of such files, in m."""
FARTHEST = 1e4
"""Largest coordinate of a marker, in m."""


@dataclass(frozen=True, eq=False)
class RecordedMarkers:
    """Places (S, M, 3) in m at `time` (S,) in s; NaN is not seen, in all three or in none."""

    time: Array
    names: tuple[str, ...]
    places: Array
    told: tuple[str, ...] = ()
    """Lines on what is odd in the file."""

    @property
    def seen(self) -> list[str]:
        """Names of the markers that are seen at some time."""
        return [
            name
            for name, path in zip(self.names, self.places.swapaxes(0, 1), strict=True)
            if np.isfinite(path).any()
        ]

    def of(self, names: Sequence[str]) -> Array:
        """Return the places of some markers."""
        found: Array = self.places[:, [self.names.index(name) for name in names]]
        return found


def recorded_markers(
    time: Array,
    names: Sequence[str],
    places: Array,
    where: Callable[[int], str],
    told: Sequence[str] = (),
) -> RecordedMarkers:
    """Return markers, where one that lacks a coordinate is not seen, and none is at 0 0 0.

    Programs write zeros for what is not seen, and no marker is at the origin to the last digit. where: words
    for a sample's place in the file

    Raises LinkwiseError for a marker that is farther than FARTHEST, as at infinity.
    """
    far = (np.abs(places) > FARTHEST).any(axis=2)
    if far.any():
        sample, marker = np.argwhere(far)[0]
        raise LinkwiseError(
            f"{where(int(sample))}: a marker is farther than {FARTHEST:g} m away, {short(names[marker])};"
            " empty it there, or look at the unit"
        )
    nowhere = (places == 0.0).all(axis=2)
    seen = np.where((nowhere | np.isnan(places).any(axis=2))[..., None], np.nan, places)
    lines = list(told)
    if nowhere.any():
        some = [name for name, one in zip(names, nowhere.T, strict=True) if one.any()]
        lines.append(f"markers at 0 0 0, which count as not seen there: {listed(some)}")
    return RecordedMarkers(time, tuple(names), seen, tuple(lines))
