"""Lanes of segments from the top of a figure, and arrows of power between them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.drawn_curves import largest_few
from linkwise.analysis.show.energy_segments import (
    HANDED_ON,
    LOST,
    Segment,
    SegmentFlows,
    SegmentWork,
    joints_label,
)
from linkwise.arrays import Array
from linkwise.plotstyle import BROWN, GRAVITY, drawn, tone

MOST = 7
"""Segments with a lane; those that less work is done on are left out."""
GAP, TIP = 0.85, 0.2
"""Heights of the room for arrows between lanes, which are 1 high, and of an arrow's tip."""
WIDEST = 0.9
"""Width of the largest arrow in its span."""
PASSED, REST = "#B4BAC4", "#DDE1E6"
NOTHING = 1e-9
"""Part of the largest work below which a work is only rounding."""


@dataclass(frozen=True, eq=False)
class SegmentLanes:
    """Segments that are drawn, each in a lane, from the top."""

    every: tuple[Segment, ...]
    shown: tuple[int, ...]
    """Index of the segments with a lane."""
    names: tuple[str, ...]
    """Names of all segments."""
    joints: tuple[str, ...]
    """Names of their joints; empty without any."""

    @classmethod
    def of(cls, result: AnalysisResult, every: tuple[Segment, ...], sizes: Array) -> "SegmentLanes":
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


def draw_flows(panel: Any, flows: SegmentFlows, lanes: SegmentLanes) -> float:
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
