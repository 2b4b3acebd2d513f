"""Words of a person's joints: "right knee, flexion +", from names and from how the model moves.

A coordinate's name says which joint it is; which motion is positive is read off the model, as a knee bends
with a positive angle in one model and a negative one in another. A positive turn about the axis a takes a
point at s to s + a x s: where that brings the shank behind the thigh, it is flexion. All is seen where every
coordinate is 0. Up is against gravity, and right is where joints of the right side lie, seen from those of
the left; a model of one side has OpenSim's directions, x forward and y up.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree, TreeJoint

from linkwise.arrays import Array

ALONG = 0.7
"""Least cosine between an axis and a direction of the body for the axis to count as that one."""
LEVEL = 0.99
"""Least part of y in the direction upwards of a model with OpenSim's directions."""
STEP = 1e-6
"""Length in m below which there is no direction."""
PIECES = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+")
Way = Literal["sagittal", "frontal", "long", "forward", "up", "right"]
Ways = dict[Way, tuple[str, str]]


class MotionWords(NamedTuple):
    """Words of a coordinate: of its joint, and of what is positive and negative in it."""

    joint: str
    positive: str
    negative: str

    @property
    def signs(self) -> str:
        """Both directions with their signs: "flexion +, extension −"."""
        return f"{self.positive} +, {self.negative} −"

    def __str__(self) -> str:
        return f"{self.joint}, {self.signs}"


class PersonJoint(NamedTuple):
    """A joint of a person, and what a turn of what is behind it is called."""

    words: tuple[str, ...]
    """Words in names that say that it is this joint."""
    points: Array
    """Direction from the joint along the segment behind it: forward, up, right."""
    motions: Ways
    """Names of the turn that brings the segment forward (a foot up), or to the right, or turns it to the left
    about the line upwards, with those of the opposite ones; "in" and "out" depend on the side."""


DOWN, UP, FORWARD = np.array([0.0, -1.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
BEND = ("flexion", "extension")
LIMB: Ways = {"frontal": ("abduction", "adduction"), "long": ("internal rotation", "external rotation")}
FOOT: Ways = {"frontal": ("eversion", "inversion"), "long": LIMB["long"]}
SPINE: Ways = {
    "sagittal": BEND,
    "frontal": ("bending to the right", "bending to the left"),
    "long": ("rotation to the left", "rotation to the right"),
}
PELVIS: Ways = {
    "sagittal": ("anterior tilt", "posterior tilt"),
    "frontal": ("list to the right", "list to the left"),
    "long": SPINE["long"],
    "forward": ("forward", "backward"),
    "up": ("up", "down"),
    "right": ("to the right", "to the left"),
}
JOINTS = {
    "hip": PersonJoint(("hip",), DOWN, {"sagittal": BEND, **LIMB}),
    "knee": PersonJoint(("knee",), DOWN, {"sagittal": BEND[::-1], **LIMB}),
    "ankle": PersonJoint(("ankle",), FORWARD, {"sagittal": ("dorsiflexion", "plantarflexion"), **FOOT}),
    "subtalar joint": PersonJoint(("subtalar",), FORWARD, FOOT),
    "toes": PersonJoint(("mtp", "toe", "toes"), FORWARD, {"sagittal": BEND[::-1]}),
    "shoulder": PersonJoint(("shoulder", "arm"), DOWN, {"sagittal": BEND, **LIMB}),
    "elbow": PersonJoint(("elbow",), DOWN, {"sagittal": BEND}),
    "forearm": PersonJoint(("pro", "pronation"), DOWN, {"long": ("pronation", "supination")}),
    "lumbar spine": PersonJoint(("lumbar", "back", "waist", "torso", "trunk"), UP, SPINE),
    "neck": PersonJoint(("neck", "head"), UP, SPINE),
    "pelvis": PersonJoint(("pelvis",), UP, PELVIS),
}
"""Joints by their own word."""
SIDES = {"r": "right", "right": "right", "l": "left", "left": "left"}
MOTIONS = {
    "flex",
    "flexion",
    "extension",
    "add",
    "adduction",
    "abduction",
    "rot",
    "elev",
    "pro",
    "tilt",
    "list",
}
"""Words in names of coordinates that say that these are a person's."""


class _Moves(NamedTuple):
    """Motion of a coordinate where all are 0, in the axes of the base."""

    kind: Literal["turn", "slide"]
    axis: Array
    """Axis of a positive turn, or direction of a positive slide, (3,)."""
    place: Array
    """Place of the axis, (3,)."""


def shown_joints(names: Sequence[str], words: Mapping[str, MotionWords]) -> tuple[str, ...]:
    """Return what joints are called in figures: "right hip", or "right hip flexion" where it has other turns.

    names: names of coordinates; words: words of all coordinates that have some, by name
    """
    count = Counter(one.joint for one in words.values())
    found = []
    for name in names:
        own = words.get(name)
        is_one = own is not None and count[own.joint] > 1
        found.append(name if own is None else f"{own.joint} {own.positive}" if is_one else own.joint)
    return tuple(found)


def words_of(
    names: Sequence[str], tree: JointTree | None, up: Sequence[float]
) -> tuple[MotionWords | None, ...]:
    """Return the words of each coordinate, (n,); None where its name is no joint's, or its axis fits none.

    None too where two coordinates would have the same: hip_front and hip_back, of a leg of four bars.

    names: names of the coordinates, in order; up: direction against gravity, (3,)
    """
    pieces = [tuple(piece.lower() for piece in PIECES.findall(name)) for name in names]
    every = {piece for some in pieces for piece in some}
    if tree is None or not ({"hip", "knee"} <= every or MOTIONS & every):
        return (None,) * len(names)  # a robot's shoulder and elbow bend otherwise
    moves = [_moves(tree, i) for i in range(len(names))]
    directions = _directions(pieces, moves, np.asarray(up, float))
    if directions is None:
        return (None,) * len(names)
    words = [_words(some, moved, directions) for some, moved in zip(pieces, moves, strict=True)]
    count = Counter(map(_motion_of, filter(None, words)))
    return tuple(own if own is not None and count[_motion_of(own)] == 1 else None for own in words)


def _motion_of(words: MotionWords) -> tuple[str, frozenset[str]]:
    """Return joint and motion, whichever way is positive."""
    return words.joint, frozenset((words.positive, words.negative))


def _directions(pieces: Sequence[Sequence[str]], moves: Sequence[_Moves | None], up: Array) -> Array | None:
    """Return unit vectors forward, up and to the right, (3, 3); None where they are not to be seen."""
    upward = up / np.linalg.norm(up)
    places: dict[tuple[str, ...], dict[str, Array]] = {}
    for some, moved in zip(pieces, moves, strict=True):
        if moved is not None and (side := _side(some)):
            rest = tuple(piece for piece in some if piece not in SIDES)
            places.setdefault(rest, {})[side] = moved.place
    across = [both["right"] - both["left"] for both in places.values() if len(both) == 2]
    right = np.sum(across, axis=0) if across else np.array([0.0, 0.0, float(upward[1] > LEVEL)])
    right = right - upward * (upward @ right)
    if np.linalg.norm(right) < STEP:
        return None
    right /= np.linalg.norm(right)
    return np.stack([np.cross(upward, right), upward, right])


def _side(pieces: Sequence[str]) -> str:
    """Return the side that a name says, "right" or "left"; empty for none, and for both."""
    sides = {SIDES[piece] for piece in pieces if piece in SIDES}
    return sides.pop() if len(sides) == 1 else ""


def _moves(tree: JointTree, i: int) -> _Moves | None:
    """Return what coordinate i mostly does where all are 0: a turn, if one of its joints turns."""
    own = [at for at, joint in enumerate(tree.joints) if joint.coordinate == i]
    turning = [at for at in own if tree.joints[at].kind == "revolute"]
    if not own:
        return None
    at = (turning or own)[0]
    turned, place = np.eye(3), np.zeros(3)
    for before in tree.chain(at):
        place = place + turned @ np.array(tree.joints[before].translation)
        turned = turned @ np.array(tree.joints[before].rotation)
    return _Moves("turn" if turning else "slide", np.sign(_rate(tree.joints[at])) * turned[:, 2], place)


def _rate(joint: TreeJoint) -> float:
    """Return how fast the joint moves with its coordinate at 0."""
    if joint.curve is None:
        return joint.ratio
    at = max([0, *(number for number, start in enumerate(joint.curve.starts) if start <= 0.0)])
    polynomial = np.polynomial.Polynomial(joint.curve.pieces[at])
    return float(polynomial.deriv()(-joint.curve.starts[at])) or 1.0


def _words(pieces: Sequence[str], moves: _Moves | None, directions: Array) -> MotionWords | None:
    known = [(word, joint) for word, joint in JOINTS.items() if set(joint.words) & set(pieces)]
    if moves is None or not known:
        return None
    word, joint = known[0]
    axis = directions @ moves.axis
    found = _turn(axis, joint) if moves.kind == "turn" else _slide(axis, joint)
    if found is None:
        return None
    (way, positive), side = found, _side(pieces)
    if joint.points is not UP and way in ("frontal", "long"):  # the same turn is another's on the other side
        if not side:
            return None
        positive ^= side == "left"
    first, second = joint.motions[way]
    return MotionWords(f"{side} {word}".strip(), *((first, second) if positive else (second, first)))


def _turn(axis: Array, joint: PersonJoint) -> tuple[Way, bool] | None:
    """Return the motion of a turn about an axis, and whether a positive one is the first of its names.

    axis: in the directions of the body
    """
    ways: tuple[Way, ...] = ("frontal", "long", "sagittal")
    at = int(np.abs(axis).argmax())
    way = ways[at]
    if abs(axis[at]) < ALONG or way not in joint.motions:
        return None
    if way == "long":
        return way, bool(axis[at] > 0.0)
    if way == "frontal":  # what a foot turns to a side is its sole
        return way, bool(np.cross(axis, UP if joint.points is UP else DOWN)[2] > 0.0)
    return way, bool(np.cross(axis, joint.points)[1 if joint.points is FORWARD else 0] > 0.0)


def _slide(axis: Array, joint: PersonJoint) -> tuple[Way, bool] | None:
    ways: tuple[Way, ...] = ("forward", "up", "right")
    at = int(np.abs(axis).argmax())
    return (ways[at], bool(axis[at] > 0.0)) if ways[at] in joint.motions and abs(axis[at]) > ALONG else None
