"""Markers and wrenches of plates in a C3D file, by ezc3d: in m, N and N·m, in axes of OpenSim's models."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.input_file import require_file

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
AXES = {"X": 0, "Y": 1, "Z": 2}
OF_PRESSURE = 1
"""Type of plates whose channels are a force, its centre of pressure, and a free moment."""


@dataclass(frozen=True, eq=False)
class PlateWrench:
    """Wrench of a plate on a body: force, and moment about `place`, (S, 3) each, and that place (3,).

    NaN is where the file has no number.
    """

    force: Array
    moment: Array
    place: Array
    is_turned: bool
    """True if the file has what the body gives to the plate."""


@dataclass(frozen=True, eq=False)
class RecordedC3D:
    """Markers (S, M, 3) with NaN where one is not seen, at `time` (S,) in s, and plates at theirs."""

    time: Array
    names: tuple[str, ...]
    markers: Array
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
        return _recorded(file, axes)


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
    scale = _metres(_text(point, "UNITS"), "POINT:UNITS")
    found = places[:, kept] * scale
    found[(found == 0.0).all(axis=2)] = np.nan  # as some programs write what is not seen
    kinds = file["parameters"].get("FORCE_PLATFORM", {}).get("TYPE", {}).get("value", ())
    given = file["data"].get("platform", ())
    plates = tuple(_plate(one, int(kind), turn) for one, kind in zip(given, kinds, strict=False))
    every = float(file["header"]["analogs"]["frame_rate"] or rate)
    count = len(plates[0].force) if plates else 0
    return RecordedC3D(
        begin + np.arange(len(places)) / rate,
        tuple(names),
        found @ turn.T,
        begin + np.arange(count) / every,
        plates,
        told,
    )


def _plate(given: Any, kind: int, turn: Array) -> PlateWrench:
    """Return the wrench about the middle of a plate, which unlike a centre of pressure is always there.

    kind: the plate's type. Files have of type 1 the centre of pressure and the free moment; the moment that
    ezc3d 1.7 makes of these has the wrong sign.
    """
    scale = _metres(str(given["unit_position"]), "a plate's corners")
    moments = {"Nm": 1.0, "N.m": 1.0, "Nmm": 1e-3, "N.mm": 1e-3}.get(str(given["unit_moment"]))
    if moments is None or str(given["unit_force"]) != "N":
        raise LinkwiseError(
            f"plates are in {given['unit_force']} and {given['unit_moment']}; N and Nmm are read"
        )
    force, place = _turned(given["force"], turn), turn @ np.mean(given["corners"], axis=1) * scale
    if kind == OF_PRESSURE:
        centre, free = (_turned(given[name], turn) for name in ("center_of_pressure", "Tz"))
        moment = np.cross(centre * scale - place, force) + free * moments
    else:
        moment = _turned(given["moment"], turn) * moments
    # The ground presses and does not pull: a force that points down is that on the plate.
    is_turned = float(np.nansum(force[:, 1])) < 0.0
    sign = -1.0 if is_turned else 1.0
    return PlateWrench(sign * force, sign * moment, place, is_turned)


def _turned(vectors: Any, turn: Array) -> Array:
    """Return vectors (3, S) as rows in the model's axes."""
    found: Array = np.asarray(vectors, dtype=float).T @ turn.T
    return found


def _text(group: Any, name: str) -> str:
    values = group[name]["value"] if name in group else []
    return str(values[0]).strip() if len(values) else ""


def _metres(unit: str, what: str) -> float:
    if unit not in METRES:
        raise LinkwiseError(f"{what} is {unit!r}; lengths are read in {listed(METRES)}")
    return METRES[unit]


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
