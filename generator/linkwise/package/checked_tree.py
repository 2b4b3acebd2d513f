"""Checks that joints, links and rigid bodies of a manifest agree with each other."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from linkwise_runtime.rule.joint_tree import TreeCurve

from linkwise.package.entries import PLACE, JointEntry, LinkEntry, RigidTree, Row

ROUNDING = 1e-6
"""Largest error of an entry of a rotation times its transpose."""


def check_tree(tree: RigidTree, joints: Sequence[JointEntry], links: Sequence[LinkEntry]) -> None:
    """Raise ValueError where bodies contradict each other, the joints or the paths of the links."""
    paths: list[set[int]] = []
    for index, body in enumerate(tree.bodies):
        if not body.coordinate < len(joints):
            raise ValueError(f"body {index} of the tree hangs on no joint")
        if body.parent is not None and not body.parent < index:
            raise ValueError(f"the parent of body {index} of the tree is not an earlier body")
        paths.append({body.coordinate, *(() if body.parent is None else paths[body.parent])})
        inertia = np.array(body.inertia)
        if not _is_rotation(body.rotation):
            raise ValueError(f"the rotation of body {index} of the tree is not a rotation")
        if not np.array_equal(inertia, inertia.T):
            raise ValueError(f"the inertia of body {index} of the tree is not symmetric")
    by_link = {body.link: path for body, path in zip(tree.bodies, paths, strict=True)}
    for j, link in enumerate(links):
        if link.name not in by_link:
            raise ValueError(f"links[{j}].name is {link.name!r}, which is not in the tree")
        if set(link.path) != by_link[link.name]:
            raise ValueError(f"the path of link {link.name!r} is not that of the tree")
    _check_joints(tree, joints)
    for index, body in enumerate(tree.bodies):
        if body.curve:
            check_curve(f"bodies[{index}]", body.curve)
    _check_frames(tree, links)
    _check_passive(tree)
    _check_constraints(tree, len(joints))
    for place in tree.formulas:
        found = PLACE.fullmatch(place)
        known = found and (
            int(found["frame"]) < len(tree.frames)
            if found["frame"]
            else int(found["body"] or found["whole"] or 0) < len(tree.bodies)
        )
        if not known:
            raise ValueError(f"tree.formulas has {place[:80]!a}, which is not a place of the tree")


def _is_rotation(rows: tuple[Row, Row, Row]) -> bool:
    turn = np.array(rows)
    return np.allclose(turn @ turn.T, np.eye(3), rtol=0, atol=ROUNDING) and np.linalg.det(turn) > 0


def _check_frames(tree: RigidTree, links: Sequence[LinkEntry]) -> None:
    """Raise ValueError for frames on missing bodies, there twice or no rotation, and links without one."""
    carriers: dict[str, int | None] = {}
    for index, frame in enumerate(tree.frames):
        if frame.joint is not None and not frame.joint < len(tree.bodies):
            raise ValueError(f"the joint of frame {index} of the tree is not there")
        if frame.name in carriers:
            raise ValueError(f"tree.frames has {frame.name[:80]!a} twice")
        if not _is_rotation(frame.rotation):
            raise ValueError(f"the rotation of frame {index} of the tree is not a rotation")
        carriers[frame.name] = frame.joint
    at = {body.link: b for b, body in enumerate(tree.bodies)}
    for link in links:
        if carriers.get(link.name) != at[link.name]:
            raise ValueError(f"tree.frames has no frame {link.name[:80]!a} on the body of that link")


def check_curve(place: str, curve: TreeCurve) -> None:
    """Raise ValueError for a curve without pieces, or whose pieces are not in order."""
    if not (len(curve.starts) == len(curve.pieces) > 0 and all(curve.pieces)):
        raise ValueError(f"{place}.curve needs a start for each piece, and powers in each")
    if list(curve.starts) != sorted(curve.starts):
        raise ValueError(f"{place}.curve has starts that do not ascend")


def _check_passive(tree: RigidTree) -> None:
    """Raise ValueError for a passive entry of no joint of the tree, or of one that moves otherwise."""
    moved = {body.joint: (body.coordinate, body.ratio) for body in tree.bodies}
    for index, entry in enumerate(tree.passive):
        if moved.get(entry.joint) != (entry.coordinate, entry.ratio):
            raise ValueError(f"passive entry {index} of the tree is not of a joint that moves so")


def _check_constraints(tree: RigidTree, count: int) -> None:
    """Raise ValueError for ties and couplings that join nothing, and for impossible independent joints."""
    names = Counter([tie.name for tie in tree.ties] + [coupling.name for coupling in tree.couplings])
    for name, times in names.items():
        if times > 1:
            raise ValueError(f"tree.ties and tree.couplings have {name[:80]!a} twice")
    for tie in tree.ties:
        if not max(tie.first, tie.second) < len(tree.frames) or tie.first == tie.second:
            raise ValueError(f"the tie {tie.name[:80]!a} of the tree is not between two of its frames")
        if (tie.length > 0) != (tie.kind == "distance"):
            raise ValueError(f"the tie {tie.name[:80]!a} of the tree has a length that it cannot have")
    for coupling in tree.couplings:
        found = [k for k, coefficients in coupling.terms if any(coefficients[1:])]
        if not found or len(found) < len(coupling.terms) or found != sorted(set(found)):
            raise ValueError(
                f"the coupling {coupling.name[:80]!a} of the tree does not couple joints in order"
            )
        if not found[-1] < count:
            raise ValueError(f"the coupling {coupling.name[:80]!a} of the tree has a joint that is not there")
    free = tree.independent
    if list(free) != sorted(set(free)) or not all(k < count for k in free):
        raise ValueError("tree.independent is not of joints, in ascending order")
    if bool(names) != bool(free) or (names and len(free) == count):
        raise ValueError("tree.independent is not of some joints where there are constraints, else of none")
    if len(tree.closed_position) != (count if names else 0):
        raise ValueError(
            "tree.closed_position is not of all joints where there are constraints, else of none"
        )


def _check_joints(tree: RigidTree, joints: Sequence[JointEntry]) -> None:
    units = {"revolute": "rad", "prismatic": "m"}
    for k, joint in enumerate(joints):
        own = [body for body in tree.bodies if body.coordinate == k and body.joint == joint.name]
        if not own:
            raise ValueError(f"joints[{k}].name is {joint.name!r}, on which no body of the tree hangs")
        if all(units[body.kind] != joint.unit for body in own):
            raise ValueError(f"joints[{k}].unit is {joint.unit!r}, which is not that of its kind in the tree")
