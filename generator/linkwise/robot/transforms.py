"""Rotations and rigid transforms over numbers and symbols."""

import math
from collections.abc import Iterable, Sequence
from operator import mul

from linkwise.robot.robot import Mat3, Rotation, Scalar, Vec3

SNAP, ROUNDING = 1e-12, 1e-15
"""Tolerances for the rounding of numbers in files, and for that of arithmetic."""


def times(number: float, value: Scalar) -> Scalar:
    """Return number · value, without factors 0.0 and ±1.0 left in an expression."""
    if number == 0.0:
        return 0.0
    return value if number == 1.0 else -value if number == -1.0 else number * value


def rotate(rotation: Rotation, a: Sequence[Scalar]) -> Vec3:
    """Return rotation · a."""
    x, y, z = (total(times(r, v) for r, v in zip(row, a, strict=True)) for row in rotation)
    return x, y, z


def transpose(rotation: Rotation) -> Rotation:
    """Return the transpose."""
    a, b, c = zip(*rotation, strict=True)
    return a, b, c


def compose(a: Rotation, b: Rotation) -> Rotation:
    """Return a · b, snapped."""
    return snap([[float(total(map(mul, row, column))) for column in zip(*b, strict=True)] for row in a])


def add(a: Vec3, b: Vec3) -> Vec3:
    """Return a + b."""
    x, y, z = (total((p, q)) for p, q in zip(a, b, strict=True))
    return x, y, z


def minus(a: Vec3) -> Vec3:
    """Return −a."""
    x, y, z = (times(-1.0, e) for e in a)
    return x, y, z


def rotate_inertia(rotation: Rotation, inertia: Mat3) -> Mat3:
    """Return rotation · inertia · rotationᵀ, exactly symmetric."""
    half = [rotate(rotation, row) for row in inertia]  # rows of (R I)ᵀ, as I is symmetric
    columns = tuple(zip(*half, strict=True))
    full = [rotate(rotation, row) for row in columns]
    a, b, c = (tuple(full[min(i, k)][max(i, k)] for k in range(3)) for i in range(3))
    return a, b, c  # type: ignore[return-value]


def from_rpy(roll: float, pitch: float, yaw: float) -> list[list[float]]:
    """Return Rz(yaw) Ry(pitch) Rx(roll), as URDF defines rpy; not snapped. All NaN for an infinite angle."""
    if not all(map(math.isfinite, (roll, pitch, yaw))):
        return [[math.nan] * 3] * 3
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]


def from_quaternion(w: float, x: float, y: float, z: float) -> list[list[float]]:
    """Return the rotation of a unit quaternion; not snapped."""
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def about_z(angle: float) -> Rotation:
    """Return Rz(angle), snapped."""
    c, s = math.cos(angle), math.sin(angle)
    return snap([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def unit(axis: Sequence[float]) -> tuple[float, float, float] | None:
    """Return the direction with length 1; None for a length below 1e-9."""
    length = math.hypot(*axis)
    if length < 1e-9:
        return None
    x, y, z = (e / length for e in axis)
    return x, y, z


def align_z(axis: Sequence[float]) -> Rotation:
    """Return a rotation whose third column is the unit vector `axis`; a permutation for ±x, ±y, ±z."""
    x, y, z = snap([list(axis)])[0]
    # An entry 1e-12 off 1 snaps to it with the axis 1e-6 off: the other two have to be 0.
    if y == z == 0.0:
        return snap([[0, 0, x], [x, 0, 0], [0, 1, 0]])
    if x == z == 0.0:
        return snap([[0, 1, 0], [0, 0, y], [y, 0, 0]])
    if x == y == 0.0:
        return snap([[1, 0, 0], [0, z, 0], [0, 0, z]])
    # The shortest turn from z to the axis (Rodrigues); 1 / (1 + z) in the form that keeps its digits.
    f = 1.0 / (1.0 + z) if z > 0.0 else (1.0 - z) / (x * x + y * y)
    return snap([[1 - f * x * x, -f * x * y, x], [-f * x * y, 1 - f * y * y, y], [-x, -y, z]])


def snap(rows: Sequence[Sequence[float]]) -> Rotation:
    """Return the rows with entries within 1e-12 of −1, 0 or 1 rounded, as far as rows stay orthonormal.

    ±90° turns then leave no 6e-17 behind; what a rounded angle, 1.570796 for example, leaves is a turn of its
    own.
    """
    near = _rounded(rows, SNAP)
    return near if _is_orthonormal(near) else _rounded(rows, ROUNDING)


def snapped(rows: Sequence[Sequence[float]]) -> tuple[Rotation, bool]:
    """Return the rotation, snapped, and whether that changed it."""
    rotation = snap(rows)
    return rotation, rotation != tuple(map(tuple, rows))


def _rounded(rows: Sequence[Sequence[float]], reach: float) -> Rotation:
    def near(e: float) -> float:
        whole = float(round(e)) + 0.0 if math.isfinite(e) else e
        return whole if abs(e - whole) < reach else float(e)

    return tuple((near(x), near(y), near(z)) for x, y, z in rows)


def _is_orthonormal(rows: Rotation) -> bool:
    products = ((i == k, sum(map(mul, rows[i], rows[k]))) for i in range(len(rows)) for k in range(i + 1))
    return all(abs(product - own) < ROUNDING for own, product in products)


def total(terms: Iterable[Scalar]) -> Scalar:
    """Return the sum in the order of the terms; Python's `sum` rounds in another way from version 3.12 on."""
    result: Scalar = 0.0
    for term in terms:
        if isinstance(term, float) and term == 0.0:
            continue
        result = term if isinstance(result, float) and result == 0.0 else result + term
    return result
