"""Markers and wrenches of plates in a C3D file, by ezc3d: in m, N and N·m, in axes of OpenSim's models."""

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.markers.force_plates import PlateWrench, plate_wrenches
from linkwise.analysis.opensim.recorded_markers import METRES, RecordedMarkers, recorded_markers
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.input_file import require_file

AXES = {"X": 0, "Y": 1, "Z": 2}
HEAD, COUNTS, BLOCK = 10, "HH", 512
"""Bytes of the header up to its numbers of the first and the last frame, these two, and bytes of a block."""
BIG_ENDIAN = b"\x56"
"""Byte in the parameters of a file whose numbers begin with the large end; MIPS processors wrote it so."""
MOST = 65535
"""Number of the last frame in a file of more frames than the header can count."""


@dataclass(frozen=True, eq=False)
class RecordedC3D:
    """Markers, and plates at instants of their own, in s."""

    markers: RecordedMarkers
    plate_time: Array
    plates: tuple[PlateWrench, ...]
    axes: str
    """Axes of the laboratory that are x of the model, and up."""


def read_c3d(path: Path, axes: str) -> RecordedC3D:
    """Return what a file has, turned so that y is up.

    axes: the axes of the laboratory that are the model's x, and up, such as +X,+Z; empty for those that the
    file says

    Raises LinkwiseError for a file that is no C3D, has no markers, or does not say which axis is up.
    """
    require_file(path)
    library = extra("ezc3d")
    with within(str(path)):
        try:
            file = library.c3d(str(path), extract_forceplat_data=True)
        except (OSError, ValueError, RuntimeError, IndexError) as error:
            raise LinkwiseError(f"ezc3d does not read it: {' '.join(str(error).split())}") from None
        _require_whole(path, int(file["data"]["points"].shape[2]))
        return _recorded(file, axes)


def _require_whole(path: Path, frames: int) -> None:
    """Raise LinkwiseError where fewer frames are there than the header says: ezc3d reads what is left."""
    with path.open("rb") as file:
        head = file.read(HEAD)
        file.seek((head[0] - 1) * BLOCK + 3)
        order = ">" if file.read(1) == BIG_ENDIAN else "<"
    first, last = struct.unpack(order + COUNTS, head[-4:])
    if last < MOST and frames < last - first + 1:
        raise LinkwiseError(
            f"its head says {last - first + 1} frames, and {frames} are there: it was cut short; export or"
            " copy it again"
        )


def _recorded(file: Any, axes: str) -> RecordedC3D:
    point = file["parameters"]["POINT"]
    places = np.asarray(file["data"]["points"], dtype=float)[:3].transpose(2, 1, 0)
    labels = [str(name).strip() for name in point["LABELS"]["value"]][: places.shape[1]]
    kept = [at for at, name in enumerate(labels) if name and not name.startswith("*")]
    if not kept or len(places) < 2:
        raise LinkwiseError(
            f"{len(kept)} markers with a name in {len(places)} frames; there is no motion in it"
        )
    names = [labels[at].rpartition(":")[2].strip() for at in kept]
    twice = [labels[at] for at, name in zip(kept, names, strict=True) if names.count(name) > 1]
    if twice:
        raise LinkwiseError(
            f"several markers have one name, {listed(map(repr, twice[:4]))}, where what stands before the"
            " colon is left out; keep those of one subject, or rename them"
        )
    told = axes or ",".join(_text(point, name) for name in ("X_SCREEN", "Y_SCREEN"))
    turn = _turn(told, "--c3d-axes" if axes else "POINT:X_SCREEN and Y_SCREEN")
    rate = float(file["parameters"]["POINT"]["RATE"]["value"][0])
    begin = float(file["header"]["points"]["first_frame"]) / rate
    unit = _text(point, "UNITS")
    if unit not in METRES:
        raise LinkwiseError(f"POINT:UNITS is {unit!r}; lengths are read in {listed(METRES)}")
    markers = recorded_markers(
        begin + np.arange(len(places)) / rate, names, places[:, kept] * METRES[unit] @ turn.T
    )
    plates = tuple(plate_wrenches(file, METRES[unit], turn))
    every = float(file["header"]["analogs"]["frame_rate"] or rate)
    count = len(plates[0].force) if plates else 0
    return RecordedC3D(markers, begin + np.arange(count) / every, plates, told)


def _text(group: Any, name: str) -> str:
    values = group[name]["value"] if name in group else []
    return str(values[0]).strip() if len(values) else ""


def _turn(text: str, source: str) -> Array:
    """Return the matrix (3, 3) from the laboratory's axes to x, y and z of the model, y up."""
    rows = []
    for word in text.upper().split(","):
        sign, name = (-1.0 if word.strip().startswith("-") else 1.0), word.strip().lstrip("+-")
        if name not in AXES:
            break
        rows.append(sign * np.eye(3)[AXES[name]])
    if len(rows) != 2 or rows[0] @ rows[1]:
        raise LinkwiseError(
            f"{source} is {text!r}, which does not say which axis of the laboratory is x of the model, and"
            " which is up; give --c3d-axes +X,+Z, say"
        )
    return np.array([*rows, np.cross(*rows)])
