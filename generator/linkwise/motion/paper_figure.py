"""The paper's Fig. 5-9 and 10-14 as five panels below one another."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from linkwise.motion.analysis import Analysis
from linkwise.motion.columns import Column, Quantity
from linkwise.motion.extras import extra
from linkwise.motion.palette import colour, dash
from linkwise.motion.summary import provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class _Panel:
    title: str
    symbol: str
    wanted: Callable[[Column], bool]


def paper(analysis: Analysis, i: int) -> "Figure":
    """Coordinates, τ_i, and for joint i: τ_ij, τp_ij(q̇_j), τp_ij(q̈_j), j's own coordinate."""
    figure = extra("matplotlib.figure").Figure(figsize=(7.6, 10.2), layout="constrained")
    panels = _panels(analysis, i)
    axes = figure.subplots(len(panels), 1, sharex=True)
    for axis, panel in zip(axes, panels, strict=True):
        _draw(axis, analysis, panel)
    axes[-1].set_xlabel("time (s)")
    axes[-1].set_xlim(analysis.time[0], analysis.time[-1])
    figure.align_ylabels(axes)
    figure.suptitle(f"{analysis.robot.name} · {analysis.source}", x=0.01, ha="left", fontsize=11)
    figure.supxlabel(provenance(analysis), x=0.01, ha="left", fontsize=7, color="#5A6270")
    return figure  # type: ignore[no-any-return]


def _panels(analysis: Analysis, i: int) -> tuple[_Panel, ...]:
    robot = analysis.robot
    units = " or ".join(dict.fromkeys(robot.units))
    loads = " or ".join(dict.fromkeys("N·m" if unit == "rad" else "N" for unit in robot.units))
    on = f"on {robot.joints[i]} ({'N·m' if robot.units[i] == 'rad' else 'N'})"
    own = own_joints(analysis)

    def own_term(quantity: Quantity) -> Callable[[Column], bool]:
        return lambda c: c.quantity == quantity and c.joint == i and c.cause == own[c.link or 0]

    number = i + 1
    return (
        _Panel(f"Joint coordinates ({units})", "$q_i$", lambda c: c.quantity == "q"),
        _Panel(f"Joint torques ({loads})", r"$\tau_i$", lambda c: c.quantity == "tau"),
        _Panel(
            f"Partial torques {on}, by link",
            rf"$\tau_{{{number}j}}$",
            lambda c: c.quantity == "tau_link" and c.joint == i,
        ),
        _Panel(
            f"Propagation torques {on}: by each link, its joint's velocity",
            rf"$\tau^p_{{{number}j}}(\dot q_j)$",
            own_term("tau_qd"),
        ),
        _Panel(
            f"Propagation torques {on}: by each link, its joint's acceleration",
            rf"$\tau^p_{{{number}j}}(\ddot q_j)$",
            own_term("tau_qdd"),
        ),
    )


def own_joints(analysis: Analysis) -> tuple[int, ...]:
    """For each link the coordinate of its own joint: the skeleton's, else the last on its path."""
    robot = analysis.robot
    known = {body.link: body.coordinate for body in robot.skeleton or ()}
    return tuple(
        known.get(
            link,
            max(
                (c.joint or 0 for c in analysis.columns if c.quantity == "tau_link" and c.link == j),
                default=0,
            ),
        )
        for j, link in enumerate(robot.links)
    )


def _draw(axis: Any, analysis: Analysis, panel: _Panel) -> None:
    robot = analysis.robot
    lines, names = [], []
    for column, values in zip(analysis.columns, analysis.values, strict=True):
        if panel.wanted(column):
            at = column.joint if column.link is None else column.link
            style = {"color": colour(at or 0), "linestyle": dash(at or 0), "linewidth": 1.5}
            lines += axis.plot(analysis.time, values, **style)
            names.append((robot.joints if column.link is None else robot.links)[at or 0])
    axis.axhline(0, color="#9AA3AF", linewidth=0.6, zorder=0)
    axis.set_title(panel.title)
    axis.set_ylabel(panel.symbol, fontsize=11, parse_math=True)
    if lines:
        axis.legend(lines, names, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
