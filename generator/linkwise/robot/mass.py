"""Mass properties: merging of rigidly connected bodies, and the test whether a body can exist."""

from collections.abc import Iterable

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.description import ZERO3, ZERO33, Body
from linkwise.robot.notes import IMPOSSIBLE, Note
from linkwise.robot.robot import Mat3, Rotation, Scalar, Vec3, unusable
from linkwise.robot.transforms import add, rotate, rotate_inertia, total

TRIANGLE = 1e-6
"""Relative slack of the triangle inequality: files round flat bodies' moments to about six digits."""

BREAKS_TRIANGLE = "an inertia that breaks the triangle inequality"

MOST_NAMED = 20
"""Most bodies that cannot exist, in one message."""

SPECK = 1e-14
"""Area in m²: moments below mass · (100 nm)² count as zero. The moments of a point mass are zeros that
turning and rounding leave at 1e-18 or 1e-35, where no relative slack helps; a solid body so small weighs
1e-15 kg."""

Placed = tuple[Body, Rotation, Vec3]


def merge(bodies: list[Placed]) -> tuple[Scalar, Vec3, Mat3]:
    """Return the mass, centre of mass and inertia about it of rigidly connected bodies, in one frame."""
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


def check_bodies(bodies: Iterable[Body], allow: bool, allow_triangle: bool = False) -> list[Note]:
    """Return a note for each body that cannot exist; the bodies have numbers for values.

    Raises LinkwiseError that names all of them unless `allow` or the file itself allows it, and always for
    numbers that are not usable. With `allow_triangle`, moments may break the triangle inequality.
    """
    faults = [(body, fault) for body in bodies if (fault := _fault(body))]
    refused = []
    for body, fault in faults:
        if not (allow or body.unphysical or (allow_triangle and fault.startswith(BREAKS_TRIANGLE))):
            refused.append((body.name, fault))
    if len(refused) == 1:
        name, fault = refused[0]
        raise LinkwiseError(f"link {name!r} has {fault}; correct it, or pass --allow-unphysical")
    if refused:
        told = listed((f"{name!r} has {fault}" for name, fault in refused), MOST_NAMED, 150)
        raise LinkwiseError(
            f"{len(refused)} links cannot exist; correct them, or pass --allow-unphysical: {told}"
        )
    return [Note("unphysical", body.name, body.unphysical or fault, IMPOSSIBLE) for body, fault in faults]


def principal(mass: float, inertia: Array) -> tuple[Array, Array]:
    """Return the principal moments (3,), ascending, and their axes (3, 3), in columns.

    Moments that are only rounding are set to zero.
    """
    moments, axes = np.linalg.eigh(inertia)
    noise = max(SPECK * mass, np.finfo(float).eps * float(np.abs(moments).max()))
    return np.where(np.abs(moments) <= noise, 0.0, moments), axes


def _fault(body: Body) -> str:
    """Return the unphysical property of a body in words, or an empty string.

    Raises LinkwiseError for numbers that are not usable.
    """
    values = (body.mass, *body.com, *(entry for row in body.inertia for entry in row))
    if fault := unusable(*values):
        raise LinkwiseError(f"link {body.name!r} has {fault} in its mass, com or inertia; give numbers")
    if float(body.mass) < 0:
        return f"negative mass {float(body.mass):g} kg"
    low, middle, high = map(float, principal(float(body.mass), np.array(body.inertia, dtype=float))[0])
    if low < -TRIANGLE * high or high < 0:
        return f"an inertia that is not positive (principal moment {low:.3g} kg·m²)"
    if high > low + middle + TRIANGLE * high:
        numbers = f"{high:.4g} > {low:.4g} + {middle:.4g} kg·m²"
        excess = f" by {100 * (high / (low + middle) - 1):.2g} %" if low + middle else ""
        single = "" if low + middle else ", as it has one moment alone: a thin rod along x has yy = zz"
        return f"{BREAKS_TRIANGLE} ({numbers}){excess}{single}"
    return ""
