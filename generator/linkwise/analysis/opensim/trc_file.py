"""Markers in OpenSim's text format, `.trc`.

Read strictly, as OpenSim takes the beginning of a cell for a number, and an empty line for the end.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from linkwise.analysis.opensim.recorded_markers import METRES, RecordedMarkers, recorded_markers
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed, short

HEAD = (
    *("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units"),
    *("OrigDataRate", "OrigDataStartFrame", "OrigNumFrames"),
)
"""Names of the numbers in the third line."""
FIRST = 6
"""Line of the first row, where none is empty above it."""
OFF = 0.01
"""Part by which the rate of the times may be off what the head says."""


def read_trc(path: Path) -> RecordedMarkers:
    """Read a recording: cells apart by tabs, empty or NaN where a marker is not seen.

    Raises LinkwiseError, with the line, for what is not of the format, cells that are no numbers, times that
    do not increase, another unit, and two markers of one name.
    """
    with within(path.name):
        lines = path.read_text(encoding="utf-8-sig", errors="replace").split("\n")
        if len(lines) < FIRST or not lines[0].startswith("PathFileType"):
            raise LinkwiseError("its first line is not that of a .trc file, PathFileType, or no row follows")
        head = dict(zip(_words(lines[1]), _words(lines[2]), strict=False))
        names = _names(lines, head)
        unit = head.get("Units", "")
        if unit not in METRES:
            raise LinkwiseError(f"its unit is {short(unit)!r}; lengths are read in {listed(METRES)}")
        rows = [
            (number, _row(line, number, 2 + 3 * len(names)))
            for number, line in enumerate(lines[FIRST - 1 :], FIRST)
            if line.strip()
        ]
        if len(rows) < 2:
            raise LinkwiseError(f"it has {len(rows)} rows; there is no motion in it")
        table = np.array([row for _, row in rows]).reshape(len(rows), -1)
        time, places = table[:, 0], METRES[unit] * table[:, 1:].reshape(len(rows), len(names), 3)
        for bad, why in (
            (~np.isfinite(time), "it has no time"),
            (np.diff(time, prepend=-np.inf) <= 0.0, "its time is not after that of the row before it"),
        ):
            if bad.any():
                raise LinkwiseError(f"line {rows[int(bad.argmax())][0]}: {why}")
        return recorded_markers(
            time, names, places, lambda row: f"line {rows[row][0]}", list(_odd(head, time))
        )


def _words(line: str) -> list[str]:
    return [word.strip() for word in line.split("\t") if word.strip()]


def _names(lines: Sequence[str], head: Mapping[str, str]) -> list[str]:
    """Return the names of the markers, which three columns each belong to."""
    frame, *names = _words(lines[3]) or [""]
    if frame != "Frame#" or names[:1] != ["Time"]:
        raise LinkwiseError("line 4 does not begin with Frame# and Time")
    names = names[1:]
    count = head.get("NumMarkers", "")
    if count != str(len(names)) or [word[:1] for word in _words(lines[4])] != list("XYZ") * len(names):
        raise LinkwiseError(
            f"its head says {short(count)!r} markers, line 4 has {len(names)} names, and line 5"
            f" {len(_words(lines[4]))} of X, Y and Z; write three columns for each"
        )
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise LinkwiseError(f"several markers are named {listed(twice)}; rename them")
    return names


def _row(line: str, number: int, width: int) -> list[float]:
    """Return the numbers of a row but that of its frame; NaN where a cell is empty."""
    cells = line.split("\t")
    while len(cells) > width and not cells[-1].strip():
        cells.pop()
    if len(cells) != width:
        raise LinkwiseError(f"line {number} has {len(cells)} cells, and {width} are those of its markers")
    return [_cell(cell.strip(), number) for cell in cells[1:]]


def _cell(text: str, number: int) -> float:
    if text in ("", "NaN", "nan"):
        return np.nan
    try:
        value = float(text) if "_" not in text else np.inf
    except ValueError:
        value = np.inf
    if not np.isfinite(value):
        comma = "; write a point in its place" if "," in text else ""
        raise LinkwiseError(f"line {number}: {short(text)!r} is no number{comma}")
    return value


def _odd(head: Mapping[str, str], time: Array) -> Iterator[str]:
    """Yield lines on numbers of the head that are not those of the rows, whose count and times are taken."""
    said = {key: head.get(key, "") for key in ("NumFrames", "DataRate")}
    frames, rate = map(_number, said.values())
    for key, text in said.items():
        if text and np.isnan(_number(text)):
            yield f"its head says {short(text)!r} as {key}, which is no number, and is not heeded"
    if np.isfinite(frames) and frames != len(time):
        yield f"its head says {frames:.0f} frames, and {len(time)} are there"
    own = 1.0 / float(np.diff(time).mean()) if len(time) > 1 else rate
    if abs(own - rate) > OFF * rate:
        yield f"its head says {rate:g} Hz, and its times {own:.6g} Hz, which are taken"


def _number(text: str) -> float:
    """Return a number of the head, where programs of some countries write a comma for the point."""
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return float("nan")


def write_trc(path: Path, recorded: RecordedMarkers) -> None:
    """Write markers with all their digits."""
    time, count = recorded.time, len(recorded.time)
    rate = 1.0 / float(np.diff(time).mean())
    labels = [name.replace("\t", " ") for name in recorded.names]

    def lines() -> Iterator[str]:
        yield f"PathFileType\t4\t(X/Y/Z)\t{path.name}"
        yield "\t".join(HEAD)
        yield f"{rate:.10g}\t{rate:.10g}\t{count}\t{len(labels)}\tm\t{rate:.10g}\t1\t{count}"
        yield "Frame#\tTime\t" + "\t\t\t".join(labels) + "\t\t"
        yield "\t\t" + "\t".join(f"{axis}{at}" for at in range(1, 1 + len(labels)) for axis in "XYZ")
        yield ""
        for number, (instant, row) in enumerate(zip(time, recorded.places, strict=True), 1):
            yield "\t".join([str(number), f"{instant:.17g}", *(f"{x:.17g}" for x in row.ravel())])

    path.write_text("\n".join(lines()) + "\n", encoding="utf-8")
