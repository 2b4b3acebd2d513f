"""Figure of the wrench that a joint carries over time, a panel for each component, and its largest causes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import PASSIVE, REACTION_OF
from linkwise.analysis.show.drawn_curves import (
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

MOST = 5
"""Coordinates whose motions have curves of their own; all other motions are summed in one."""
NOTHING = 1e-9
"""Part of the largest moment, or force, below which a component is only rounding."""
MOTION = ("reaction_qdd", "reaction_qd")
Kind = Literal["sum", "gravity", "passive", "load", "motion", "motions"]


@dataclass(frozen=True, eq=False)
class BorneSource:
    """Sources of one kind, with a curve in each component."""

    kind: Kind
    label: str
    number: int
    """Index of the coordinate among those that move by themselves, or of the load; else 0."""
    rows: tuple[Index, ...]
    """Rows of the result that the curve sums up, for each component."""

    def curves(self, part: AnalysisResult) -> Array:
        """Return the curve in each component, (components, S)."""
        return np.array([part.values[some].sum(axis=0) for some in self.rows])

    @property
    def look(self) -> dict[str, Any]:
        """Arguments with which matplotlib draws the curves."""
        match self.kind:
            case "sum":
                return {"color": INK, "linewidth": 2.4}
            case "motion":
                return {
                    "color": colour(self.number),
                    "linewidth": 1.4,
                    "linestyle": dash(self.number),
                }
            case "motions":
                return {"color": BROWN, "linewidth": 1.0, "linestyle": "dashed"}
            case "load":
                return {"color": colour(self.number), "linewidth": 1.4, "linestyle": "dashdot"}
        return {
            "color": GRAVITY,
            "linewidth": 1.4,
            "linestyle": "dotted" if self.kind == "passive" else "solid",
        }


def reaction(result: AnalysisResult, number: int) -> "Figure":
    """Draw the wrench of one of the joints that were asked for, and what it is made of."""
    parts = _components(result, number)
    sources = _sources(result, number, parts)
    figure = new_figure(8.4, 1.2 + 1.5 * len(parts))
    panels = figure.subplots(len(parts), 1, sharex=True, squeeze=False)[:, 0]
    found = drawn_curves(result, lambda part: np.concatenate([one.curves(part) for one in sources]))
    names = result.rows.axes["wrench"].names
    for at, (panel, part) in enumerate(zip(panels, parts, strict=True)):
        for which, source in enumerate(sources):
            row = which * len(parts) + at
            panel.plot(found.time[row], found.values[row], label=drawn(source.label, 34), **source.look)
        zero_line(panel)
        unit = "N·m" if names[part].startswith("moment") else "N"
        panel.set_ylabel(f"{drawn(names[part].replace('_', ' '))} ({unit})")
    panels[0].legend(loc="upper left", bbox_to_anchor=(1.01, 1), fontsize=8, handlelength=2.6)
    time_axis(panels[-1], result)
    borne = result.borne[number]
    write_title(figure, result, f"What {drawn(column_part(borne.joint), 40)} carries")
    axes = {"joint": "axes of the joint, z along its axis", "world": "axes of the world"}
    told = axes.get(borne.axes, f"axes of {drawn(column_part(borne.axes), 40)}")
    write_note(figure, f"{told}; moments about the joint's origin", foot(result))
    return figure


def _components(result: AnalysisResult, number: int) -> list[int]:
    """Return the components that are more than rounding, moments beside moments and forces beside forces."""
    sizes = np.zeros(6)
    for part in range(6):
        rows = result.rows.numbers("reaction", *MOTION, "reaction_gravity", bearing=number, wrench=part)
        sizes[part] = result.totals.mean[rows].sum()
    largest = np.repeat([sizes[:3].max(), sizes[3:].max()], 3)
    return np.flatnonzero(sizes > NOTHING * largest).tolist() or [0]


def _sources(result: AnalysisResult, number: int, parts: Sequence[int]) -> list[BorneSource]:
    """Return the sum and the sources, motions with the largest mean force and moment first."""
    robot, names = result.robot, result.robot.plot_joints

    def source(kind: Kind, label: str, *quantities: str, at: int = 0, **where: Any) -> BorneSource:
        rows = (result.rows.numbers(*quantities, bearing=number, wrench=part, **where) for part in parts)
        return BorneSource(kind, label, at, tuple(rows))

    motions = [
        source("motion", f"motion of {names[k]}", *MOTION, at=at, cause=k)
        for at, k in enumerate(robot.driven)
    ]
    sizes = np.zeros((len(motions), len(parts)))
    for part in result.parts():
        sizes += np.array([np.abs(one.curves(part)).sum(axis=1) for one in motions])
    largest = sizes.max(axis=0, initial=0.0)
    weight = (sizes / np.where(largest > 0.0, largest, 1.0)).max(axis=1, initial=0.0)
    there = np.flatnonzero(weight)
    alone, rest = ([int(there[at]) for at in some] for some in largest_few(weight[there], MOST))
    found = [source("sum", "all together", "reaction"), source("gravity", "gravity", "reaction_gravity")]
    found += [motions[at] for at in alone]
    if rest:
        others = [robot.driven[at] for at in rest]
        found.append(source("motions", f"motions of {len(rest)} others", *MOTION, cause=others))
    for e, label in enumerate(result.load_labels):
        found.append(source("load", label, "reaction_load", at=len(robot.driven) + e, load=e))
    own = [REACTION_OF[name] for name in PASSIVE if REACTION_OF[name] in result.rows]
    if own:
        found.append(source("passive", "springs and losses of followers", *own))
    return found
