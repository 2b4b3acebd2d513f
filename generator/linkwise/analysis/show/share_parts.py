"""What the bars of the shares consist of: gravity, loads, what joints have of their own, motions."""

from dataclasses import dataclass

import numpy as np

from linkwise.analysis.joint_causes import causes_of, sizes
from linkwise.analysis.result import AnalysisResult
from linkwise.package.load import Array
from linkwise.plotstyle import BLUE, GRAVITY, SKY, VERMILION, drawn, tone

MANY = 12
"""Joints above which a bar has the joint's own motion, the largest other one, and the rest."""
HATCHES = {"acceleration": "", "velocity": "////", "own": "....", "load": "xx"}
LARGEST = "largest motion of another joint"


@dataclass(frozen=True, eq=False)
class SharePart:
    """A part of every joint's bar, the mean sizes of a cause's torque (joints,), and how it looks."""

    label: str
    sizes: Array
    fill: str
    hatch: str = ""
    names: tuple[str, ...] = ()
    """Of what the part is, where that differs from joint to joint."""


def fixed_parts(result: AnalysisResult) -> list[SharePart]:
    """Gravity, loads, and what joints have of their own."""
    causes = [cause for cause in causes_of(result, result.robot.plot_joints, drawn) if not cause.is_motion]
    own = [cause for cause in causes if cause.kind == "own"]
    tones = [*own, *(cause for cause in causes if cause.kind == "load")]  # as the page has them
    out = []
    for cause, values in zip(causes, sizes(result, causes), strict=True):
        if cause.kind == "gravity":
            out.append(SharePart(cause.label, values, GRAVITY))
        else:
            fill = tone(len(result.robot.driven) + tones.index(cause))
            out.append(SharePart(cause.label, values, fill, HATCHES[cause.kind]))
    return out


def moving_parts(result: AnalysisResult) -> list[SharePart]:
    """Acceleration and velocity of each joint; of many joints those that `MANY` tells."""
    return _few(result) if len(result.robot.driven) > MANY else _each(result)


def _each(result: AnalysisResult) -> list[SharePart]:
    """Acceleration and velocity of each joint."""
    every = causes_of(result, result.robot.plot_joints, drawn, together=False)
    causes = [cause for cause in every if cause.is_motion]
    place = {k: at for at, k in enumerate(result.robot.driven)}
    return [
        SharePart(cause.label, values, tone(place[cause.number or 0]), HATCHES[cause.kind])
        for cause, values in zip(causes, sizes(result, causes), strict=True)
    ]


def _few(result: AnalysisResult) -> list[SharePart]:
    """Of many joints: each one's own motion, the largest other motion, and the rest."""
    driven, names = result.robot.driven, result.robot.plot_joints
    by = sizes(result, [cause for cause in causes_of(result, names) if cause.is_motion]).T
    own = by.diagonal()
    others = by * (1.0 - np.eye(len(driven)))
    largest = others.max(axis=1)
    first = tuple(drawn(names[driven[k]]) for k in others.argmax(axis=1))
    return [
        SharePart("its own motion", own, VERMILION),
        SharePart(LARGEST, largest, BLUE, names=first),
        SharePart("motion of all other joints", others.sum(axis=1) - largest, SKY),
    ]
