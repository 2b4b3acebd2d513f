"""Mass properties: merging rigidly connected bodies, and whether a body can exist."""

from collections.abc import Iterable

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.robot.description import ZERO3, ZERO33, Body
from linkwise.robot.notes import IMPOSSIBLE, Note
from linkwise.robot.robot import Mat3, Rotation, Scalar, Vec3, is_finite
from linkwise.robot.transforms import add, rotate, rotate_inertia, total

TRIANGLE = 1e-6
"""Relative slack of the triangle inequality: files round flat bodies' moments to about six digits."""

SPECK = 1e-14
"""m²: moments below mass · (100 nm)² count as zero. The moments of a point mass are zeros that turning
and rounding leave at 1e-18 or 1e-35, where no relative slack helps; a solid body so small weighs 1e-15 kg."""

Placed = tuple[Body, Rotation, Vec3]


def merge(bodies: list[Placed]) -> tuple[Scalar, Vec3, Mat3]:
    """Mass, centre of mass and inertia about it of rigidly connected bodies, in one frame."""
    placed = [
        (
            body.mass,
            add(position, rotate(rotation, body.com)),
            rotate_inertia(rotation, body.inertia),
        )
        for body, rotation, position in bodies
        if not _empty(body)
    ]
    if not placed:
        return 0.0, ZERO3, ZERO33
    if len(placed) == 1:
        return placed[0]
    mass = total(m for m, _, _ in placed)
    if mass == 0.0:
        com = placed[0][1]
    else:
        x, y, z = (total(m * c[i] for m, c, _ in placed) / mass for i in range(3))
        com = (x, y, z)
    inertia = np.zeros((3, 3), dtype=object)
    for m, c, i in placed:
        d = np.array([a - b for a, b in zip(c, com, strict=True)], dtype=object)
        inertia = inertia + np.array(i, dtype=object) + m * ((d @ d) * np.eye(3, dtype=int) - np.outer(d, d))
    a, b, c = (tuple(inertia[min(i, k)][max(i, k)] for k in range(3)) for i in range(3))
    return mass, com, (a, b, c)


def _empty(body: Body) -> bool:
    return body.mass == 0 and all(entry == 0 for row in body.inertia for entry in row)


def check_bodies(bodies: Iterable[Body], allow: bool) -> list[Note]:
    """Return a note for each body that cannot exist, of bodies with numbers for values.

    Raises LinkwiseError for one unless `allow` or the file itself allows it, and for NaN or infinity always.
    """
    notes = []
    for body in bodies:
        fault = _fault(body)
        if fault and not (allow or body.unphysical):
            raise LinkwiseError(f"{fault}; correct it, or pass --allow-unphysical")
        if fault:
            notes.append(Note("unphysical", body.name, body.unphysical or fault, IMPOSSIBLE))
    return notes


def _fault(body: Body) -> str:
    """Return what is unphysical about a body, or an empty string."""
    values = (body.mass, *body.com, *(entry for row in body.inertia for entry in row))
    if not all(is_finite(value) for value in values):
        raise LinkwiseError(
            f"link {body.name!r} has NaN or infinity in its mass, com or inertia; give numbers"
        )
    if float(body.mass) < 0:
        return f"link {body.name!r} has negative mass {float(body.mass):g} kg"
    moments = np.linalg.eigvalsh(np.array(body.inertia, dtype=float))
    noise = max(SPECK * float(body.mass), np.finfo(float).eps * float(np.abs(moments).max()))
    low, middle, high = (0.0 if abs(moment) <= noise else float(moment) for moment in moments)
    if low < -TRIANGLE * high or high < 0:
        return f"link {body.name!r} has an inertia that is not positive (principal moment {low:.3g} kg·m²)"
    if high > low + middle + TRIANGLE * high:
        return (
            f"link {body.name!r} has an inertia that breaks the triangle inequality "
            f"({high:.4g} > {low:.4g} + {middle:.4g} kg·m²)"
        )
    return ""
