"""Gravity in `inspect`, and whether any joint bears it: none does of a file drawn in another plane."""

from typing import Any

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array

LEVEL = 1e-9
"""Sine of an angle that is rounding."""


def is_loaded(tree: JointTree) -> bool:
    """Return whether gravity may load a joint: none does that turns about its direction or slides across it.

    Joints that do so at q = 0 do so everywhere where all of them do.
    """
    turned: list[Array] = []
    for joint in tree.joints:
        before = np.eye(3) if joint.parent is None else turned[joint.parent]
        turned.append(before @ np.array(joint.rotation))
    axes = np.array([turn[:, 2] for turn in turned]).reshape(-1, 3)
    down = np.array(tree.gravity)
    turns = np.array([joint.kind == "revolute" for joint in tree.joints], bool)
    free = np.where(turns, np.linalg.norm(np.cross(axes, down), axis=1), np.abs(axes @ down))
    return bool((free > LEVEL * np.linalg.norm(down)).any())


def gravity_line(data: dict[str, Any]) -> str:
    """Return a line on gravity, and whether any joint may bear it."""
    if not any(data["gravity"]):
        return "gravity: none"
    vector = ", ".join(f"{one:g}" for one in data["gravity"])
    return f"gravity: ({vector}) m/s²" + ("" if data["gravity_loads"] else ", which loads no joint")
