"""How far joints have moved where they follow curves of their coordinates, and how that changes.

With d(q) the curve of a joint whose screw is sigma at a ratio of 1, all formulas of the rule stay as they are
for its screw S = d' sigma, of which the rates have more terms:

    Sd  = V x S  + d'' qd sigma
    Sdd = A x S + V x Sd + d'' qd V x sigma + (d''' qd^2 + d'' qdd) sigma

and the position gradient c0_ik one for a joint's screw itself, d'' sigma . W with the wrench W of tau.
"""

from typing import Any, NamedTuple

import numpy as np

from .joint_tree import JointTree, TreeCurve

LINE = TreeCurve((0.0,), ((0.0, 1.0),))
"""The curve of a joint that has none: what it moves by is its ratio's matter."""


class CurveTables(NamedTuple):
    """Curves of all frames; each has as many pieces, and each piece as many powers, as the longest."""

    ends: Any
    """Where each piece ends, (pieces - 1, frames, 1); infinite where there is none."""
    first: Any
    """Index of each frame's first piece among all, (frames, 1)."""
    starts: Any
    """Of all pieces, (frames * pieces)."""
    powers: Any
    """Coefficients of the powers of the curve and its three derivatives, (4, powers, frames * pieces)."""


class Displacement(NamedTuple):
    """Of all frames, (frames, samples): d, which the joint's ratio multiplies, and its derivatives by q."""

    value: Any
    slope: Any = None
    """The first derivative; this and the next are None where no joint follows a curve, and all slopes 1."""
    bend: Any = None
    jerk: Any = None


def curve_tables(tree: JointTree) -> CurveTables | None:
    """Tables of a tree, in float64; None where no joint follows a curve."""
    if not any(joint.curve for joint in tree.joints):
        return None
    curves = [*(joint.curve or LINE for joint in tree.joints), LINE]
    pieces = max(len(curve.starts) for curve in curves)
    size = max(len(piece) for curve in curves for piece in curve.pieces)
    starts = np.zeros((len(curves), pieces))
    ends = np.full((pieces - 1, len(curves), 1), np.inf)
    powers = np.zeros((4, size, len(curves), pieces))
    for f, curve in enumerate(curves):
        starts[f, : len(curve.starts)] = curve.starts
        ends[: len(curve.starts) - 1, f, 0] = curve.starts[1:]
        for at, piece in enumerate(curve.pieces):
            powers[0, : len(piece), f, at] = piece
    for order in range(3):
        scaled = powers[order] * np.arange(size)[:, None, None]
        powers[order + 1, :-1] = scaled[1:]
    first = np.arange(len(curves))[:, None] * pieces
    return CurveTables(ends, first, starts.reshape(-1), powers.reshape(4, size, -1))


def displaced(xp: Any, tables: CurveTables | None, position: Any) -> Displacement:
    """For q of every frame's coordinate, (frames, samples)."""
    if tables is None:
        return Displacement(position)
    piece = tables.first + (position >= tables.ends).sum(0)
    at = position - tables.starts[piece]
    coefficients = tables.powers[:, :, piece]
    value = coefficients[:, -1]
    for power in range(coefficients.shape[1] - 2, -1, -1):
        value = value * at + coefficients[:, power]
    return Displacement(value[0], value[1], value[2], value[3])
