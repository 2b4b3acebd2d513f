"""Figure of each joint's power over time, and below it the work given to each link and taken back."""

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.bands import Bands, draw_band
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
from linkwise.analysis.whole_movement import Work
from linkwise.arrays import Array
from linkwise.escape import listed
from linkwise.plotstyle import INK, colour, dash, drawn, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST, LINKS = 7, 10
"""Joints with a curve in colour, and links and loads with a part of their own; all others are grey."""
REST = "#B4BAC4"
NOTHING = 1e-9
"""Part of the largest joint's work below which work is only rounding."""
MANY = 12
"""Number of joints above which rows stand closer."""


def power(result: AnalysisResult, _: int) -> "Figure":
    """Draw curves of P_i = τ_i q̇_i in W, and bars of joints' and contacts' work on links and loads in J."""
    robot = result.robot
    joints = [drawn(robot.figure_joints[i]) for i in robot.moving_itself]
    ground = () if robot.contacts is None else robot.contacts.names
    givers = [*joints, *(drawn(f"ground at {name}") for name in ground)]
    height = 0.9 + (0.34 if len(givers) <= MANY else 0.26) * len(givers)
    figure = new_figure(3.4 + height)
    curves, bars = figure.subplots(2, 1, height_ratios=(2.4, height))
    bands = _curves(curves, result, joints)
    targets = [drawn(name) for name in (*robot.plot_links, *result.load_labels)]
    _bars(bars, _every_work(result, list(robot.moving_itself)), targets)
    into = "links and loads" if result.loads else "links"
    bars.set_title(f"Work: taken back out of {into}, and given to them")
    bars.set_yticks(range(len(givers)), givers)
    bars.set_ylim(len(givers) - 0.4, -0.6)
    bars.set_xlabel("J")
    bars.grid(axis="y", visible=False)
    _legend(bars, "link or load" if result.loads else "link")
    write_title(figure, result)
    still = [drawn(robot.figure_joints[i]) for i in robot.driven if i not in robot.moving_itself]
    left_out = [f"Left out, as nothing drives these: {listed(still)}."] if still else []
    write_note(figure, *left_out, *bands.notes, foot(result))
    return figure


def _curves(panel: Any, result: AnalysisResult, joints: list[str]) -> Bands:
    """Draw the joints that give and take most in colour, with bands, and the others thin and grey behind.

    Returns the bands.
    """
    driven, work = list(result.robot.moving_itself), result.joint_work
    named, rest = largest_few((work.given + work.taken)[driven], MOST)
    found = drawn_curves(result, lambda part: part.joint_power.T[driven])
    bands = Bands(result, [result.rows.numbers("power", joint=driven[i]) for i in named])
    for at, i in enumerate(named):
        panel.plot(found.time[i], found.values[i], label=joints[i], color=colour(at), linestyle=dash(at))
        draw_band(panel, bands[at], colour(at))
    for at, i in enumerate(rest):
        label = f"{len(rest)} others" if at == 0 else None
        panel.plot(found.time[i], found.values[i], label=label, color=REST, linewidth=0.7, zorder=1.5)
    zero_line(panel)
    own = result.robot.structure.passive
    panel.set_title("Power of each joint, its springs and friction too" if own else "Power of each joint")
    panel.set_ylabel("W")
    time_axis(panel, result)
    _legend(panel, "joint")
    return bands


def _every_work(result: AnalysisResult, driven: list[int]) -> Work:
    """Return the work of each joint, then of each contact as it slips, into each link and load, and back."""
    found = []
    for side in ("given", "taken"):
        links, loads, fed = (
            getattr(work, side) for work in (result.work, result.load_work, result.contact_work)
        )
        joints = np.concatenate([links, loads], axis=1)[driven]
        found.append(np.concatenate([joints, np.pad(fed.T, ((0, 0), (0, loads.shape[1])))]))
    return Work(*found)


def _bars(axis: Any, work: Work, targets: list[str]) -> None:
    """Draw work stacked from zero outwards, by link and load, with a mark at the net work of each joint."""
    at = range(len(work.given))
    named, rest = largest_few(_prominence(work.given + work.taken), LINKS)
    parts = [(targets[j], tone(place), [j]) for place, j in enumerate(named)]
    if rest:
        parts.append((f"{len(rest)} others", REST, rest))
    for side in (work.given, -work.taken):
        starts: Array = np.zeros(len(work.given))
        for name, fill, members in parts:
            label = name if side is work.given else None
            width = side[:, members].sum(axis=1)
            axis.barh(
                at, width, left=starts, height=0.64, label=label, color=fill, edgecolor="white", linewidth=0.6
            )
            starts = starts + width
    axis.plot(work.net.sum(axis=1), at, "D", color=INK, markersize=5, markeredgecolor="white", label="net")
    axis.axvline(0, color=INK, linewidth=0.8)


def _prominence(sizes: Array) -> Array:
    """Return the sum, over all joints, of each link's and load's share in the joint's work.

    Ranked by it, a few names say something about every joint.
    """
    wholes = sizes.sum(axis=1, keepdims=True)
    least = NOTHING * wholes.max(initial=0.0)
    found: Array = np.divide(sizes, wholes, out=np.zeros_like(sizes), where=wholes > least).sum(axis=0)
    return found


def _legend(axis: Any, title: str) -> None:
    axis.legend(title=title, loc="upper left", bbox_to_anchor=(1.01, 1), fontsize=8, handlelength=2)
