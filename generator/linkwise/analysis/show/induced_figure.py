"""Figure of the accelerations of a point, or of the joints, and the shares of their causes, over time.

Each joint's torque and each load have a curve of their own, all else one by its kind.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from linkwise.analysis.induced_points import CENTRE, JOINTS
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import INDUCED, LOSSES
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.show.drawn_curves import (
    PIECES,
    DrawnCurves,
    drawn_curves,
    foot,
    largest_few,
    new_figure,
    time_axis,
    write_note,
    write_title,
    zero_line,
)
from linkwise.arrays import Array, Index
from linkwise.escape import column_part
from linkwise.plotstyle import BROWN, GRAVITY, INK, colour, dash, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 8
"""Joints whose torques have curves of their own; all other torques are summed in one."""
NOTHING = 1e-9
"""Part of the largest component below which a component is only rounding."""
MOTION = ("acc_qd", "acc_constraint", "acc_kinematic", "acc_velocity")
Kind = Literal["sum", "torque", "torques", "named", "velocity", "passive", "load", "contact"]


@dataclass(frozen=True, eq=False)
class ShareSource:
    """Sources of one kind, whose share in the components of an acceleration has one curve each."""

    kind: Kind
    label: str
    number: int
    """Index of a joint among those that have torques, or of a load among loads; else 0."""
    rows: tuple[Index, ...]
    """Index of the result that the share sums up, for each component."""

    def share(self, part: AnalysisResult) -> Array:
        """Return the share in each component, (components, S)."""
        return np.array([part.values[some].sum(axis=0) for some in self.rows])


def components(result: AnalysisResult, point: int, angular: bool = True) -> dict[int, tuple[str, str]]:
    """Return the name and unit of a point's components that any source accelerates, by row.

    In a planar robot nothing accelerates across its plane. angular: include the components of a frame's
    rotation
    """
    here, every = result.rows.points[point], result.rows.axes["component"].names
    names = {
        every.index(row): (column_part(row), unit)
        for row, unit in zip(here.rows, here.units, strict=True)
        if angular or "angular_" not in row
    }
    sizes = {
        at: result.totals.mean[result.rows.numbers(*INDUCED, point=point, component=at)].sum() for at in names
    }
    most = max(sizes.values(), default=0.0)
    moving = [at for at, size in sizes.items() if size > NOTHING * most]
    return {at: names[at] for at in moving or list(names)[:1]}


def source_curves(
    result: AnalysisResult, point: int, components: Sequence[int], pieces: int = PIECES
) -> list[tuple[ShareSource, DrawnCurves]]:
    """Return the acceleration, and the shares that sum to it, over all samples."""
    sources, count = _sources(result, point, components), len(components)
    found = drawn_curves(result, lambda part: np.concatenate([one.share(part) for one in sources]), pieces)
    return [(one, found.only(slice(at * count, (at + 1) * count))) for at, one in enumerate(sources)]


def _sources(result: AnalysisResult, point: int, components: Sequence[int]) -> list[ShareSource]:
    every, names = result.robot.driven, result.robot.plot_joints

    def source(
        kind: Kind, label: str, *quantities: str, number: int = 0, **where: int | Sequence[int]
    ) -> ShareSource:
        rows = (result.rows.numbers(*quantities, point=point, component=at, **where) for at in components)
        return ShareSource(kind, label, number, tuple(rows))

    torques = [
        source("torque", f"torque of {names[i]}", "acc_tau", number=at, cause=i) for at, i in enumerate(every)
    ]
    sizes = np.zeros(len(every))
    for part in result.parts():
        sizes += [float(np.abs(one.share(part)).sum()) for one in torques]
    there = np.flatnonzero(sizes)  # contacts may leave no torque to a base
    alone, rest = ([int(there[at]) for at in some] for some in largest_few(sizes[there], MOST))
    found = [source("sum", "all together", "acc"), *(torques[at] for at in alone)]
    if rest:
        others = [every[at] for at in rest]
        found.append(source("torques", f"torques of {len(rest)} others", "acc_tau", cause=others))
    if result.robot.is_written:
        named = enumerate(result.robot.share_names)
        found += [source("named", name, "acc_share", number=m, share=m) for m, name in named]
    else:
        found.append(source("named", "gravity", "acc_gravity", "acc_weight"))
    found.append(source("velocity", "velocities", *MOTION))
    if any(name in result.rows for name in LOSSES):
        found.append(source("passive", "springs and losses", *LOSSES))
    for e, label in enumerate(result.load_labels):
        found.append(source("load", label, "acc_load", number=e, load=e))
    if result.robot.contacts is not None:
        found.append(source("contact", "contacts that slip or turn", "acc_contact"))
    return found


def numbers_of_curves(rows: ResultRows) -> int:
    """Return how many numbers per sample the curves of all points hold, at most."""
    kinds = {"acc": 5, "acc_tau": 1, "acc_load": 1, "acc_share": 1}
    return sum(count * len(rows[name].at) for name, count in kinds.items())


TITLES = {JOINTS: "the joints", CENTRE: "the centre of mass"}


def induced(result: AnalysisResult, point: int) -> "Figure":
    """Draw a panel for each component, for a frame those of its point: shares by source, and their sum."""
    name = result.induced[point]
    shown = components(result, point, angular=False)
    figure = new_figure(8.4, 1.2 + 1.7 * len(shown))
    panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    curves = source_curves(result, point, list(shown))
    for at, (panel, (component, unit)) in enumerate(zip(panels, shown.values(), strict=True)):
        for source, found in curves:
            look = _look(source, len(result.robot.driven), len(result.load_labels))
            panel.plot(found.time[at], found.values[at], label=drawn(source.label, 34), **look)
        zero_line(panel)
        panel.set_ylabel(f"{drawn(component)} ({unit})")
    panels[0].legend(loc="upper left", bbox_to_anchor=(1.01, 1), fontsize=8, handlelength=2.6)
    time_axis(panels[-1], result)
    write_title(figure, result, f"What accelerates {drawn(TITLES.get(name, name))}")
    write_note(figure, foot(result))
    return figure


def _look(source: ShareSource, joints: int, loads: int) -> dict[str, Any]:
    match source.kind:
        case "sum":
            return {"color": INK, "linewidth": 2.4}
        case "torque":
            return {
                "color": colour(source.number),
                "linewidth": 1.4,
                "linestyle": dash(source.number),
            }
        case "torques":
            return {"color": BROWN, "linewidth": 1.0}
        case "load":
            return {"color": colour(joints + source.number), "linewidth": 1.4, "linestyle": "dashdot"}
        case "named" if source.number:  # the first is grey
            shade = colour(joints + loads + source.number - 1)
            return {"color": shade, "linewidth": 1.4, "linestyle": "solid"}
    style = {"named": "solid", "velocity": "dashed", "passive": "dotted", "contact": "dashdot"}[source.kind]
    return {"color": GRAVITY, "linewidth": 1.4, "linestyle": style}
