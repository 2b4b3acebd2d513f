"""Curves of what loads one joint, cause by cause, the largest first."""

from dataclasses import dataclass

import numpy as np

from linkwise.analysis.joint_causes import causes_of, curves
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.largest_few import largest_few
from linkwise.package.load import Array
from linkwise.plotstyle import drawn

MOST = 10
"""Joints whose motion has bars of its own; of others the sum has one."""
NOTHING = 1e-9
"""Of the largest cause, below which one is but rounding."""


@dataclass(frozen=True, eq=False)
class CauseCurve:
    """What one cause asks of the joint, (S,) in its unit; a motion has acceleration and velocity in one."""

    label: str
    values: Array
    is_motion: bool = False


def cause_curves(result: AnalysisResult, i: int) -> list[CauseCurve]:
    """All causes of joint i's torque that ask anything of it."""
    causes = causes_of(result, result.robot.plot_joints, drawn)
    every = curves(result, causes, i)
    peaks = np.abs(every).max(axis=1, initial=0.0)
    there = peaks > NOTHING * peaks.max()
    return [
        CauseCurve(cause.label, values, cause.is_motion)
        for cause, values, is_there in zip(causes, every, there, strict=True)
        if is_there
    ]


def largest(every: list[CauseCurve]) -> list[CauseCurve]:
    """The largest over the movement first; of many motions the small ones are one, the last."""
    order = sorted(every, key=lambda one: -rms(one.values))
    motions = [one for one in order if one.is_motion]
    small = [motions[at] for at in largest_few([rms(one.values) for one in motions], MOST)[1]]
    if not small:
        return order
    rest = CauseCurve(f"motion of {len(small)} others", np.sum([one.values for one in small], axis=0))
    return [*(one for one in order if one not in small), rest]


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
