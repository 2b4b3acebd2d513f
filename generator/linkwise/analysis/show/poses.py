"""Poses of a robot's bodies at each instant, for the stick figure."""

from collections.abc import Sequence

import numpy as np

from linkwise.oracle.newton_euler import displacement
from linkwise.package.load import Array
from linkwise.package.manifest import BodyEntry


def poses(bodies: Sequence[BodyEntry], q: Array) -> tuple[Array, Array]:
    """Return origins and centres of mass in the base frame, each (S, bodies, 3) in m.

    q: coordinates (S, n) in rad or m
    """
    turns: list[Array] = []
    origins: list[Array] = []
    centres: list[Array] = []
    for body in bodies:
        if body.parent is None:
            turn, origin = np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3))
        else:
            turn, origin = turns[body.parent], origins[body.parent]
        move = displacement(body, q)[:, 0]
        shift, rotation = np.broadcast_to(body.translation, (len(q), 3)), np.array(body.rotation)
        if body.kind == "prismatic":
            shift = shift + move[:, None] * rotation[:, 2]
        origin = origin + np.einsum("sab,sb->sa", turn, shift)
        turn = turn @ rotation
        if body.kind == "revolute":
            turn = turn @ _about_z(move)
        turns.append(turn)
        origins.append(origin)
        centres.append(origin + turn @ np.array(body.com))
    return np.stack(origins, axis=1), np.stack(centres, axis=1)


def _about_z(angle: Array) -> Array:
    turn = np.zeros((len(angle), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    turn[:, 2, 2] = 1.0
    return turn
