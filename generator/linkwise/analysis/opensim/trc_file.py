"""Markers in OpenSim's text format, `.trc`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

HEAD = (
    *("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units"),
    *("OrigDataRate", "OrigDataStartFrame", "OrigNumFrames"),
)
"""Names of the numbers in the third line."""
IN_METRES = {"m": 1.0, "mm": 0.001, "cm": 0.01}
OFF = 0.01
"""Part by which the rate of the times may be off what the head says."""


@dataclass(frozen=True, eq=False)
class RecordedMarkers:
    """A recording as OpenSim reads it."""

    file: Path
    """The file to follow: the recording, or a copy without places that are none."""
    time: Array
    names: tuple[str, ...]
    places: Array
    """Places (S, M, 3) in m; NaN is not seen."""
    told: tuple[str, ...]

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


def read_trc(osim: Any, path: Path, folder: Path) -> RecordedMarkers:
    """Read a recording with OpenSim; folder: where a copy may be written.

    A marker at 0 0 0 is not seen, as programs write that, and no marker is at the origin to the last digit.

    Raises LinkwiseError for another unit, and for two markers of one name.
    """
    table = osim.TimeSeriesTableVec3(str(path))
    head = {key: table.getTableMetaDataString(key) for key in table.getTableMetaDataKeys()}
    names = list(table.getColumnLabels())
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise LinkwiseError(f"{path.name}: several markers are named {listed(twice)}; rename them")
    unit = head.get("Units", "m")
    if unit not in IN_METRES:
        raise LinkwiseError(f"{path.name}: its unit is {unit!r}; lengths are read in {listed(IN_METRES)}")
    flat = table.flatten()  # which its matrix does not keep
    rows = flat.getMatrix().to_numpy().copy()
    time = np.asarray(table.getIndependentColumn(), dtype=float)
    places = IN_METRES[unit] * rows.reshape(len(time), len(names), 3)
    nowhere = (places == 0.0).all(axis=2)
    told = list(_odd(head, time))
    if nowhere.any():
        places[nowhere] = np.nan
        some = [name for name, one in zip(names, nowhere.T, strict=True) if one.any()]
        told.append(f"markers at 0 0 0, which count as not seen there: {listed(some)}")
        path = folder / f"seen_{path.name}"
        write_trc(path, time, names, places)
    return RecordedMarkers(path, time, tuple(names), places, tuple(told))


def _odd(head: Mapping[str, str], time: Array) -> Iterator[str]:
    """Yield lines on numbers of the head that are not those of the rows, whose count and times are taken."""
    frames, rate = (_number(head.get(key, "")) for key in ("NumFrames", "DataRate"))
    if np.isfinite(frames) and frames != len(time):
        yield f"its head says {frames:.0f} frames, and {len(time)} are there"
    own = 1.0 / float(np.diff(time).mean()) if len(time) > 1 else rate
    if abs(own - rate) > OFF * rate:
        yield f"its head says {rate:g} Hz, and its times {own:.6g} Hz, which are taken"


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def write_trc(path: Path, time: Array, names: Sequence[str], places: Array) -> None:
    """Write places (S, M, 3) in m at times (S,) in s; NaN is not seen."""
    count, rate = len(time), 1.0 / float(np.diff(time).mean())
    labels = [name.replace("\t", " ") for name in names]

    def lines() -> Iterator[str]:
        yield f"PathFileType\t4\t(X/Y/Z)\t{path.name}"
        yield "\t".join(HEAD)
        yield f"{rate:.10g}\t{rate:.10g}\t{count}\t{len(labels)}\tm\t{rate:.10g}\t1\t{count}"
        yield "Frame#\tTime\t" + "\t\t\t".join(labels) + "\t\t"
        yield "\t\t" + "\t".join(f"{axis}{at}" for at in range(1, 1 + len(labels)) for axis in "XYZ")
        yield ""
        for number, (instant, row) in enumerate(zip(time, places, strict=True), 1):
            yield "\t".join([str(number), f"{instant:.9g}", *(f"{x:.9g}" for x in row.ravel())])

    path.write_text("\n".join(lines()) + "\n", encoding="utf-8")
