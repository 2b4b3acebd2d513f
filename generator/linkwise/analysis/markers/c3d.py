"""Markers and wrenches of plates in a C3D file, by ezc3d: in m, N and N·m, in axes of OpenSim's models."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.markers.c3d_head import read_head
from linkwise.analysis.markers.c3d_parameters import C3DParameters
from linkwise.analysis.markers.force_plates import ForcePlates
from linkwise.analysis.opensim.recorded_markers import METRES, RecordedMarkers, recorded_markers
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.input_file import require_file

AXES = {"X": 0, "Y": 1, "Z": 2}


@dataclass(frozen=True, eq=False)
class RecordedC3D:
    """Markers, and plates at instants of their own, in s."""

    markers: RecordedMarkers
    plate_time: Array
    plates: ForcePlates
    axes: str
    """Axes of the laboratory that are x of the model, and up."""


def read_c3d(path: Path, axes: str) -> RecordedC3D:
    """Return what a file has, turned so that y is up.

    axes: the axes of the laboratory that are the model's x, and up, such as +X,+Z; empty for those that the
    file says

    Raises LinkwiseError for a file that is no C3D, was cut short, has no markers, has one farther than
    FARTHEST, has no rate, or does not say which axis is up.
    """
    require_file(path)
    library = extra("ezc3d")
    with within(str(path)):
        if head := read_head(path):
            head.require_rate()
        try:
            file = library.c3d(str(path))
        except (OSError, ValueError, RuntimeError, IndexError) as error:
            raise LinkwiseError(f"ezc3d does not read it: {' '.join(str(error).split())}") from None
        if head is None:
            raise LinkwiseError("it is no C3D file; export it again")
        given, frames = C3DParameters(file), int(file["data"]["points"].shape[2])
        actual = [given.numbers("TRIAL", f"ACTUAL_{end}_FIELD").ravel() for end in ("START", "END")]
        head.require_whole(frames, actual)
        return _recorded(file, given, head.rate, axes)


def _recorded(file: Any, given: C3DParameters, rate: float, axes: str) -> RecordedC3D:
    places = np.asarray(file["data"]["points"], dtype=float)[:3].transpose(2, 1, 0)
    labels = given.texts("POINT", "LABELS")[: places.shape[1]]
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
    told = axes or ",".join(given.text("POINT", name) for name in ("X_SCREEN", "Y_SCREEN"))
    turn = _turn(told, "--c3d-axes" if axes else "POINT:X_SCREEN and Y_SCREEN")
    begin = float(file["header"]["points"]["first_frame"]) / rate
    unit = given.text("POINT", "UNITS")
    if unit not in METRES:
        raise LinkwiseError(f"POINT:UNITS is {unit!r}; lengths are read in {listed(METRES)}")
    markers = recorded_markers(
        begin + np.arange(len(places)) / rate,
        names,
        METRES[unit] * _turned(places[:, kept], turn),
        lambda frame: f"frame {frame + 1}",
    )
    plates = ForcePlates(file, METRES[unit], turn)
    every = rate * max(plates.samples // len(places), 1)
    return RecordedC3D(markers, begin + np.arange(plates.samples) / every, plates, told)


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


def _turned(places: Array, turn: Array) -> Array:
    """Return places (..., 3) in the model's axes; a product would make a number of infinity none."""
    found: Array = places[..., np.abs(turn).argmax(axis=1)] * turn.sum(axis=1)
    return found
