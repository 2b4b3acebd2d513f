"""Figure of what loads each joint over the whole movement, as stacked bars: gravity, loads, motions."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.certain_signs import DEVIATIONS
from linkwise.analysis.joint_causes import Cause, causes_of, certainty, largest_first, sizes
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.bands import ADDED
from linkwise.analysis.show.drawn_curves import LETTERS, PAGE, largest_few, new_figure, write_title
from linkwise.arrays import Array, Mask
from linkwise.escape import printable
from linkwise.extras import extra
from linkwise.plotstyle import BLUE, GRAVITY, INK, SKY, VERMILION, drawn, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MANY = 12
"""Number of joints above which a bar has the joint's own motion, the largest other one, and the rest."""
HATCHES = {"motion": "", "own": "....", "load": "xx", "named": ""}
LEANING = (
    "Net torques are of all links together: joint torques determine them.\n"
    "What goes through one link leans on how the file spreads mass over the links."
)
"""Remark on what rests on the file's masses, for rigid links."""
MOVED = "A joint's motion is its acceleration and its velocity together."
LARGEST, REST = "largest motion of another joint", "motions of all other joints, shares added"


@dataclass(frozen=True, eq=False)
class SharePart:
    """A part of every joint's bar: mean sizes of net torques (joints,), and how it looks."""

    label: str
    sizes: Array
    spreads: Array
    """Standard deviations of the sizes at most, (joints,); 0 where none is known."""
    unsure: Mask
    """True for joints on which the net torque has no certain sign, (joints,)."""
    fill: str
    hatch: str = ""
    names: tuple[str, ...] = ()
    """Name of the cause at each joint, where it differs from joint to joint."""

    def name(self, i: int) -> str:
        """Return the name of the cause at the i-th joint that is drawn."""
        return f"{self.names[i]} motion" if self.names else self.label

    def at(self, joints: Sequence[int]) -> "SharePart":
        """Return the part at these places of joints."""
        numbers = list(joints)
        arrays = {name: getattr(self, name)[numbers] for name in ("sizes", "spreads", "unsure")}
        return replace(self, **arrays, names=tuple(self.names[at] for at in numbers) if self.names else ())


@dataclass(frozen=True, eq=False)
class _Sized:
    """A cause; of its net torques on joints mean sizes, their deviations, and which signs are unsure."""

    cause: Cause
    sizes: Array
    spreads: Array
    unsure: Mask

    def part(self, fill: str, hatch: str) -> SharePart:
        return SharePart(self.cause.label, self.sizes, self.spreads, self.unsure, fill, hatch)


def share_parts(result: AnalysisResult) -> tuple[list[SharePart], list[SharePart]]:
    """Return parts for gravity, loads and joints' own torques, and parts for motions.

    Motions are grouped if there are more joints than `MANY`.
    """
    robot = result.robot
    causes = causes_of(result, robot.figure_joints, drawn)
    certain = certainty(result, causes)
    found = list(map(_Sized, causes, sizes(result, causes), certain.deviation, certain.unsure))
    moving = [one for one in found if one.cause.is_motion]
    fixed = [one for one in found if not one.cause.is_motion]
    return _fixed(result, fixed), _few(result, moving) if len(robot.driven) > MANY else _each(result, moving)


def _fixed(result: AnalysisResult, found: Sequence[_Sized]) -> list[SharePart]:
    """Return parts for gravity or shares with names, loads, and joints' own torques."""
    causes = [one.cause for one in found]
    own = [cause for cause in causes if cause.kind == "own"]
    named = [cause for cause in causes if cause.kind == "named"][1:]  # the first is grey
    tones = [*own, *(cause for cause in causes if cause.kind == "load"), *named]  # in the page's order
    small = _small_muscles(result, found)
    out = []
    for one in found:
        if one in small:
            continue
        if one.cause.kind == "named" and one.cause not in named:
            out.append(one.part(GRAVITY, ""))
        else:
            fill = tone(len(result.robot.driven) + tones.index(one.cause))
            out.append(one.part(fill, HATCHES[one.cause.kind]))
    if small:
        sizes, spreads = (sum(getattr(one, what) for one in small) for what in ("sizes", "spreads"))
        nothing = np.zeros(len(result.robot.driven), np.bool_)
        label = f"{len(small)} other muscles, added up"
        out.append(
            SharePart(label, np.asarray(sizes), np.asarray(spreads), nothing, GRAVITY, HATCHES["load"])
        )
    return out


def _small_muscles(result: AnalysisResult, found: Sequence[_Sized]) -> list[_Sized]:
    """Return the muscles but the largest, by the largest part that each is of what loads a joint."""
    muscles = [
        one for one in found if one.cause.kind == "load" and result.loads[one.cause.number or 0].is_muscle
    ]
    whole = np.sum([one.sizes for one in found], axis=0)
    whole[whole == 0.0] = 1.0
    _, small = largest_few([float((one.sizes / whole).max(initial=0.0)) for one in muscles], MUSCLES)
    return [muscles[at] for at in small]


def _each(result: AnalysisResult, found: Sequence[_Sized]) -> list[SharePart]:
    """Return a part for every motion."""
    place = {k: at for at, k in enumerate(result.robot.driven)}
    return [one.part(tone(place[one.cause.number or 0]), HATCHES[one.cause.kind]) for one in found]


def _few(result: AnalysisResult, found: Sequence[_Sized]) -> list[SharePart]:
    """Return parts for many joints: each one's own motion, the largest other one, and the sum of the rest."""
    driven, names = result.robot.driven, result.robot.figure_joints
    by, spreads, unsure = (
        np.array([getattr(one, what) for one in found]).T for what in ("sizes", "spreads", "unsure")
    )
    others = by * (1.0 - np.eye(len(driven)))
    at = np.arange(len(driven)), np.array([largest_first(own)[0] for own in others])
    first = tuple(drawn(names[driven[k]]) for k in at[1])
    rest, rest_spread = (one.sum(axis=1) - one.diagonal() - one[at] for one in (by, spreads))
    nothing = np.zeros(len(driven), np.bool_)
    return [
        SharePart("its own motion", by.diagonal(), spreads.diagonal(), unsure.diagonal(), VERMILION),
        SharePart(LARGEST, by[at], spreads[at], unsure[at], BLUE, names=first),
        SharePart(REST, rest, rest_spread, nothing, SKY),
    ]


def shares(result: AnalysisResult, _: int) -> "Figure":
    """Draw two bars for each joint, in % of mean sizes: every cause, and the movement's causes alone."""
    robot = result.robot
    order = [robot.driven.index(i) for i in robot.joints_apart]
    fixed, movement = ([part.at(order) for part in some] for some in share_parts(result))
    every = [*fixed, *movement]
    notes = _notes(result, every)
    rows = -(-len(every) // 3)
    row = 0.42 if len(movement) > 3 else 0.3
    figure = new_figure(1.1 + row * len(robot.driven) + 0.2 * rows + 0.13 * len(notes))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2, 3))
    bars = _bars(left, every)
    _bars(right, movement)
    of_own = any(part.hatch == HATCHES["own"] for part in fixed)
    kinds = [
        robot.potential,
        *(["loads"] if result.loads else []),
        *(["springs and friction"] if of_own else []),
    ]
    out = " and ".join([*([", ".join(kinds[:-1])] if kinds[1:] else []), kinds[-1]])
    told = len(robot.share_names) == 1  # several are in the legend
    left.set_title(f"everything,\n{out} too" if told else "everything")
    right.set_title(f"the movement alone,\nwithout {out}" if told else "the movement alone")
    left.set_yticks(range(len(robot.driven)), _loaded(result))
    for axis in (left, right) if len(robot.moving_itself) < len(robot.driven) else ():
        axis.axhline(len(robot.moving_itself) - 0.5, color=INK, linewidth=0.9)
    left.set_ylim(len(robot.driven) - 0.4, -0.6)
    left.set_ylabel("loaded joint")
    for part in movement:
        if part.names:
            _name_beside(right, part)
    for axis in (left, right):
        axis.set_xlabel("mean size of the net torque, % of all")
    write_title(figure, result, "What loads each joint")
    unsure = [_unsure_patch()] if any(part.unsure.any() for part in every) else []
    figure.legend(
        [*bars, *unsure],
        [*(part.label for part in every), *([UNSURE] if unsure else [])],
        loc="outside lower center",
        ncols=3,
        handlelength=2,
        fontsize=8,
        title="\n".join(notes) or None,
        title_fontsize=7,
        alignment="left",
    )
    return figure


MUSCLES = 8
"""Muscles that have parts of their own; those of all others are added up."""
UNSURE = "no certain sign"
UNSURE_HATCH = "\\\\\\\\\\\\"
WIDE = int(LETTERS * PAGE)
"""Letters of a line of notes."""
SHOWN = 8
"""Causes without a certain sign that are listed."""


def _unsure_patch() -> Any:
    return extra("matplotlib.patches").Patch(
        facecolor="white", edgecolor=INK, hatch=UNSURE_HATCH, linewidth=0.0
    )


def _loaded(result: AnalysisResult) -> list[str]:
    """Return the names of the joints that are drawn, residuals last."""
    robot = result.robot
    return [robot.named_apart(drawn(robot.figure_joints[i]), i) for i in robot.joints_apart]


def _notes(result: AnalysisResult, parts: Sequence[SharePart]) -> list[str]:
    """Return what rests on the file's masses, what whiskers are, and which causes have no certain sign."""
    some = len(result.robot.moving_itself) < len(result.robot.driven)
    apart = ["Below the line are residuals: nothing drives these."] if some else []
    found = [*apart, MOVED, *(LEANING.split("\n") if result.robot.tree is not None else [])]
    if not any(part.spreads.any() for part in parts):
        return found
    joints = _loaded(result)
    unsure = [
        f"{part.name(i)} on {joints[i]}" for part in parts for i in np.flatnonzero(part.unsure).tolist()
    ]
    told = ", ".join(unsure[:SHOWN]) + (f" and {len(unsure) - SHOWN} more" if len(unsure) > SHOWN else "")
    found += [
        f"A whisker at the end of a part is one standard deviation of its mean size, at most: {ADDED}.",
        f"No certain sign, where largest less than {DEVIATIONS:g} standard deviations: {told or 'none'}.",
        *map(printable, result.signs.lines),
    ]
    return [line for note in found for line in textwrap.wrap(note, WIDE)]


def _name_beside(axis: Any, part: SharePart) -> None:
    """Name the joint that causes the part, in every row, on the right."""
    beside = axis.twinx()
    beside.set_ylim(axis.get_ylim())
    beside.set_yticks(range(len(part.names)), part.names, color=part.fill)
    beside.set_ylabel(part.label, color=part.fill)
    beside.tick_params(length=0)
    beside.grid(False)


def _bars(axis: Any, parts: list[SharePart]) -> list[Any]:
    wholes = np.sum([part.sizes for part in parts], axis=0)
    wholes[wholes == 0.0] = 1.0
    starts = np.zeros(len(wholes))
    bars, ends = [], [100.0]
    for number, part in enumerate(parts):
        widths = 100 * part.sizes / wholes
        bar = axis.barh(
            range(len(widths)),
            widths,
            left=starts,
            height=0.64,
            color=part.fill,
            hatch=part.hatch,
            edgecolor="white",
            linewidth=0.6,
        )
        labels = [f"{width:.0f}" if width >= 8 else "" for width in widths]
        box = {"boxstyle": "round,pad=0.15", "fc": part.fill, "ec": "none"}
        for text in axis.bar_label(bar, labels, label_type="center", color="white", fontsize=8):
            if text.get_text():
                text.set_bbox(box)
        if part.unsure.any():
            _hatch(axis, part.unsure, starts, widths)
        starts = starts + widths
        bars.append(bar)
        if part.spreads.any():
            ends.append(_whiskers(axis, starts, 100 * part.spreads / wholes, number))
    axis.set_xlim(0, max(ends))
    axis.grid(False)
    return bars


def _hatch(axis: Any, unsure: Mask, starts: Array, widths: Array) -> None:
    """Hatch the bars of causes without a certain sign."""
    rows = np.flatnonzero(unsure)
    look = {"facecolor": "none", "edgecolor": INK, "hatch": UNSURE_HATCH, "linewidth": 0}
    axis.barh(rows, widths[rows], left=starts[rows], height=0.64, **look)


def _whiskers(axis: Any, ends: Array, spreads: Array, number: int) -> float:
    """Draw a deviation to either side of bars' ends, at a height of its own; return how far they reach."""
    rows = np.flatnonzero(spreads)
    heights = rows + 0.17 * (number % 3 - 1)
    axis.errorbar(ends[rows], heights, xerr=spreads[rows], fmt="none", ecolor=INK, elinewidth=0.9, capsize=2)
    return float((ends + spreads).max(initial=0.0))
