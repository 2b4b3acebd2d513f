"""Contacts where measured loads press: the ground holds the point of the body at the centre of pressure.

That point wanders over the body, and is another at each instant. With the rows of a frame that is held as a
whole at c, ω and v_c, and r = p − c from there to the centre of pressure p, the ground with normal n holds

    v_p = v_c + ω × r = 0        and, if it does not let the foot turn on the spot, n · ω = 0

as OpenSim's PointConstraint and RollingOnSurfaceConstraint do in its induced acceleration analysis.
"""

import numpy as np

from linkwise.arrays import Array

FORCES = ("force_x", "force_y", "force_z")
PRESSED = {"pressed": ("moment_up", *FORCES), "pressed-point": FORCES}
"""Names of the rows of each kind; moment_up is about the ground's normal."""


def rows_at(kind: str, held: Array, arm: Array, normal: Array) -> Array:
    """Return the rows (S, C, n) of a contact.

    held: rows (S, 6, n) of the frame that is held: turns, then shifts, along the world's axes
    arm: vector (S, 3) from the point of the frame to the centre of pressure; normal: of the ground, unit (3,)
    """
    turns, shifts = held[:, :3], held[:, 3:]
    moved = shifts + np.cross(turns, arm[..., None], axis=1)
    if len(PRESSED[kind]) == len(FORCES):
        return moved
    about = np.einsum("a,san->sn", normal, turns)
    return np.concatenate([about[:, None], moved], axis=1)


def moment(kind: str, forces: Array, arm: Array, normal: Array) -> Array:
    """Return the moment (S, 3) about the point of the frame, of the forces (S, C) in the contact's rows."""
    found: Array = np.cross(arm, forces[:, -3:])
    return found if len(PRESSED[kind]) == len(FORCES) else found + forces[:, :1] * normal
