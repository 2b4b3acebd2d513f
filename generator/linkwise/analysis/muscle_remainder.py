"""Remainders of the joint torques that inverse dynamics asks for, once muscles have given theirs."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.escape import listed

SHOWN = 4
"""Joints of which a line tells."""


@dataclass(frozen=True)
class Remainder:
    """Torque of a joint before muscles and what they leave of it: root mean square and largest magnitude."""

    joint: str
    unit: str
    rms: float
    peak: float
    rms_before: float
    peak_before: float

    def __str__(self) -> str:
        before = f"{self.rms_before:.3g} and {self.peak_before:.3g} {self.unit}"
        return f"{self.joint} {self.rms:.3g} and {self.peak:.3g} of {before}"


def remainders(result: AnalysisResult) -> tuple[Remainder, ...]:
    """Return the remainder of every joint with a torque; none without muscles, or if not asked for."""
    left, before = result.rows["tau"], result.rows["tau_before_muscles"]
    if not len(before.numbers) or len(left.numbers) != len(before.numbers):
        return ()
    totals = result.totals
    return tuple(
        Remainder(
            result.robot.joints[i],
            result.robot.torque_units[i],
            *(float(one[row]) for row in (a, b) for one in (totals.rms, totals.peak)),
        )
        for a, b, (i,) in zip(left.numbers, before.numbers, before.at.tolist(), strict=True)
    )


def remainder_line(result: AnalysisResult) -> str:
    """Return a line on the joints of which muscles leave the largest part; empty without muscles."""
    found = remainders(result)
    if not found:
        return ""
    parts = np.array([one.rms / one.rms_before if one.rms_before else 0.0 for one in found])
    worst = [str(found[at]) for at in np.argsort(-parts, kind="stable")[:SHOWN]]
    return f"muscles leave of joint torques, root mean square and largest: {listed(worst)}"


def remainder_record(result: AnalysisResult) -> list[dict[str, Any]]:
    """Return the remainders as plain data."""
    return [asdict(one) for one in remainders(result)]
