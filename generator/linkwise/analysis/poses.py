"""Where a robot's links stand at each instant, for the stick figure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Body:
    """One link's frame on its parent's: `rotation` (3, 3), `translation` and `com` (3,), in m.

    With q the coordinate, the frame stands at `translation`, turned by rotation · Rz(ratio·q)
    (revolute) or shifted along rotation · z by ratio·q (prismatic).
    """

    link: str
    parent: int | None
    prismatic: bool
    coordinate: int
    ratio: float
    rotation: Array
    translation: Array
    com: Array


def read_skeleton(entries: Sequence[dict[str, Any]] | None) -> tuple[Body, ...] | None:
    """Bodies from a manifest's "skeleton"; None where the energies were written by hand."""
    if entries is None:
        return None
    return tuple(
        Body(
            str(entry["link"]),
            entry["parent"],
            entry["kind"] == "prismatic",
            int(entry["coordinate"]),
            float(entry["ratio"]),
            np.array(entry["rotation"], float).reshape(3, 3),
            np.array(entry["translation"], float).reshape(3),
            np.array(entry["com"], float).reshape(3),
        )
        for entry in entries
    )


def poses(bodies: Sequence[Body], q: Array) -> tuple[Array, Array]:
    """Origins and centres of mass in the base frame, each (S, bodies, 3), from q (S, n)."""
    turns: list[Array] = []
    origins: list[Array] = []
    centres: list[Array] = []
    for body in bodies:
        if body.parent is None:
            turn, origin = np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3))
        else:
            turn, origin = turns[body.parent], origins[body.parent]
        move = body.ratio * q[:, body.coordinate]
        shift = np.broadcast_to(body.translation, (len(q), 3))
        if body.prismatic:
            shift = shift + move[:, None] * body.rotation[:, 2]
        origin = origin + np.einsum("sab,sb->sa", turn, shift)
        turn = turn @ body.rotation
        if not body.prismatic:
            turn = turn @ _about_z(move)
        turns.append(turn)
        origins.append(origin)
        centres.append(origin + turn @ body.com)
    return np.stack(origins, axis=1), np.stack(centres, axis=1)


def _about_z(angle: Array) -> Array:
    turn = np.zeros((len(angle), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    turn[:, 2, 2] = 1.0
    return turn
