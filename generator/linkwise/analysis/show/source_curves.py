"""Curves of an acceleration and of its shares: each joint's torque and each load alone, the rest by kind."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_columns import Column
from linkwise.analysis.result_quantities import Quantity
from linkwise.analysis.show.largest_few import largest_few
from linkwise.package.load import Array

MOST = 8
"""Joints whose torques have curves of their own; of others the sum has one."""
NOTHING = 1e-9
"""Of the largest component, below which one is but rounding."""
MOTION: tuple[Quantity, ...] = ("acc_qd", "acc_constraint", "acc_kinematic")
LOSSES: tuple[Quantity, ...] = ("acc_spring", "acc_damping", "acc_friction")


@dataclass(frozen=True)
class SourceCurve:
    """What sources of one kind make of the components of an acceleration."""

    kind: Literal["sum", "torque", "torques", "gravity", "velocity", "passive", "load", "contact"]
    label: str
    number: int
    """Of a joint among those that have torques, of a load among loads; else 0."""
    values: Array
    """(rows, S)."""


def components(result: AnalysisResult, point: int, angular: bool = True) -> dict[int, tuple[str, str]]:
    """Name and unit of a point's components that any source accelerates, by row.

    In a planar robot nothing does across its plane. angular: those of a frame's turning, too
    """
    names = {c.row: (c.name.split("/")[2], c.unit) for c in result.columns if c.point == point}
    shares: dict[int, float] = {
        row: 0.0
        for row, (name, _) in names.items()
        if row is not None and (angular or "angular_" not in name)
    }
    for column, mean in zip(result.columns, result.totals.mean, strict=True):
        if column.point == point and column.row in shares:
            shares[column.row] += mean
    most = max(shares.values(), default=0.0)
    moving = [row for row, share in shares.items() if share > NOTHING * most]
    return {row: names[row] for row in moving or list(shares)[:1]}


def source_curves(result: AnalysisResult, point: int, rows: Sequence[int]) -> Iterator[SourceCurve]:
    """The acceleration, and what sums to it."""
    every = result.robot.driven
    yield SourceCurve("sum", "all together", 0, _sum(result, point, rows, ("acc",)))
    torques = [_sum(result, point, rows, ("acc_tau",), i) for i in every]
    there = [at for at in range(len(every)) if torques[at].any()]  # contacts may leave none to a base
    named, rest = largest_few([float(np.abs(torques[at]).sum()) for at in there], MOST)
    alone, others = [there[at] for at in named], [there[at] for at in rest]
    for at in alone:
        yield SourceCurve("torque", f"torque of {result.robot.plot_joints[every[at]]}", at, torques[at])
    if others:
        together = np.sum([torques[at] for at in others], axis=0)
        yield SourceCurve("torques", f"torques of {len(others)} others", 0, together)
    yield SourceCurve("gravity", "gravity", 0, _sum(result, point, rows, ("acc_gravity",)))
    yield SourceCurve("velocity", "velocities", 0, _sum(result, point, rows, MOTION))
    if any(c.quantity in LOSSES for c in result.columns):
        yield SourceCurve("passive", "springs and losses", 0, _sum(result, point, rows, LOSSES))
    for e, label in enumerate(result.load_labels):
        yield SourceCurve("load", label, e, _sum(result, point, rows, ("acc_load",), e))
    if result.robot.contacts is not None:
        moved = _sum(result, point, rows, ("acc_contact",))
        yield SourceCurve("contact", "contacts that slip or turn", 0, moved)


def numbers_of_curves(columns: Sequence[Column]) -> int:
    """How many numbers of a sample the curves of all points hold, at most."""
    kinds = {"acc": 5, "acc_tau": 1, "acc_load": 1}
    return sum(kinds.get(column.quantity, 0) for column in columns)


def _sum(
    result: AnalysisResult,
    point: int,
    rows: Sequence[int],
    quantities: tuple[Quantity, ...],
    cause: int | None = None,
) -> Array:
    """Shares (rows, S) of some kinds, of one cause or of all."""
    out = np.zeros((len(rows), len(result.time)))
    for column, values in zip(result.columns, result.values, strict=True):
        asked = column.quantity in quantities and cause in (None, column.cause)
        if asked and column.point == point and column.row in rows:
            out[rows.index(column.row)] += values
    return out
