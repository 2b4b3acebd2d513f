"""Parts of the bars of the shares: gravity, loads, joints' own torques, motions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.joint_causes import Cause, are_motions_whole, causes_of, sizes
from linkwise.analysis.result import AnalysisResult
from linkwise.package.load import Array
from linkwise.plotstyle import BLUE, GRAVITY, SKY, VERMILION, drawn, tone

MANY = 12
"""Number of joints above which a bar has the joint's own motion, the largest other one, and the rest."""
HATCHES = {"motion": "", "acceleration": "", "velocity": "////", "own": "....", "load": "xx"}
LARGEST, REST = "largest motion of another joint", "motions of all other joints, shares added"


@dataclass(frozen=True, eq=False)
class SharePart:
    """A part of every joint's bar: mean sizes of net torques (joints,), and how it looks."""

    label: str
    sizes: Array
    fill: str
    hatch: str = ""
    names: tuple[str, ...] = ()
    """Name of the cause at each joint, where it differs from joint to joint."""


def share_parts(result: AnalysisResult) -> tuple[list[SharePart], list[SharePart]]:
    """Return parts for gravity, loads and joints' own torques, and parts for motions.

    Motions are grouped if there are more joints than `MANY`.
    """
    robot = result.robot
    causes = causes_of(result, robot.plot_joints, drawn, together=are_motions_whole(result))
    found = list(zip(causes, sizes(result, causes), strict=True))
    moving = [(cause, size) for cause, size in found if cause.is_motion]
    fixed = [(cause, size) for cause, size in found if not cause.is_motion]
    return _fixed(result, fixed), _few(result, moving) if len(robot.driven) > MANY else _each(result, moving)


def _fixed(result: AnalysisResult, found: Sequence[tuple[Cause, Array]]) -> list[SharePart]:
    """Return parts for gravity, loads, and joints' own torques."""
    own = [cause for cause, _ in found if cause.kind == "own"]
    tones = [*own, *(cause for cause, _ in found if cause.kind == "load")]  # in the page's order
    out = []
    for cause, values in found:
        if cause.kind == "gravity":
            out.append(SharePart(cause.label, values, GRAVITY))
        else:
            fill = tone(len(result.robot.driven) + tones.index(cause))
            out.append(SharePart(cause.label, values, fill, HATCHES[cause.kind]))
    return out


def _each(result: AnalysisResult, found: Sequence[tuple[Cause, Array]]) -> list[SharePart]:
    """Return a part for every motion, or for its acceleration and its velocity."""
    place = {k: at for at, k in enumerate(result.robot.driven)}
    return [
        SharePart(cause.label, values, tone(place[cause.number or 0]), HATCHES[cause.kind])
        for cause, values in found
    ]


def _few(result: AnalysisResult, found: Sequence[tuple[Cause, Array]]) -> list[SharePart]:
    """Return parts for many joints: each one's own motion, the largest other one, and the sum of the rest."""
    driven, names = result.robot.driven, result.robot.plot_joints
    by = np.array([size for _, size in found]).T
    own = by.diagonal()
    others = by * (1.0 - np.eye(len(driven)))
    largest = others.max(axis=1)
    first = tuple(drawn(names[driven[k]]) for k in others.argmax(axis=1))
    return [
        SharePart("its own motion", own, VERMILION),
        SharePart(LARGEST, largest, BLUE, names=first),
        SharePart(REST, others.sum(axis=1) - largest, SKY),
    ]
