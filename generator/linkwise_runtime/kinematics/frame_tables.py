"""What moves some frames of a tree, or what moves its links: those joints alone, as constants."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..rule.joint_tree import JointTree
from ..rule.kinematics import KinematicTables, kinematic_tables


class FrameTables(NamedTuple):
    """Constants of some frames and of the joints before them; behind all joints stands the ground."""

    joints: KinematicTables
    from_world: KinematicTables
    """The same, with places counted from the world's origin instead of the first hinge of a path."""
    chosen: Any
    """Which of the tree's joints these are, and its ground."""
    carriers: Any
    """Of each frame, which of these joints moves it."""
    frames: Any
    """Which of the tree's frames these are."""
    rotations: Any
    """From the axes of each frame to those of its carrier, (3, 3, frames, 1)."""
    columns: tuple[Any, ...]
    """Joints of each coordinate, the first of each, then the second of each, ...; the ground for none."""
    carried: Any
    """(joints, frames): ones where a joint moves a frame."""

    @property
    def moved(self) -> int:
        """Number of joints and frames, by which the memory of a call grows."""
        return len(self.joints.parents) + len(self.carriers)


def frame_tables(tree: JointTree, n: int, frames: Sequence[int]) -> FrameTables:
    """Tables of some of a tree's frames, in float64."""
    some = [tree.frames[f] for f in frames]
    rotations = np.array([frame.rotation for frame in some])
    return _tables(tree, n, [frame.joint for frame in some], frames, rotations)


def link_tables(tree: JointTree, n: int) -> FrameTables:
    """Tables of all links, whose frames are those of their joints."""
    links = tree.links
    rotations = np.array([np.eye(3)] * len(links))
    return _tables(tree, n, [link.joint for link in links], range(len(links)), rotations)


def _tables(
    tree: JointTree, n: int, carriers: Sequence[int | None], frames: Sequence[int], rotations: Any
) -> FrameTables:
    chains = [tree.chain(carrier) for carrier in carriers]
    chosen = sorted({joint for chain in chains for joint in chain})
    at = {joint: position for position, joint in enumerate(chosen)}
    joints = tuple(
        joint._replace(parent=None if joint.parent is None else at[joint.parent])
        for joint in (tree.joints[f] for f in chosen)
    )
    part, ground = kinematic_tables(replace(tree, joints=joints)), len(chosen)
    carried = np.zeros((ground + 1, len(carriers)))
    for frame, chain in enumerate(chains):
        carried[[at[joint] for joint in chain], frame] = 1.0
    return FrameTables(
        part,
        part._replace(behind=np.ones_like(part.behind)),
        np.array([*chosen, len(tree.joints)]),
        np.array([ground if carrier is None else at[carrier] for carrier in carriers]),
        np.array(frames),
        rotations.transpose(1, 2, 0)[..., None],
        tuple(_columns([joint.coordinate for joint in joints], n)),
        carried,
    )


def _columns(coordinates: Sequence[int], n: int) -> Sequence[Any]:
    own = [[f for f, k in enumerate(coordinates) if k == wanted] for wanted in range(n)]
    most, ground = max(map(len, own)), len(coordinates)
    return [
        np.array([joints[r] if r < len(joints) else ground for joints in own]) for r in range(max(1, most))
    ]
