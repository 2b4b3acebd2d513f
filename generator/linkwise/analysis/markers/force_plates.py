"""Wrenches of a C3D file's force plates, from their channels: in N and N·m, in axes of OpenSim's models."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.markers.c3d_parameters import C3DParameters
from linkwise.analysis.markers.plate_units import matrix_sizes, sizes
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

OF_PRESSURE, OF_MOMENTS, OF_SENSORS, OF_MATRIX = 1, 2, 3, 4
"""Types of plates: a force, its centre of pressure and a free moment; a force and a moment; eight parts of
the force; channels that CAL_MATRIX makes a force and a moment."""
CHANNELS = {OF_PRESSURE: "FFFPPM", OF_MOMENTS: "FFFMMM", OF_SENSORS: "FFFFFFFF", OF_MATRIX: "FFFMMM"}
"""Letter for what each of a plate's channels is: a force, a place or a moment."""
SQUARE = np.sin(np.radians(5.0))
"""Largest cosine between sides of a plate that is a rectangle but for errors of where its corners are."""


@dataclass(frozen=True, eq=False)
class PlateWrench:
    """Wrench at a plate as the file has it: force, and moment about `place`, (S, 3) each, that place (3,).

    NaN is where the file has no number. told: what is taken for granted
    """

    force: Array
    moment: Array
    place: Array
    told: tuple[str, ...] = ()


class ForcePlates:
    """Force plates of a file, counted from 1, each read when it is asked for.

    file: as ezc3d reads it; metres: its unit of places; turn (3, 3): from its axes to the model's. ezc3d's
    own wrenches are not taken: those of 1.7 have a wrong sign for type 1, and for type 3 with an origin
    above the surface, and none at all where one plate of the file is of another type.
    """

    def __init__(self, file: Any, metres: float, turn: Array) -> None:
        self._given = C3DParameters(file)
        self._metres, self._turn = metres, turn
        self._channels = np.asarray(file["data"]["analogs"], dtype=float)[0]
        self._units = self._given.texts("ANALOG", "UNITS")
        self._frames = file["data"]["points"].shape[2]
        used = self._given.numbers("FORCE_PLATFORM", "USED").ravel()
        self.count = int(used[0]) if used.size else 0
        self.samples = self._channels.shape[1]

    def size(self, number: int) -> Array:
        """Return the size (S,) of a plate's force, wherever the plate is; raises as `wrench` but for that."""
        found: Array = np.linalg.norm(self._own(number)[0], axis=1)
        return found

    def wrench(self, number: int) -> PlateWrench:
        """Return the wrench of a plate about its middle, which unlike a centre of pressure is always there.

        Raises LinkwiseError, with the plate's number, for a type, units or corners that are not read, and for
        numbers that the file lacks.
        """
        force, moment, told = self._own(number)
        corners = self._given.of_plate(number, "CORNERS", 3, 4) * self._metres
        turn = self._turn @ _axes(number, corners)
        lines = told + self._baseline(number, force)
        return PlateWrench(force @ turn.T, moment @ turn.T, self._turn @ corners.mean(axis=1), tuple(lines))

    def _own(self, number: int) -> tuple[Array, Array, list[str]]:
        """Return force and moment about the surface's middle, (S, 3), in the plate's axes; with lines."""
        kind = int(self._given.of_plate(number, "TYPE", 1)[0])
        if kind not in CHANNELS:
            raise LinkwiseError(
                f"plate {number} is of type {kind}; types {listed(CHANNELS)} are read; export the file"
                " with one of these"
            )
        letters = CHANNELS[kind]
        at = self._given.of_plate(number, "CHANNEL", -1)[: len(letters)].astype(int) - 1
        if len(at) < len(letters) or at.min() < 0 or at.max() >= len(self._channels):
            raise LinkwiseError(
                f"plate {number}: FORCE_PLATFORM:CHANNEL names no {len(letters)} of the file's"
                f" {len(self._channels)} channels; export the file again"
            )
        self._require_offsets(number, at)
        units = [self._units[channel] if channel < len(self._units) else "" for channel in at]
        values, sized = self._channels[at], sizes
        if kind == OF_MATRIX and (matrix := self._calibration(number)) is not None:
            values, sized = matrix @ values, matrix_sizes
        in_si, told = sized(number, letters, units, self._metres)
        values = values * np.array(in_si)[:, None]
        origin, lines = self._origin(number, kind)
        force, moment = WRENCHES[kind](values, origin)
        return force.T, moment.T, told + lines

    def _require_offsets(self, number: int, at: Array) -> None:
        """Raise LinkwiseError where ezc3d scales channels wrongly.

        It drops the sign of ANALOG:OFFSET, and reads whole numbers above 32767 as below 0.
        """
        offsets = self._given.of_channels("OFFSET")
        own = offsets[at[at < len(offsets)]]
        is_unsigned = self._given.text("ANALOG", "FORMAT").upper() == "UNSIGNED"
        if is_unsigned and self._given.numbers("POINT", "SCALE").max(initial=0.0) > 0.0:
            raise LinkwiseError(
                f"plate {number}: ANALOG:FORMAT is UNSIGNED, and ezc3d reads such numbers above 32767 as"
                " below 0; export the file with signed or with real numbers"
            )
        if ((own % 65536 if is_unsigned else own) != np.abs(own)).any():
            raise LinkwiseError(
                f"plate {number}: ANALOG:OFFSET of its channels is below 0, which ezc3d takes for above 0;"
                " export the file with an offset of 0"
            )

    def _calibration(self, number: int) -> Array | None:
        """Return the matrix (6, 6) of a plate of type 4; None where a program left it out, or all empty."""
        if not self._given.numbers("FORCE_PLATFORM", "CAL_MATRIX").any():
            return None
        matrix = self._given.of_plate(number, "CAL_MATRIX", 6, 6)
        if not matrix.any():
            raise LinkwiseError(
                f"plate {number}: FORCE_PLATFORM:CAL_MATRIX is all zeros, and that of another plate is not;"
                " export the file with the matrix of each"
            )
        return matrix

    def _origin(self, number: int, kind: int) -> tuple[Array, list[str]]:
        """Return a plate's origin in m, its z above the surface turned round, as z of plates points down.

        It is from where a plate measures moments to the middle of its surface, of type 3 in z alone: x and
        y there are the distances of the sensors. Plates of type 1 measure on their surface.
        """
        if kind == OF_PRESSURE:
            return np.zeros(3), []
        origin = self._given.of_plate(number, "ORIGIN", 3) * self._metres
        if origin[2] <= 0.0:
            return origin, []
        inverted = origin * ([1.0, 1.0, -1.0] if kind == OF_SENSORS else -1.0)
        what = "z of its ORIGIN" if kind == OF_SENSORS else "its ORIGIN"
        return inverted, [f"plate {number}: {what} is above its surface, and is taken with the other sign"]

    def _baseline(self, number: int, force: Array) -> list[str]:
        """Return a line on frames in which nothing presses, as FORCE_PLATFORM:ZERO says, and a force is."""
        zero = self._given.numbers("FORCE_PLATFORM", "ZERO").ravel()
        if zero.size < 2 or zero[1] < max(zero[0], 1):
            return []
        first, last = max(int(zero[0]), 1), int(zero[1])
        each = self.samples // self._frames
        there = force[each * (first - 1) : each * last]
        there = there[np.isfinite(there).all(axis=1)]
        off = float(np.linalg.norm(there.mean(axis=0))) if len(there) else 0.0
        if not off:
            return []
        return [
            f"plate {number}: FORCE_PLATFORM:ZERO says that nothing presses in frames {first} to {last}; its"
            f" mean force of {off:.3g} N there is not taken off"
        ]


def _of_pressure(values: Array, origin: Array) -> tuple[Array, Array]:
    """Return force and moment (3, S) of a force, a place on the surface and a free moment."""
    (x, y), free = values[3:5], values[5]
    fx, fy, fz = force = values[:3]
    return force, np.array([y * fz, -x * fz, x * fy - y * fx + free])


def _of_moments(values: Array, origin: Array) -> tuple[Array, Array]:
    """Return force and moment (3, S) of a force and a moment about what `origin` is from."""
    force = values[:3]
    return force, values[3:] + np.cross(force, origin, axisa=0).T


def _of_sensors(values: Array, origin: Array) -> tuple[Array, Array]:
    """Return force and moment (3, S) of Kistler's eight: x of two pairs, y of two pairs, z of each sensor."""
    x12, x34, y14, y23, *z = values
    (a, b, _), (z1, z2, z3, z4) = origin, z
    force = np.array([x12 + x34, y14 + y23, z1 + z2 + z3 + z4])
    about = [b * (z1 + z2 - z3 - z4), a * (z2 + z3 - z1 - z4), b * (x34 - x12) + a * (y14 - y23)]
    return _of_moments(np.concatenate([force, about]), origin * [0.0, 0.0, 1.0])


WRENCHES: dict[int, Callable[[Array, Array], tuple[Array, Array]]] = {
    OF_PRESSURE: _of_pressure,
    OF_MOMENTS: _of_moments,
    OF_SENSORS: _of_sensors,
    OF_MATRIX: _of_moments,
}


def _axes(number: int, corners: Array) -> Array:
    """Return the axes of a plate as columns: x from its second corner to the first, y from the fourth.

    Raises LinkwiseError where the corners (3, 4) are not those of a rectangle, one after the other.
    """
    sides = corners - np.roll(corners, -1, axis=1)
    lengths = np.linalg.norm(sides, axis=0)
    if not (np.isfinite(lengths).all() and lengths.all()):
        raise LinkwiseError(
            f"plate {number}: FORCE_PLATFORM:CORNERS does not say where it is: corners are at one place, or"
            " no numbers; export the file with the plate's place"
        )
    units = sides / lengths
    if np.abs((units * np.roll(units, -1, axis=1)).sum(axis=0)).max() > SQUARE:
        raise LinkwiseError(
            f"plate {number}: FORCE_PLATFORM:CORNERS does not go round a rectangle; bring its corners in the"
            " order +x +y, -x +y, -x -y, +x -y in the plate's axes"
        )
    x, y = sides[:, 0], -sides[:, 3]
    z = np.cross(x, y)
    found: Array = np.column_stack([one / np.linalg.norm(one) for one in (x, np.cross(z, x), z)])
    return found
