"""Accelerations of a point, or of the joints, and the shares of what causes them, over time."""

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.induced_points import CENTRE, JOINTS
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_columns import Quantity
from linkwise.extras import extra
from linkwise.package.load import Array
from linkwise.plotstyle import GRAVITY, INK, colour, dash, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 8
"""Joints whose torques have curves of their own; of others the sum has one."""
NOTHING = 1e-9
"""Of the largest component, below which one is but rounding."""
TITLES = {JOINTS: "the joints", CENTRE: "the centre of mass"}
MOTION: tuple[Quantity, ...] = ("acc_qd", "acc_kinematic")
PASSIVE: tuple[Quantity, ...] = ("acc_spring", "acc_damping", "acc_friction")

Curve = tuple[str, Array, dict[str, Any]]
"""Label, values (rows, S), and how the line looks."""


def induced(result: AnalysisResult, point: int) -> "Figure":
    """A panel for each component, of a frame those of its point: shares by source, and their sum."""
    name = result.induced[point]
    names = {c.row: (c.name.split("/")[2], c.unit) for c in result.columns if c.point == point}
    rows = _moving(result, point, [at for at, (row, _) in names.items() if "angular_" not in row])
    curves = _curves(result, point, rows)
    figure = extra("matplotlib.figure").Figure(figsize=(8.4, 1.2 + 1.7 * len(rows)), layout="constrained")
    panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    for at, (row, panel) in enumerate(zip(rows, panels, strict=True)):
        for label, values, look in curves:
            panel.plot(result.time, values[at], label=label, **look)
        panel.axhline(0, color="#9AA3AF", linewidth=0.6, zorder=0)
        component, unit = names[row]
        panel.set_ylabel(f"{drawn(component)} ({unit})")
    panels[0].legend(loc="upper left", bbox_to_anchor=(1.01, 1), fontsize=8, handlelength=2.6)
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(result.time[0], result.time[-1])
    figure.suptitle(
        f"What accelerates {drawn(TITLES.get(name, name))} · {drawn(result.robot.name, 40)}"
        f" · {drawn(result.source, 50)}",
        x=0.01,
        ha="left",
        fontsize=11,
    )
    figure.supxlabel(result.provenance, x=0.01, ha="left", fontsize=7, color="#5A6270")
    return figure  # type: ignore[no-any-return]


def _moving(result: AnalysisResult, point: int, rows: list[int | None]) -> list[int | None]:
    """Components that any source accelerates: in a planar robot nothing does across its plane."""
    shares = np.zeros(len(rows))
    for column, mean in zip(result.columns, result.totals.mean, strict=True):
        if column.point == point and column.row in rows:
            shares[rows.index(column.row)] += mean
    return [row for row, share in zip(rows, shares, strict=True) if share > NOTHING * shares.max()] or rows[
        :1
    ]


def _curves(result: AnalysisResult, point: int, rows: list[int | None]) -> list[Curve]:
    joints = [_sum(result, point, rows, ("acc_tau",), i) for i in range(len(result.robot.joints))]
    order = sorted(range(len(joints)), key=lambda i: -float(np.abs(joints[i]).sum()))
    alone = sorted(order if len(order) <= MOST else order[:MOST])
    curves: list[Curve] = [("all together", _sum(result, point, rows, ("acc",)), _look(INK, 2.4))]
    for i in alone:
        look = _look(colour(i)) | {"linestyle": dash(i)}
        curves.append((f"torque of {drawn(result.robot.joints[i])}", joints[i], look))
    if others := order[len(alone) :]:
        rest = np.sum([joints[i] for i in others], axis=0)
        curves.append((f"torques of {len(others)} others", rest, _look("#B5651D", 1.0)))
    curves.append(("gravity", _sum(result, point, rows, ("acc_gravity",)), _look(GRAVITY)))
    motion = _sum(result, point, rows, MOTION)
    curves.append(("velocities", motion, _look(GRAVITY) | {"linestyle": "dashed"}))
    if any(c.quantity in PASSIVE for c in result.columns):
        own = _sum(result, point, rows, PASSIVE)
        curves.append(("springs and losses", own, _look(GRAVITY) | {"linestyle": "dotted"}))
    for e, borne in enumerate(result.loads):
        look = _look(colour(len(joints) + e)) | {"linestyle": "dashdot"}
        curves.append((drawn(borne.name), _sum(result, point, rows, ("acc_load",), e), look))
    return curves


def _look(ink: str, width: float = 1.4) -> dict[str, Any]:
    return {"color": ink, "linewidth": width}


def _sum(
    result: AnalysisResult,
    point: int,
    rows: list[int | None],
    quantities: tuple[Quantity, ...],
    cause: int | None = None,
) -> Array:
    """Shares (rows, S) of some kinds, of one cause or of all."""
    out = np.zeros((len(rows), len(result.time)))
    for column, values in zip(result.columns, result.values, strict=True):
        asked = column.quantity in quantities and cause in (None, column.cause)
        if column.point == point and column.row in rows and asked:
            out[rows.index(column.row)] += values
    return out
