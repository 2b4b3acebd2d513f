"""Checks that the tree or the energies of a manifest agree with themselves and with what stands beside."""

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree, TreeCurve, Triple
from linkwise_runtime.structure import PassiveJoint

from linkwise.package.entries import PLACE, EnergiesEntry, JointEntry, LinkEntry

ROUNDING = 1e-6
"""Largest error of an entry of a rotation times its transpose."""


def check_tree(tree: JointTree, joints: Sequence[JointEntry], links: Sequence[LinkEntry]) -> None:
    """Raise ValueError where joints of the tree contradict each other, the coordinates or the links."""
    paths: list[set[int]] = []
    for f, joint in enumerate(tree.joints):
        if not joint.coordinate < len(joints):
            raise ValueError(f"tree.joints[{f}].coordinate is not there")
        if joint.parent is not None and not joint.parent < f:
            raise ValueError(f"tree.joints[{f}].parent is not an earlier joint")
        if not _is_rotation(joint.rotation):
            raise ValueError(f"tree.joints[{f}].rotation is not a rotation")
        if joint.curve:
            check_curve(f"tree.joints[{f}]", joint.curve)
        paths.append({joint.coordinate, *(() if joint.parent is None else paths[joint.parent])})
    if len(tree.links) != len(links):
        raise ValueError(f"tree.links has {len(tree.links)} links, links {len(links)}")
    for j, (body, link) in enumerate(zip(tree.links, links, strict=True)):
        if not body.joint < len(tree.joints):
            raise ValueError(f"tree.links[{j}].joint is not there")
        if (moved := tree.link_name(j)) != link.name:
            raise ValueError(f"links[{j}].name is {link.name!r}, and its joint in the tree moves {moved!r}")
        if set(link.path) != paths[body.joint]:
            raise ValueError(f"the path of link {link.name!r} is not that of the tree")
        if not np.array_equal(body.inertia, np.transpose(body.inertia)):
            raise ValueError(f"tree.links[{j}].inertia is not symmetric")
    _check_coordinates(tree, joints)
    _check_frames(tree)
    _check_constraints(tree, len(joints))


def check_energies(energies: EnergiesEntry, links: Sequence[str], joints: int) -> None:
    """Raise ValueError for energies of other links, and for impossible constraints or independent joints."""
    if [entry.link for entry in energies.links] != [*links]:
        raise ValueError("energies is not of the links, one for each, in their order")
    names = [entry.name for entry in energies.constraints]
    if len(set(names)) < len(names):
        raise ValueError("energies.constraints has a name twice")
    _check_independent("energies", energies.independent, energies.closed_position, joints, bool(names))


def check_places(tree: JointTree, formulas: Iterable[str]) -> None:
    """Raise ValueError for a formula of what is no number of the tree."""
    lists = {"joints": tree.joints, "frames": tree.frames, "links": tree.links}
    for place in formulas:
        found = PLACE.fullmatch(place)
        name = found and (found["list"] or (found["link"] and "links"))
        if not found or (name and not int(found["at"] or found["link"]) < len(lists[name])):
            raise ValueError(f"formulas has {place[:80]!a}, which is not a place of the tree")


def _is_rotation(rows: tuple[Triple, Triple, Triple]) -> bool:
    turn = np.array(rows)
    return np.allclose(turn @ turn.T, np.eye(3), rtol=0, atol=ROUNDING) and np.linalg.det(turn) > 0


def _check_frames(tree: JointTree) -> None:
    """Raise ValueError for frames on missing joints, there twice or no rotation, and links without one."""
    carriers: dict[str, int | None] = {}
    for index, frame in enumerate(tree.frames):
        if frame.joint is not None and not frame.joint < len(tree.joints):
            raise ValueError(f"tree.frames[{index}].joint is not there")
        if frame.name in carriers:
            raise ValueError(f"tree.frames has {frame.name[:80]!a} twice")
        if not _is_rotation(frame.rotation):
            raise ValueError(f"tree.frames[{index}].rotation is not a rotation")
        carriers[frame.name] = frame.joint
    for j, link in enumerate(tree.links):
        if carriers.get(name := tree.link_name(j)) != link.joint:
            raise ValueError(f"tree.frames has no frame {name[:80]!a} on the joint of that link")


def check_curve(place: str, curve: TreeCurve) -> None:
    """Raise ValueError for a curve without pieces, or whose pieces are not in order."""
    if not (len(curve.starts) == len(curve.pieces) > 0 and all(curve.pieces)):
        raise ValueError(f"{place}.curve needs a start for each piece, and powers in each")
    if list(curve.starts) != sorted(curve.starts):
        raise ValueError(f"{place}.curve has starts that do not ascend")


def check_passive(tree: JointTree, passive: Iterable[PassiveJoint]) -> None:
    """Raise ValueError for a passive entry of no joint of the tree, or of one that moves otherwise."""
    moved = {joint.name: (joint.coordinate, joint.ratio) for joint in tree.joints}
    for index, entry in enumerate(passive):
        if moved.get(entry.joint) != (entry.coordinate, entry.ratio):
            raise ValueError(f"passive[{index}] is not of a joint that moves so in the tree")


def _check_constraints(tree: JointTree, count: int) -> None:
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
    _check_independent("tree", tree.independent, tree.closed_position, count, bool(names))


def _check_independent(
    place: str, independent: Sequence[int], closed: Sequence[float], count: int, constrained: bool
) -> None:
    """Raise ValueError for independent joints or a closed position that do not suit the constraints."""
    if list(independent) != sorted(set(independent)) or not all(k < count for k in independent):
        raise ValueError(f"{place}.independent is not of joints, in ascending order")
    if constrained != bool(independent) or (constrained and len(independent) == count):
        raise ValueError(
            f"{place}.independent is not of some joints where there are constraints, else of none"
        )
    if len(closed) != (count if constrained else 0):
        raise ValueError(
            f"{place}.closed_position is not of all joints where there are constraints, else of none"
        )


def _check_coordinates(tree: JointTree, joints: Sequence[JointEntry]) -> None:
    units = {"revolute": "rad", "prismatic": "m"}
    for k, entry in enumerate(joints):
        own = [joint for joint in tree.joints if joint.coordinate == k and joint.name == entry.name]
        if not own:
            raise ValueError(f"joints[{k}].name is {entry.name!r}, which no joint of the tree with it has")
        if all(units[joint.kind] != entry.unit for joint in own):
            raise ValueError(f"joints[{k}].unit is {entry.unit!r}, which is not that of its kind in the tree")
