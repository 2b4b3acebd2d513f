"""Power of each joint over time, and below it the work that joints gave to each link and took back."""

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.work import Work
from linkwise.extras import extra
from linkwise.package.load import Array
from linkwise.plotstyle import COLOURS, INK, colour, dash, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HATCHES = ("", "////", "....")
"""For the links that share a colour."""

LEGEND = 12
"""Names that one column of a legend holds beside its axis."""


def power(result: AnalysisResult, _: int) -> "Figure":
    """Curves of P_i = τ_i q̇_i in W; bars of work in J of each joint and contact, into links and loads."""
    robot = result.robot
    joints, driven = [drawn(name) for name in robot.driven_joints], list(robot.driven)
    ground = () if robot.contacts is None else robot.contacts.names
    givers = [*joints, *(drawn(f"ground at {name}") for name in ground)]
    height = 0.9 + 0.34 * len(givers)
    figure = extra("matplotlib.figure").Figure(figsize=(8.4, 3.4 + height), layout="constrained")
    curves, bars = figure.subplots(2, 1, height_ratios=(2.4, height))
    for i, values in enumerate(result.joint_power.T[driven]):
        curves.plot(result.time, values, label=joints[i], color=colour(i), linestyle=dash(i))
    curves.axhline(0, color="#9AA3AF", linewidth=0.6, zorder=0)
    curves.set_title("Power of each joint")
    curves.set_ylabel("W")
    curves.set_xlabel("time (s)")
    curves.set_xlim(result.time[0], result.time[-1])
    _legend(curves, "joint", len(joints))
    targets = [drawn(name) for name in (*robot.links, *result.load_labels)]
    _bars(bars, _every_work(result, driven), targets)
    into = "links and loads" if result.loads else "links"
    bars.set_title(f"Work: taken back out of {into}, and given to them")
    bars.set_yticks(range(len(givers)), givers)
    bars.invert_yaxis()
    bars.set_xlabel("J")
    bars.grid(axis="y", visible=False)
    _legend(bars, "link or load" if result.loads else "link", len(targets) + 1)
    figure.suptitle(f"{drawn(robot.name, 40)} · {drawn(result.source, 50)}", x=0.01, ha="left", fontsize=11)
    made = textwrap.fill(result.provenance, 140)
    figure.supxlabel(made, x=0.01, ha="left", fontsize=7, color="#5A6270")
    return figure  # type: ignore[no-any-return]


def _every_work(result: AnalysisResult, driven: list[int]) -> Work:
    """What each joint, then each contact that slips, gave to each link, each load, and took back."""
    found = []
    for side in ("given", "taken"):
        links, loads, fed = (
            getattr(work, side) for work in (result.work, result.load_work, result.contact_work)
        )
        joints = np.concatenate([links, loads], axis=1)[driven]
        found.append(np.concatenate([joints, np.pad(fed.T, ((0, 0), (0, loads.shape[1])))]))
    return Work(*found)


def _bars(axis: Any, work: Work, targets: list[str]) -> None:
    """Stacked from zero outwards, by link and load; a mark stands at the net of each joint."""
    at = range(len(work.given))
    for side in (work.given, -work.taken):
        starts: Array = np.zeros(len(work.given))
        for j, name in enumerate(targets):
            label = name if side is work.given else None
            fill = {
                "color": colour(j),
                "hatch": HATCHES[j // len(COLOURS) % 3],
                "edgecolor": "white",
                "linewidth": 0.6,
            }
            axis.barh(at, side[:, j], left=starts, height=0.64, label=label, **fill)
            starts = starts + side[:, j]
    axis.plot(work.net.sum(axis=1), at, "D", color=INK, markersize=5, markeredgecolor="white", label="net")
    axis.axvline(0, color=INK, linewidth=0.8)


def _legend(axis: Any, title: str, names: int) -> None:
    axis.legend(
        title=title,
        loc="upper left",
        bbox_to_anchor=(1.01, 1),
        fontsize=8,
        ncols=-(-names // LEGEND),
        handlelength=2,
    )
