"""Causes of joint torques, and which is the largest: the same in figures, on the page and in the notebook.

A coordinate's motion is one cause: its acceleration and its velocity, through all links, are summed first.
The size of a cause is the mean magnitude of that sum.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import MOTION, PASSIVE
from linkwise.analysis.row_sums import SumDeviations
from linkwise.arrays import Array, Index, Mask


@dataclass(frozen=True)
class Cause:
    """One cause of joint torques, and its quantities."""

    kind: Literal["named", "load", "own", "motion"]
    label: str
    quantities: tuple[str, ...]
    number: int | None = None
    """Number of the share with a name, of the load, or of the joint that moves."""

    @property
    def is_motion(self) -> bool:
        """True if the cause is a joint's motion."""
        return self.kind == "motion"

    def rows(self, result: AnalysisResult, i: int) -> Index:
        """Return the numbers of the rows of the cause's torques on joint i."""
        axis = {"load": "load", "named": "share"}.get(self.kind, "cause")
        where = {} if self.number is None else {axis: self.number}
        return result.rows.numbers(*self.quantities, joint=i, **where)


def causes_of(
    result: AnalysisResult,
    joints: Sequence[str],
    shown: Callable[[str], str] = str,
) -> tuple[Cause, ...]:
    """Return the causes in order: gravity or shares with names, loads, passive torques, each joint's motion.

    joints: names of the joints, (n,); shown: function that formats a name
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
    found += [Cause("motion", f"{shown(joints[k])} motion", MOTION, k) for k in robot.driven]
    return tuple(found)


def sizes(result: AnalysisResult, causes: Sequence[Cause], joints: Sequence[int] | None = None) -> Array:
    """Return the mean magnitude of each cause's net torque on joints with torques, (causes, joints).

    The mean is over all samples. Links are summed first: where links pull against each other, or an
    acceleration and a velocity do, the difference counts.

    joints: numbers of the joints, all that have torques if not given
    """
    loaded = result.robot.driven if joints is None else joints
    rows = [[cause.rows(result, i) for i in loaded] for cause in causes]
    total = np.zeros((len(causes), len(loaded)))
    for part in result.parts():
        total += [[np.abs(part.values[own].sum(axis=0)).sum() for own in some] for some in rows]
    return total / result.total


def largest_first(sizes: Array) -> list[int]:
    """Return the numbers of causes by their sizes on one joint, (causes,), the largest first."""
    return sorted(range(len(sizes)), key=lambda at: -float(sizes[at]))


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
