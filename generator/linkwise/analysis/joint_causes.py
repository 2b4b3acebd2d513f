"""Causes of joint torques, the same in every figure and in the notebook."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import MOTION, PASSIVE
from linkwise.analysis.row_sums import SumDeviations
from linkwise.arrays import Array, Index, Mask

MOTIONS: dict[str, tuple[str, ...]] = {
    "acceleration": MOTION[:1],
    "velocity": MOTION[1:],
    "motion": MOTION,
}
FEW = 7
"""Most joints for which a joint's acceleration and velocity are two causes, unless chosen otherwise."""


@dataclass(frozen=True)
class Cause:
    """One cause of joint torques, and its quantities."""

    kind: Literal["named", "load", "own", "acceleration", "velocity", "motion"]
    label: str
    quantities: tuple[str, ...]
    number: int | None = None
    """Number of the share with a name, of the load, or of the joint that moves."""

    @property
    def is_motion(self) -> bool:
        """True if the cause is a joint's motion, or a part of that."""
        return self.kind in MOTIONS

    def rows(self, result: AnalysisResult, i: int) -> Index:
        """Return the numbers of the rows of the cause's torques on joint i."""
        axis = {"load": "load", "named": "share"}.get(self.kind, "cause")
        where = {} if self.number is None else {axis: self.number}
        return result.rows.numbers(*self.quantities, joint=i, **where)


def causes_of(
    result: AnalysisResult,
    joints: Sequence[str],
    shown: Callable[[str], str] = str,
    together: bool = True,
) -> tuple[Cause, ...]:
    """Return the causes in order: gravity or shares with names, loads, passive torques, each joint's motion.

    joints: names of the joints, (n,); shown: function that formats a name. together: a motion is one cause,
    otherwise its acceleration and its velocity are two.
    """
    robot = result.robot
    if robot.is_written:
        found = [Cause("named", shown(name), ("tau_share",), m) for m, name in enumerate(robot.share_names)]
    else:
        found = [Cause("named", "gravity", ("tau_gravity",))]
    found += [Cause("load", shown(name), ("tau_load",), e) for e, name in enumerate(result.load_labels)]
    found += [
        Cause("own", f"own {name.removeprefix('tau_')}", (name,)) for name in PASSIVE if name in result.rows
    ]
    kinds: tuple[Any, ...] = ("motion",) if together else ("acceleration", "velocity")
    for k in result.robot.driven:
        found += [Cause(kind, f"{shown(joints[k])} {kind}", MOTIONS[kind], k) for kind in kinds]
    return tuple(found)


def are_motions_whole(result: AnalysisResult) -> bool:
    """Return whether a joint's motion is one cause in shares and at first on the page.

    It is one where the joints are many.
    """
    return len(result.robot.driven) > FEW


def sizes(result: AnalysisResult, causes: Sequence[Cause]) -> Array:
    """Return the mean magnitude of each cause's net torque on every joint with torques, (causes, joints).

    The mean is over all samples. Links are summed first: where links pull against each other, or an
    acceleration and a velocity do, the difference counts.
    """
    rows = [[cause.rows(result, i) for i in result.robot.driven] for cause in causes]
    total = np.zeros((len(causes), len(result.robot.driven)))
    for part in result.parts():
        total += [[np.abs(part.values[own].sum(axis=0)).sum() for own in some] for some in rows]
    return total / result.total


class CauseCertainty(NamedTuple):
    """Certainty of the causes' net torques, (causes, joints) each."""

    deviation: Array
    """Standard deviation of the mean magnitude over all samples at most, in the joint's unit; else 0."""
    unsure: Mask
    """True where the net torque has no certain sign even where it is largest, next to nothing left out."""


def certainty(result: AnalysisResult, causes: Sequence[Cause]) -> CauseCertainty:
    """Return how certain the net torque of each cause on every joint with torques is, (causes, joints)."""
    shape = len(causes), len(result.robot.driven)
    sums = SumDeviations(
        result.rows, [cause.rows(result, i) for cause in causes for i in result.robot.driven]
    )
    for part in result.parts() if len(sums.known) else ():
        sums.add(part.values)
    joints = np.tile(np.arange(shape[1]), shape[0])
    return CauseCertainty(sums.mean().reshape(shape), sums.unsure(joints).reshape(shape))


def deviation_curves(result: AnalysisResult, causes: Sequence[Cause], i: int) -> Array:
    """Return the standard deviation of each cause's torque on joint i at most, (causes, S); 0 without any."""
    rows = (result.rows.deviations(cause.rows(result, i)) for cause in causes)
    return np.array([result.values[some].sum(axis=0) for some in rows])


def curves(result: AnalysisResult, causes: Sequence[Cause], i: int) -> Array:
    """Return the torque of each cause on joint i, (causes, S), in the joint's unit."""
    return np.array([result.values[cause.rows(result, i)].sum(axis=0) for cause in causes])
