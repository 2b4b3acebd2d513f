"""Wrenches of a C3D file's force plates: in N and N·m, in axes of OpenSim's models."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.opensim.recorded_markers import METRES
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

OF_PRESSURE, OF_MOMENTS, OF_SENSORS, OF_MATRIX = 1, 2, 3, 4
"""Types of plates: a force, its centre of pressure and a free moment; a force and a moment; eight parts of
the force; channels that CAL_MATRIX makes a force in N and a moment in N times POINT:UNITS."""
CHANNELS = {OF_PRESSURE: "FFFPPM", OF_MOMENTS: "FFFMMM", OF_SENSORS: "FFFFFFFF", OF_MATRIX: ""}
"""Letter for each of a plate's channels whose unit the file says: a force, a place or a moment."""
IN_SI = {
    "F": {"N": 1.0},
    "P": METRES,
    "M": {f"N{between}{unit}": size for unit, size in METRES.items() for between in ("", ".", "*", "·", "-")},
}
WORDS = {"F": "a force", "P": "a place", "M": "a moment"}


@dataclass(frozen=True, eq=False)
class PlateWrench:
    """Wrench at a plate as the file has it: force, and moment about `place`, (S, 3) each, that place (3,).

    NaN is where the file has no number. told: what is taken for granted
    """

    force: Array
    moment: Array
    place: Array
    told: tuple[str, ...] = ()


def plate_wrenches(file: Any, metres: float, turn: Array) -> Iterator[PlateWrench]:
    """Yield the wrench of each plate about its middle, which unlike a centre of pressure is always there.

    file: as ezc3d reads it; metres: its unit of places; turn (3, 3): from its axes to the model's

    Raises LinkwiseError for other types of plates, and for channels in other units than N, N·m and those of
    lengths, or parts of these.
    """
    group = file["parameters"].get("FORCE_PLATFORM", {})
    kinds = group.get("TYPE", {}).get("value", ())
    said = file["parameters"].get("ANALOG", {}).get("UNITS", {}).get("value", ())
    units = [str(unit).strip() for unit in said]
    for number, given in enumerate(file["data"].get("platform", ()), 1):
        if (kind := int(kinds[number - 1])) not in CHANNELS:
            raise LinkwiseError(f"plate {number} is of type {kind}; types {listed(CHANNELS)} are read")
        at = np.asarray(group["CHANNEL"]["value"])[:, number - 1].astype(int) - 1
        own = [units[channel] if channel < len(units) else "" for channel in at]
        yield _wrench(number, given, kind, own, metres, turn)


def _wrench(
    number: int, given: Any, kind: int, units: Sequence[str], metres: float, turn: Array
) -> PlateWrench:
    """Return a plate's wrench.

    ezc3d adds to a moment that of the force by the plate's ORIGIN, in N times POINT:UNITS whatever the
    moment's own unit is. Files have of type 1 the centre of pressure and the free moment; the moment that
    ezc3d 1.7 makes of these has the wrong sign.
    """
    sizes = {
        what: _size(
            number, what, [unit for unit, one in zip(units, CHANNELS[kind], strict=False) if one == what]
        )
        for what in WORDS
    }
    told = [
        f"plate {number}: the unit of {WORDS[what]} is not said; N and N times POINT:UNITS are taken"
        for what, size in sizes.items()
        if size is None and what in CHANNELS[kind]
    ][:1]
    corners = np.asarray(given["corners"], dtype=float)
    middle = corners.mean(axis=1)
    force = _turned(given["force"], turn)
    in_moment, in_place = sizes["M"] or metres, sizes["P"] or metres
    if kind == OF_PRESSURE:
        arm = np.asarray(given["center_of_pressure"], dtype=float) - middle[:, None]
        moment = np.cross(_turned(arm, turn) * in_place, force) + _turned(given["Tz"], turn) * in_moment
    else:
        moved = np.cross(force, turn @ _axes(corners) @ np.asarray(given["origin"], dtype=float))
        moment = (_turned(given["moment"], turn) - moved) * in_moment + moved * metres
    return PlateWrench(force, moment, turn @ middle * metres, tuple(told))


def _size(number: int, what: str, units: Sequence[str]) -> float | None:
    """Return the size in SI of the unit of some channels; None where the file says none."""
    said = sorted(set(units))
    if said in ([], [""]):
        return None
    known = IN_SI[what]
    if len(said) > 1 or said[0] not in known:
        raise LinkwiseError(
            f"plate {number}: ANALOG:UNITS of {WORDS[what]} is {listed(map(repr, said))};"
            f" {listed(list(known)[:3])} are read"
        )
    return known[said[0]]


def _axes(corners: Array) -> Array:
    """Return the axes of a plate as columns: x from its second corner to the first, y from the fourth."""
    x, y = corners[:, 0] - corners[:, 1], corners[:, 0] - corners[:, 3]
    z = np.cross(x, y)
    found: Array = np.column_stack([one / np.linalg.norm(one) for one in (x, np.cross(z, x), z)])
    return found


def _turned(vectors: Any, turn: Array) -> Array:
    """Return vectors (3, S) as rows in the model's axes."""
    found: Array = np.asarray(vectors, dtype=float).T @ turn.T
    return found
