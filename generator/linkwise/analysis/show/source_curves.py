"""Curves of an acceleration and its shares: by each joint's torque and each load alone, the rest by kind."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_columns import Column
from linkwise.analysis.result_quantities import Quantity
from linkwise.analysis.show.drawn_curves import PIECES, DrawnCurves, drawn_curves
from linkwise.analysis.show.largest_few import largest_few
from linkwise.package.load import Array

MOST = 8
"""Joints whose torques have curves of their own; all other torques are summed in one."""
NOTHING = 1e-9
"""Part of the largest component below which a component is only rounding."""
MOTION: tuple[Quantity, ...] = ("acc_qd", "acc_constraint", "acc_kinematic")
LOSSES: tuple[Quantity, ...] = ("acc_spring", "acc_damping", "acc_friction")
Kind = Literal["sum", "torque", "torques", "gravity", "velocity", "passive", "load", "contact"]


@dataclass(frozen=True)
class SourceCurve:
    """Share of the sources of one kind in the components of an acceleration."""

    kind: Kind
    label: str
    number: int
    """Index of a joint among those that have torques, or of a load among loads; else 0."""
    drawn: DrawnCurves
    """Curves, one for each row."""


def components(result: AnalysisResult, point: int, angular: bool = True) -> dict[int, tuple[str, str]]:
    """Return the name and unit of a point's components that any source accelerates, by row.

    In a planar robot nothing accelerates across its plane. angular: include the components of a frame's
    rotation
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


@dataclass(frozen=True)
class _Source:
    """Source of a `SourceCurve`: columns of some quantities, and of these causes, if any are named."""

    kind: Kind
    label: str
    number: int
    quantities: tuple[Quantity, ...]
    causes: tuple[int | None, ...] = ()


def source_curves(
    result: AnalysisResult, point: int, rows: Sequence[int], pieces: int = PIECES
) -> list[SourceCurve]:
    """Return the acceleration, and the shares that sum to it, over all samples."""
    sources = _sources(result, point, rows)

    def curves(part: AnalysisResult) -> Array:
        return np.concatenate([_sum(part, point, rows, source) for source in sources])

    found = drawn_curves(result, curves, pieces)
    each = [slice(at, at + len(rows)) for at in range(0, len(sources) * len(rows), len(rows))]
    return [
        SourceCurve(source.kind, source.label, source.number, found.only(mine))
        for source, mine in zip(sources, each, strict=True)
    ]


def _sources(result: AnalysisResult, point: int, rows: Sequence[int]) -> list[_Source]:
    every, names = result.robot.driven, result.robot.plot_joints
    torques = [
        _Source("torque", f"torque of {names[i]}", at, ("acc_tau",), (i,)) for at, i in enumerate(every)
    ]
    sizes = np.zeros(len(every))
    for part in result.parts():
        sizes += [float(np.abs(_sum(part, point, rows, one)).sum()) for one in torques]
    there = np.flatnonzero(sizes)  # contacts may leave no torque to a base
    alone, rest = ([int(there[at]) for at in some] for some in largest_few(sizes[there], MOST))
    found = [_Source("sum", "all together", 0, ("acc",)), *(torques[at] for at in alone)]
    if rest:
        others = tuple(every[at] for at in rest)
        found.append(_Source("torques", f"torques of {len(rest)} others", 0, ("acc_tau",), others))
    found.append(_Source("gravity", result.robot.potential, 0, ("acc_gravity",)))
    found.append(_Source("velocity", "velocities", 0, MOTION))
    if any(c.quantity in LOSSES for c in result.columns):
        found.append(_Source("passive", "springs and losses", 0, LOSSES))
    for e, label in enumerate(result.load_labels):
        found.append(_Source("load", label, e, ("acc_load",), (e,)))
    if result.robot.contacts is not None:
        found.append(_Source("contact", "contacts that slip or turn", 0, ("acc_contact",)))
    return found


def numbers_of_curves(columns: Sequence[Column]) -> int:
    """Return how many numbers per sample the curves of all points hold, at most."""
    kinds = {"acc": 5, "acc_tau": 1, "acc_load": 1}
    return sum(kinds.get(column.quantity, 0) for column in columns)


def _sum(result: AnalysisResult, point: int, rows: Sequence[int], source: _Source) -> Array:
    """Return a source's share (rows, S)."""
    out = np.zeros((len(rows), len(result.time)))
    for column, values in zip(result.columns, result.values, strict=True):
        asked = column.quantity in source.quantities and (not source.causes or column.cause in source.causes)
        if asked and column.point == point and column.row in rows:
            out[rows.index(column.row)] += values
    return out
