"""Figure of the flow of energy over a movement: which segment has it when, and through which joint it came.

Each segment has a lane in which its energy rises and falls. Arrows between the lanes are the power that flows
through the joints: as wide as the power, grey as far as it is passed on, and in the joint's own colour as far
as the joint gives or takes it. Bars beside the lanes say which cause gave each segment its energy.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.drawn_curves import (
    drawn_curves,
    foot,
    largest_few,
    new_figure,
    time_axis,
    write_note,
    write_title,
)
from linkwise.analysis.show.energy_segments import (
    HANDED_ON,
    LOST,
    Segment,
    SegmentFlows,
    SegmentWork,
    energies,
    joints_label,
    segment_flows,
    segments_of,
    work_of_segments,
)
from linkwise.arrays import Array
from linkwise.extras import extra
from linkwise.plotstyle import BROWN, GRAVITY, INK, drawn, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 7
"""Segments with a lane; those with less energy flowing are left out."""
SPANS = 24
"""Arrows at a joint over the movement."""
GAP, TALLEST, TIP = 0.85, 0.95, 0.2
"""Heights of the room for arrows between lanes, which are 1 high, of the largest energy, and of a tip."""
WIDEST = 0.9
"""Width of the largest arrow in its span."""
PASSED, REST, AREA, EDGE = "#B4BAC4", "#DDE1E6", "#F3E3C3", "#8C6D31"
ROUNDED = 1e-3
"""Part of the largest work below which the work of loads is not told."""
NOTHING = 1e-9
"""Part of the largest work below which a work is only rounding."""


@dataclass(frozen=True, eq=False)
class Lanes:
    """Segments that are drawn, each in a lane, from the top."""

    every: tuple[Segment, ...]
    shown: tuple[int, ...]
    """Index of the segments with a lane."""
    names: tuple[str, ...]
    """Names of all segments."""
    joints: tuple[str, ...]
    """Names of their joints; empty without any."""

    @classmethod
    def of(cls, result: AnalysisResult, every: tuple[Segment, ...], sizes: Array) -> "Lanes":
        """Return the lanes of the segments with the largest sizes."""
        robot = result.robot
        names = tuple(drawn(" + ".join(robot.plot_links[j] for j in one.links)) for one in every)
        joints = tuple(drawn(joints_label(robot, one)) if one.joints else "" for one in every)
        return cls(every, tuple(largest_few(sizes, MOST)[0]), names, joints)

    @property
    def is_jointed(self) -> bool:
        """True if flows between segments are known."""
        return any(self.joints)

    @property
    def bases(self) -> list[float]:
        """Heights of the lanes' ground lines."""
        return [-lane * (1.0 + (GAP if self.is_jointed else 0.1)) for lane in range(len(self.shown))]

    def carrier(self, segment: int) -> str:
        """Return the name of what carries a segment."""
        carrier = self.every[segment].carrier
        return "the ground" if carrier is None else self.names[carrier]

    def colour(self, segment: int) -> str:
        """Return the colour of a shown segment's joints."""
        return tone(self.shown.index(segment))

    def causes(self, work: SegmentWork) -> list[tuple[str, str, Array]]:
        """Return label, colour and work of each cause, torques of segments that are not shown as one."""
        found = []
        hidden = [at for at in work.torques if at not in self.shown]
        for at in self.shown:
            if at in work.torques:
                found.append((f"torque of {self.joints[at]}", self.colour(at), work.torques[at]))
        if hidden:
            rest = np.sum([work.torques[at] for at in hidden], axis=0)
            found.append((f"torques of {len(hidden)} others", REST, rest))
        own = {"gravity": GRAVITY, HANDED_ON: PASSED, LOST: BROWN}
        for number, (label, one) in enumerate(work.others.items(), len(found)):
            found.append((label, own.get(label, tone(number)), one))
        most = max(float(abs(one).max(initial=0.0)) for *_, one in found)
        return [cause for cause in found if float(abs(cause[2]).max(initial=0.0)) > NOTHING * most]


def energy(result: AnalysisResult, phase: int) -> "Figure":
    """Draw lanes of energy in J with flows between them in W, and bars of work by cause in J.

    phase: 0 for work over the whole movement, else the number of a phase, from 1
    """
    every = segments_of(result.robot)
    work = work_of_segments(result, every, phase)
    lanes = Lanes.of(result, every, work.size)
    figure = new_figure(10.4, 2.3 + (1.3 if lanes.is_jointed else 0.8) * len(lanes.shown))
    grid = figure.add_gridspec(2, 2, height_ratios=(len(lanes.shown), 0.36), width_ratios=(2.4, 1))
    left = figure.add_subplot(grid[0, 0])
    right = figure.add_subplot(grid[0, 1], sharey=left)
    _energies(left, result, lanes)
    flows = segment_flows(result, every, SPANS)
    widest = _flows(left, flows, lanes)
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
    write_note(figure, *_notes(lanes, flows, widest), foot(result))
    return figure


def _notes(lanes: Lanes, flows: SegmentFlows, widest: float) -> list[str]:
    told = ["lanes: kinetic and potential energy above its least, all by one scale"]
    if widest:
        step = flows.time[1] - flows.time[0]
        told.append(f"arrows: mean power over {step:.3g} s, of which the widest is {widest:.3g} W")
    left_out = len(lanes.every) - len(lanes.shown)
    if left_out:
        told.append(f"{left_out} segments that less work was done on are left out")
    return [" · ".join(told)]


def _energies(panel: Any, result: AnalysisResult, lanes: Lanes) -> None:
    """Draw each segment's energy above its least, all by one scale, and mark the largest."""
    found = drawn_curves(result, lambda part: energies(part, lanes.every)[list(lanes.shown)])
    above = found.values - found.values.min(axis=1, keepdims=True)
    scale = TALLEST / max(float(above.max(initial=0.0)), 1e-300)
    for base, time, values in zip(lanes.bases, found.time, above, strict=True):
        panel.fill_between(time, base, base + scale * values, color=AREA, linewidth=0, zorder=1)
        panel.plot(time, base + scale * values, color=EDGE, linewidth=1.3, zorder=2)
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


def _flows(panel: Any, flows: SegmentFlows, lanes: Lanes) -> float:
    """Draw arrows between lanes; return the largest power in W, 0 without flows."""
    shown = list(lanes.shown)
    widest = float(np.abs([flows.out[shown], flows.into[shown]]).max(initial=0.0))
    if not widest:
        return 0.0
    scale = WIDEST * (flows.time[1] - flows.time[0]) / widest
    for base, at in zip(lanes.bases, shown, strict=True):
        if lanes.every[at].joints:
            ends = base + 1.0 + GAP, base + 1.0
            for x, out, into in zip(flows.time.tolist(), flows.out[at], flows.into[at], strict=True):
                _arrow(panel, x, ends, (scale * float(out), scale * float(into)), lanes.colour(at))
    return widest


def _arrow(panel: Any, x: float, ends: tuple[float, float], power: tuple[float, float], own: str) -> None:
    """Draw the flow at a joint: above what the carrier gives, below what the segment gets, down if positive.

    As far as both are the same it is passed on; the rest the joint gives, in its colour, or takes, hatched.
    """
    out, into = power
    passed = min(abs(out), abs(into)) if out * into > 0.0 else 0.0
    middle = (ends[0] + ends[1]) / 2
    hatch = None if into > out else "/////"
    for size, end, leaves in ((abs(out), ends[0], out < 0.0), (abs(into), ends[1], into > 0.0)):
        start, stop = (middle, end) if leaves else (end, middle)
        pointed = leaves or not passed
        if size > passed:
            corners = _bar(x, size, start, stop, pointed)
            face = own if hatch is None else "white"
            panel.fill(*corners.T, facecolor=face, edgecolor=own, hatch=hatch, linewidth=0, zorder=3)
        if passed:
            panel.fill(*_bar(x, passed, start, stop, pointed).T, color=PASSED, linewidth=0, zorder=4)


def _bar(x: float, width: float, start: float, end: float, pointed: bool) -> Array:
    """Return the corners of a bar from one height to another, where it may end in a point."""
    left, right = x - width / 2, x + width / 2
    neck = end + np.sign(start - end) * TIP * pointed
    return np.array([(left, start), (right, start), (right, neck), (x, end), (left, neck)])


def _name_lanes(panel: Any, lanes: Lanes) -> None:
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


def _bars(panel: Any, work: SegmentWork, lanes: Lanes) -> None:
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


def _passed(work: SegmentWork, lanes: Lanes, at: int, most: float) -> str:
    """Return what flowed into a segment, in words."""
    out, own = float(work.out[at]), float(work.into[at] - work.out[at])
    told = []
    if abs(out) > NOTHING * most:
        way = "from" if out > 0.0 else "to"
        told.append(f"{abs(out):.3g} J {way} {lanes.carrier(at)}")
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
