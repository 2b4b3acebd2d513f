"""Figure of the flow of energy over a movement: which segment has it when, and through which joint it came.

Each segment has a lane in which its energy rises and falls. Arrows between the lanes are the power that flows
through the joints: as wide as the power, grey as far as it is passed on, and in the joint's own colour as far
as the joint gives or takes it. Bars beside the lanes say which cause gave each segment its energy.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.bands import Band, Bands, draw_band
from linkwise.analysis.show.drawn_curves import (
    drawn_curves,
    foot,
    new_figure,
    time_axis,
    write_note,
    write_title,
)
from linkwise.analysis.show.energy_lanes import GAP, NOTHING, PASSED, SegmentLanes, draw_flows
from linkwise.analysis.show.energy_segments import (
    SegmentFlows,
    SegmentWork,
    energies,
    segment_flows,
    segments_of,
    work_of_segments,
)
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.plotstyle import INK, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPANS = 24
"""Arrows at a joint over the movement."""
TALLEST = 0.95
"""Height of the largest energy in a lane, which is 1 high."""
AREA, EDGE = "#F3E3C3", "#8C6D31"
ROUNDED = 1e-3
"""Part of the largest work below which the work of loads is not told."""


def energy(result: AnalysisResult, phase: int) -> "Figure":
    """Draw lanes of energy in J with flows between them in W, and bars of work by cause in J.

    phase: 0 for work over the whole movement, else the number of a phase, from 1
    """
    every = segments_of(result.robot)
    work = work_of_segments(result, every, phase)
    lanes = SegmentLanes.of(result, every, work.size)
    figure = new_figure(2.3 + (1.3 if lanes.is_jointed else 0.8) * len(lanes.shown), 10.4)
    grid = figure.add_gridspec(2, 2, height_ratios=(len(lanes.shown), 0.36), width_ratios=(2.4, 1))
    left = figure.add_subplot(grid[0, 0])
    right = figure.add_subplot(grid[0, 1], sharey=left)
    bands = _energies(left, result, lanes)
    flows = segment_flows(result, every, SPANS)
    widest = draw_flows(left, flows, lanes)
    _name_lanes(left, lanes)
    time_axis(left, result)
    if phase:
        _shade(left, result, phase)
    _bars(right, work, lanes)
    flowing = ", and the power that flows between them" if lanes.is_jointed else ""
    left.set_title(f"Energy of each segment{flowing}")
    right.set_title("Work on each segment")
    span = drawn(result.phases[phase - 1].name, 34) if phase else "the whole movement"
    right.set_xlabel(f"J, over {span}")
    _legend(figure.add_subplot(grid[1, :]), right, bool(widest))
    write_title(figure, result, "How energy flows")
    tied = result.robot.constrained is not None
    residuals = [drawn(result.robot.figure_joints[i]) for i in sorted(result.robot.residuals_apart)]
    write_note(figure, _note(lanes, flows, widest, tied, residuals), *bands.notes, foot(result))
    return figure


def _note(lanes: SegmentLanes, flows: SegmentFlows, widest: float, tied: bool, residuals: list[str]) -> str:
    told = ["lanes: kinetic and potential energy above its least, all by one scale"]
    if widest:
        step = flows.time[1] - flows.time[0]
        told.append(f"arrows: mean power over {step:.3g} s, of which the widest is {widest:.3g} W")
    left_out = len(lanes.every) - len(lanes.shown)
    if left_out:
        told.append(f"{left_out} segments that less work was done on are left out")
    if residuals:
        told.append(f"residuals: {listed(residuals)}, which nothing drives")
    if tied:
        told.append("what ties carry to a segment counts as if it came through its joints")
    return " · ".join(told)


def _energies(panel: Any, result: AnalysisResult, lanes: SegmentLanes) -> Bands:
    """Draw each segment's energy above its least, by one scale, and mark the largest; return the bands."""
    found = drawn_curves(result, lambda part: energies(part, lanes.every)[list(lanes.shown)])
    above = found.values - found.values.min(axis=1, keepdims=True)
    scale = TALLEST / max(float(above.max(initial=0.0)), 1e-300)
    least = found.values.min(axis=1)
    rows = ("energy_kinetic", "energy_potential")
    bands = Bands(result, [result.rows.numbers(*rows, link=lanes.every[at].links) for at in lanes.shown])
    for number, (base, time, values) in enumerate(zip(lanes.bases, found.time, above, strict=True)):
        panel.fill_between(time, base, base + scale * values, color=AREA, linewidth=0, zorder=1)
        panel.plot(time, base + scale * values, color=EDGE, linewidth=1.3, zorder=2)
        if band := bands[number]:
            edges = (base + scale * (edge - least[number]) for edge in band[1:])
            draw_band(panel, Band(band.time, *edges), EDGE)
        panel.plot(time[[0, -1]], [base, base], color=INK, linewidth=0.7, zorder=2)
        top = int(values.argmax())
        if not values[top] > NOTHING * above.max():
            continue
        x, y = float(time[top]), base + scale * float(values[top])
        panel.plot(x, y, "o", color=EDGE, markersize=4, zorder=5)
        late = x > time[0] + 0.75 * (time[-1] - time[0])
        panel.annotate(
            f"{values[top]:.3g} J at {x:.3g} s",
            (x, y),
            (-8 if late else 8, 0),
            textcoords="offset points",
            ha="right" if late else "left",
            va="center" if y > base + 0.5 else "bottom",
            fontsize=8,
            color=EDGE,
            zorder=6,
            path_effects=[extra("matplotlib.patheffects").withStroke(linewidth=2, foreground="white")],
        )
    return bands


def _name_lanes(panel: Any, lanes: SegmentLanes) -> None:
    """Write the segments beside their lanes, and the joints beside the arrows."""
    names = [lanes.names[at] for at in lanes.shown]
    panel.set_yticks([base + 0.3 for base in lanes.bases], names, fontweight="bold", fontsize=10)
    panel.tick_params(axis="y", length=0)
    panel.set_ylim(lanes.bases[-1] - 0.06, lanes.bases[0] + 1.0 + (GAP + 0.05) * lanes.is_jointed)
    panel.spines["left"].set_visible(False)
    panel.grid(False)
    for base, above, at in zip(lanes.bases, (None, *lanes.shown), lanes.shown, strict=False):
        if lanes.every[at].joints:
            aside = lanes.every[at].carrier != above
            panel.annotate(
                f"through {lanes.joints[at]}" + f"\nfrom {lanes.carrier(at)}" * aside,
                (0, base + 1.0 + GAP / 2),
                (-4, 0),
                xycoords=panel.get_yaxis_transform(),
                textcoords="offset points",
                ha="right",
                va="center",
                fontsize=8,
                color=lanes.colour(at),
            )


def _shade(panel: Any, result: AnalysisResult, phase: int) -> None:
    """Shade the times at which a phase is on."""
    asked = result.phases[phase - 1]
    parts = (
        (p.time, asked.on(p.robot, p.time, p.q, p.values[p.rows["contact"].rows])) for p in result.parts()
    )
    times, on = (np.concatenate(some) for some in zip(*parts, strict=True))
    panel.fill_between(
        times, 0, 1, where=on, transform=panel.get_xaxis_transform(), color="#EEF3FA", linewidth=0, zorder=0
    )


def _bars(panel: Any, work: SegmentWork, lanes: SegmentLanes) -> None:
    """Draw the work of each cause on each segment, stacked from zero outwards, and a mark at the sum."""
    shown = list(lanes.shown)
    most = float(work.size.max(initial=0.0))
    begun = np.zeros((2, len(shown)))
    middles = np.array(lanes.bases) + 0.3
    for label, fill, every in lanes.causes(work):
        for side in (0, 1):
            part = np.maximum(every[shown], 0.0) if side == 0 else np.minimum(every[shown], 0.0)
            name = drawn(label, 40) if side == 0 else None
            panel.barh(
                middles, part, 0.56, begun[side], color=fill, edgecolor="white", linewidth=0.6, label=name
            )
            begun[side] += part
    look = {"color": INK, "markersize": 5, "markeredgecolor": "white"}
    panel.plot(work.whole[shown], middles, "D", label="in all: gain of energy", **look)
    panel.axvline(0, color=INK, linewidth=0.8)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0, labelleft=False)
    panel.spines["left"].set_visible(False)
    for base, at in zip(lanes.bases, shown, strict=True):
        if lanes.every[at].joints:
            panel.annotate(
                _passed(work, lanes, at, most),
                (0.5, base + 0.72),
                xycoords=panel.get_yaxis_transform(),
                ha="center",
                va="bottom",
                fontsize=8,
                bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none"},
            )


def _passed(work: SegmentWork, lanes: SegmentLanes, at: int, most: float) -> str:
    """Return what flowed into a segment, in words."""
    out, own = float(work.out[at]), float(work.into[at] - work.out[at])
    told = []
    if abs(out) > NOTHING * most:
        way = "from" if out > 0.0 else "to"
        there = "ties" if lanes.every[at].carrier is None else lanes.carrier(at)  # the ground rests
        told.append(f"{abs(out):.3g} J {way} {there}")
    if abs(own) > NOTHING * most:
        told.append(f"{abs(own):.3g} J {'given' if own > 0.0 else 'taken'} by {lanes.joints[at]}")
    behind = sum(work.out[k] for k, one in enumerate(lanes.every) if one.carrier == at)
    outside = float(work.whole[at] - work.into[at] + behind)
    if abs(outside) > ROUNDED * most:
        told.append(f"{abs(outside):.3g} J {'from' if outside > 0.0 else 'to'} loads, ties or contacts")
    return "\n".join(told)


def _legend(panel: Any, bars: Any, has_flow: bool) -> None:
    """Write what colours mean, below both panels: of arrows, then of bars."""
    patch = extra("matplotlib.patches").Patch
    arrows = [
        patch(color=PASSED, label="arrows: passed on"),
        patch(color=INK, label="arrows, in a joint's colour: the joint gives"),
        patch(facecolor="white", edgecolor=INK, hatch="/////", label="arrows, hatched: the joint takes"),
    ]
    handles, _ = bars.get_legend_handles_labels()
    panel.axis("off")
    panel.legend(
        handles=[*(arrows if has_flow else []), *handles], loc="center", ncols=4, fontsize=8, handlelength=1.6
    )
