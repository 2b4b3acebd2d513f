"""Coordinates that a reflection about a robot's middle plane turns round, from where its joints are.

At zero, the plane's normal n is along what lies between joints of the right and of the left. A reflection
M = 1 - 2 n nᵀ makes of an axis z M z where a joint slides, and -M z where it turns, as turning has a hand. A
coordinate keeps its sign where that is the axis of its partner, itself in the middle, and changes it where
the partner's axis points the other way.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree, TreeJoint

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

APART = 1e-3
"""Distance in m from which two joints are told apart."""
ALONG = 0.9
"""Least cosine between an axis and the mirrored one of its partner."""
MEND = "; name the coordinates that change sign on the left in 'turned' of [cycles]"


class ZeroJoint(NamedTuple):
    """Joint of a tree at zero, in the world: its axis, of the sense in which it follows its coordinate."""

    axis: Array
    place: Array
    is_turning: bool
    coordinate: int


def turned_joints(tree: JointTree, joints: Sequence[str], pairs: Mapping[str, str]) -> tuple[str, ...]:
    """Return the names of coordinates whose sign changes; raise LinkwiseError where that is not clear.

    pairs: name of each coordinate's partner on the other side, its own in the middle
    """
    movers: dict[str, ZeroJoint] = {}
    for joint in at_zero(tree):
        movers.setdefault(joints[joint.coordinate], joint)
    if still := [name for name in joints if name not in movers]:
        raise LinkwiseError(
            f"[cycles] has sides, and {listed(map(repr, still))} do not move anything at zero{MEND}"
        )
    normal = _normal(
        [(movers[one].place, movers[other].place) for one, other in pairs.items() if one < other]
    )
    found, odd = [], []
    for one, other in pairs.items():
        mirrored = movers[one].axis - 2 * normal * (normal @ movers[one].axis)
        along = float((-mirrored if movers[one].is_turning else mirrored) @ movers[other].axis)
        if abs(along) < ALONG or movers[one].is_turning != movers[other].is_turning:
            odd.append(one)
        elif along < 0:
            found.append(one)
    if odd:
        raise LinkwiseError(f"[cycles] has sides, and {listed(map(repr, odd))} have no mirror at zero{MEND}")
    return tuple(found)


def _normal(places: Sequence[tuple[Array, Array]]) -> Array:
    """Return the unit normal of the middle plane; raise LinkwiseError where nothing stands aside."""
    between = [other - one for one, other in places]
    apart = [step / np.linalg.norm(step) for step in between if np.linalg.norm(step) > APART]
    if not apart:
        raise LinkwiseError(f"[cycles] has sides, and joints of both are in one place{MEND}")
    alike = [step if step @ apart[0] > 0 else -step for step in apart]
    if min(step @ apart[0] for step in alike) < ALONG:
        raise LinkwiseError(f"[cycles] has sides, and at zero they are no mirror images{MEND}")
    whole: Array = np.sum(alike, axis=0)
    return whole / np.linalg.norm(whole)


def at_zero(tree: JointTree) -> list[ZeroJoint]:
    """Return the joints of a tree at zero that follow their coordinate there, parents first."""
    turns, places, found = list[Array](), list[Array](), list[ZeroJoint]()
    for joint in tree.joints:
        turn = np.eye(3) if joint.parent is None else turns[joint.parent]
        place = np.zeros(3) if joint.parent is None else places[joint.parent]
        place = place + turn @ np.array(joint.translation)
        turn = turn @ np.array(joint.rotation)
        axis = turn[:, 2]
        value, slope = _displacement(joint)
        if joint.kind == "revolute":
            cos, sin = np.cos(value), np.sin(value)
            turn = turn @ np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        else:
            place = place + axis * value
        if slope:
            found.append(ZeroJoint(axis * np.sign(slope), place, joint.kind == "revolute", joint.coordinate))
        turns.append(turn)
        places.append(place)
    return found


def _displacement(joint: TreeJoint) -> tuple[float, float]:
    """Return how far a joint is moved at zero, in rad or m, and how fast with its coordinate."""
    if joint.curve is None:
        return 0.0, joint.ratio
    started = [at for at, start in enumerate(joint.curve.starts) if start <= 0.0]
    piece = max(started, default=0)
    powers = np.polynomial.Polynomial(joint.curve.pieces[piece])
    at = -joint.curve.starts[piece]
    return joint.ratio * float(powers(at)), joint.ratio * float(powers.deriv()(at))
