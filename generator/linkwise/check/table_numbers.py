"""Numbers of the robot in a package's C, beside those of the manifest's tree.

Some of them no result tells: the moment of inertia of a planar arm about an axis in its plane, and values of
run-time parameters that each call replaces.
"""

import re
from collections.abc import Iterable

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array
from linkwise.check.parametric_tree import MOMENTS

NUMBER = re.compile(r"\bR\((-?[\d.e+-]+)\)")
ROUNDING = 1e-12
"""Largest relative difference: of a parameter's own value a formula may be rounded otherwise."""


def wrong_numbers(tree: JointTree, text: str) -> str:
    """Return which numbers of NAME_tree.h are unlike the tree's; empty if none."""
    joints = [
        number
        for joint in tree.joints
        for number in (*_flat(joint.rotation), *joint.translation, joint.ratio)
    ]
    bodies = [
        number
        for link in tree.links
        for number in (link.mass, *link.com, *(link.inertia[i][k] for i, k in MOMENTS))
    ]
    expected = {
        "numbers": [*joints, *bodies, *tree.gravity],
        "offsets": _flat(frame.translation for frame in tree.frames),
    }
    for kind, numbers in expected.items():
        found = _written(text, kind)
        if found.shape != (len(numbers),) or not np.allclose(found, numbers, ROUNDING, 0.0):
            return f"the {kind} of the robot's tables are wrong"
    return ""


def _written(text: str, kind: str) -> Array:
    """Return the numbers of one table, in order; none where anything but numbers stands there."""
    code = re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)
    body = re.search(rf"\bown_{kind} = \{{(.*?)\n\}};", code, re.DOTALL)
    if not body or NUMBER.sub("", body[1]).strip("{}, \n"):
        return np.array([])
    return np.array([float(number) for number in NUMBER.findall(body[1])])


def _flat(rows: Iterable[Iterable[float]]) -> list[float]:
    return [number for row in rows for number in row]
