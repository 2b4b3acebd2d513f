"""Warnings about three successive turns about one point that a log brings near their pole."""

from collections.abc import Iterator, Sequence

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree, TreeJoint

from linkwise.analysis.samples import Samples
from linkwise.arrays import Array

NEAR = 10.0
"""Least factor by which the outer turns magnify errors of a log's angles, near a pole, to be reported."""
AT_ONCE = 1 << 16


def pole_warnings(tree: JointTree | None, joints: Sequence[str], samples: Samples) -> Iterator[str]:
    """Yield a warning for three successive turns about one point that a log brings near their pole.

    With z1, z2, z3 their axes, |z1 . z2 x z3| is largest where the middle turn is a right angle away from
    the pole. Nearer, an error of an orientation is an error of the outer angles by the inverse of that
    number, as a fraction of its largest.
    """
    for first, middle, last in _triples(tree) if tree else ():
        angles = samples.q[:, middle.coordinate]
        places = range(0, len(angles), AT_ONCE)
        sizes = [_apart(middle, last, np.asarray(angles[at : at + AT_ONCE])) for at in places]
        least = [(float(part.min()), at + int(part.argmin())) for at, part in zip(places, sizes, strict=True)]
        size, row = min(least, default=(1.0, 0))
        if size * NEAR < 1.0:
            turns = [repr(joints[joint.coordinate]) for joint in (first, middle, last)]
            yield _near(turns, size, float(samples.time[row]))


def _near(turns: Sequence[str], size: float, time: float) -> str:
    first, middle, last = turns
    return (
        f"{middle} is {np.degrees(np.arcsin(size)):.2g} degrees from where {first} and {last} turn about one "
        f"axis, at {time:.6g} s: what is wrong with the orientation there is wrong with these two by "
        f"{1.0 / max(size, 1e-16):.3g} times as much, and with their rates and accelerations by more; do not "
        "rest on them there, or write the turns in another order"
    )


def _triples(tree: JointTree) -> Iterator[tuple[TreeJoint, TreeJoint, TreeJoint]]:
    """Yield three turns that follow each other at one point, with no mass between."""
    heavy = {link.joint for link in tree.links}
    for last in tree.joints:
        middle = None if last.parent is None else tree.joints[last.parent]
        if middle is None or middle.parent is None or heavy & {last.parent, middle.parent}:
            continue
        first = tree.joints[middle.parent]
        alike = all(joint.kind == "revolute" and joint.curve is None for joint in (first, middle, last))
        if alike and not any((*middle.translation, *last.translation)):
            yield first, middle, last


def _apart(middle: TreeJoint, last: TreeJoint, angles: Array) -> Array:
    """Return |z1 . z2 x z3| (S,) at angles (S,) of the middle turn, as a fraction of its largest value.

    Axes are those of the first turn.
    """
    z2 = np.array(middle.rotation)[:, 2]
    x, y, z = np.array(last.rotation)[:, 2]
    cosine, sine = np.cos(middle.ratio * angles), np.sin(middle.ratio * angles)
    turned = np.stack([cosine * x - sine * y, sine * x + cosine * y, np.full_like(cosine, z)])
    z3 = np.array(middle.rotation) @ turned
    largest = np.hypot(z2[0], z2[1]) * np.hypot(x, y)
    if largest == 0.0:
        return np.ones_like(angles)  # two of the axes coincide at every angle, which no angle changes
    found: Array = np.abs(z2[0] * z3[1] - z2[1] * z3[0]) / largest
    return found
