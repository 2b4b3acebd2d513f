"""Figure of the accelerations of a point, or of the joints, and the shares of their causes, over time."""

import textwrap
from typing import TYPE_CHECKING, Any

from linkwise.analysis.induced_points import CENTRE, JOINTS
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.drawn_curves import foot
from linkwise.analysis.show.source_curves import SourceCurve, components, source_curves
from linkwise.extras import extra
from linkwise.plotstyle import BROWN, GRAVITY, INK, colour, dash, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLES = {JOINTS: "the joints", CENTRE: "the centre of mass"}


def induced(result: AnalysisResult, point: int) -> "Figure":
    """Draw a panel for each component, for a frame those of its point: shares by source, and their sum."""
    name = result.induced[point]
    shown = components(result, point, angular=False)
    figure: Figure = extra("matplotlib.figure").Figure(
        figsize=(8.4, 1.2 + 1.7 * len(shown)), layout="constrained"
    )
    panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    curves = source_curves(result, point, list(shown))
    for at, (panel, (component, unit)) in enumerate(zip(panels, shown.values(), strict=True)):
        for curve in curves:
            look = _look(curve, len(result.robot.driven))
            line = curve.drawn.time[at], curve.drawn.values[at]
            panel.plot(*line, label=drawn(curve.label, 34), **look)
        panel.axhline(0, color="#9AA3AF", linewidth=0.6, zorder=0)
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
    figure.supxlabel(textwrap.fill(foot(result), 140), x=0.01, ha="left", fontsize=7, color="#5A6270")
    return figure


def _look(curve: SourceCurve, joints: int) -> dict[str, Any]:
    match curve.kind:
        case "sum":
            return {"color": INK, "linewidth": 2.4}
        case "torque":
            return {
                "color": colour(curve.number),
                "linewidth": 1.4,
                "linestyle": dash(curve.number),
            }
        case "torques":
            return {"color": BROWN, "linewidth": 1.0}
        case "load":
            return {"color": colour(joints + curve.number), "linewidth": 1.4, "linestyle": "dashdot"}
    style = {"gravity": "solid", "velocity": "dashed", "passive": "dotted", "contact": "dashdot"}[curve.kind]
    return {"color": GRAVITY, "linewidth": 1.4, "linestyle": style}
