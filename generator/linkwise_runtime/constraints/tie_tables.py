"""The constants of a robot's ties, couplings and contacts, for the functions of `tie_arrays`."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..kinematics.frame_tables import FrameTables, frame_tables
from ..rule.joint_tree import JointTree, TreeCoupling
from .held_frames import ROWS, Held


class TieTables(NamedTuple):
    """Constants of P pairs of frames, of which T are ties and the others contacts, and of their C rows.

    Frames stand in the order first ones of ties, those of contacts, second ones of ties.
    """

    frames: FrameTables | None
    """None without ties and contacts."""
    ties: int
    pairs: int
    points: Any
    """In the axes of each frame, (3, frames, 1)."""
    first: Any
    """Ones where a joint moves the first frame of a pair, (P, joints, 1)."""
    second: Any
    """The same of the second; none of a contact."""
    moved_apart: Any
    """Their difference."""
    all_axes: Any
    """Of a pair 1 where all axes are held, 0 where z alone may be, (P, 1); None where none are."""
    apart: Any
    """Of a row the length that it holds, 0 elsewhere, (C, 1)."""
    is_apart: Any
    """Of a pair 1 where a length is held, (P, 1)."""
    row_pairs: Any
    """Pair of each row."""
    fixed: Any
    """(6, C, 1): what a row has of the turn and the shift of its pair, along the world's axes."""
    turning: Any
    """(3, C, 1): the same of the turn, along the axes of the first frame; None for none."""
    along: Any
    """(C, 1): the same of the shift, along the line between the frames; None for none."""
    placed: Any
    """(C, 1): ones for rows that a position can violate; rolling has none."""
    polynomials: tuple[tuple[Any, ...], ...]
    """c_0, c_1, ... of the couplings' sums, of their derivatives and second derivatives, (K, n, 1) each."""

    @property
    def moved(self) -> int:
        """Number of pairs of a joint and a tie, by which the memory of a call grows."""
        return 1 if self.frames is None else len(self.frames.joints.parents) * (1 + self.pairs)


def tie_tables(tree: JointTree, n: int, held: Sequence[Held]) -> TieTables:
    """Tables in float64."""
    ties = sum(one.second is not None for one in held)
    seconds = [one.second for one in held[:ties] if one.second is not None]
    frames, points, first, second = None, np.zeros((3, 0, 1)), np.zeros(0), np.zeros(0)
    if held:
        frames = frame_tables(tree, n, [*(one.first for one in held), *seconds])
        axes = np.stack([*(one.axes for one in held), *[np.eye(3)] * ties], -1)[..., None]
        rotations = (frames.rotations[:, :, None] * axes[None]).sum(1)
        frames = frames._replace(rotations=rotations)
        # Points are turned as the axes are, in which they are wanted.
        own = np.array([*(one.axes.T @ one.point for one in held), *[np.zeros(3)] * ties])
        points = own.T[..., None]
        moved = frames.carried.T[..., None]
        first, second = moved[: len(held)], np.zeros_like(moved[: len(held)])
        second[:ties] = moved[len(held) :]
    every = np.array([[float(one.kind == "frame")] for one in held])
    return TieTables(
        frames,
        ties,
        len(held),
        points,
        first,
        second,
        first - second,
        every if {"frame", "hinge"} & {one.kind for one in held} else None,
        np.array([[one.length] for one in held for _ in ROWS[one.kind]]),
        np.array([[float(one.kind == "distance")] for one in held]),
        np.array([p for p, one in enumerate(held) for _ in ROWS[one.kind]], dtype=np.intp),
        *_rows(held),
        np.array([[float(one.kind != "rolling")] for one in held for _ in ROWS[one.kind]]),
        _polynomials(tree.couplings, n),
    )


def _rows(held: Sequence[Held]) -> tuple[Any, Any, Any]:
    """`fixed`, `turning` and `along`."""
    count = sum(len(ROWS[one.kind]) for one in held)
    fixed, turning, along = (np.zeros((size, count, 1)) for size in (6, 3, 1))
    along = along[0]
    at, eye = 0, np.eye(3)
    for one in held:
        size = len(ROWS[one.kind])
        if one.kind == "distance":
            along[at] = 1.0
        else:
            fixed[3:, at + size - 3 : at + size, 0] = eye
        if one.kind == "hinge":
            turning[:, at : at + 2, 0] = eye[:, :2]
        if one.kind == "frame":
            fixed[:3, at : at + 3, 0] = eye
        if one.kind == "rolling":  # v + omega x -arm is the velocity where it touches
            fixed[:3, at : at + 3, 0] = np.cross(eye, np.array(one.arm)).T
        at += size
    return fixed, turning if turning.any() else None, along if along.any() else None


def _polynomials(couplings: Sequence[TreeCoupling], n: int) -> tuple[tuple[Any, ...], ...]:
    if not couplings:
        return ()
    most = max(len(factors) for coupling in couplings for _, factors in coupling.terms)
    listed = np.zeros((max(3, most), len(couplings), n, 1))
    for c, coupling in enumerate(couplings):
        for k, factors in coupling.terms:
            listed[: len(factors), c, k, 0] += factors
    powers = np.arange(len(listed))[:, None, None, None]
    slopes = (powers * listed)[1:]
    return tuple(listed), tuple(slopes), tuple((powers[:-1] * slopes)[1:])
