"""Write docs/calls.md's tables from the table of calls: `make calls`."""

import sys
from collections.abc import Sequence
from pathlib import Path

from linkwise_runtime.call_table import (
    CALLS,
    CONSTRAINTS,
    DYNAMICS,
    KINEMATICS,
    MOTIONS,
    REQUIRED,
    Call,
    Quantity,
)
from linkwise_runtime.motion_quantities import Counterfactual, TracedMotion
from linkwise_runtime.named_arrays import units_of
from linkwise_runtime.quantities import Trajectory
from linkwise_runtime.robot_axes import NamedAxis, axes_of, tied_axes

PAGE = Path(__file__).parents[2] / "docs/calls.md"
MARK = "<!-- from here on by `make calls` -->\n"
GROUPS = {
    "Torques and what they are made of": ("robot", DYNAMICS),
    "What moves, and by what": ("robot", MOTIONS),
    "Frames": ("robot.kinematics", KINEMATICS),
    "Joints that are tied": ("robot.constraints", CONSTRAINTS),
}
"""Titles, and whose calls stand below."""
WORDS = {
    "independent": "independent joint",
    "independent_cause": "independent cause",
    "other_cause": "other cause",
    "moved": "what moves",
    "mover": "cause",
    "tree_joint": "joint of the tree",
    "wrench": "6",
    "kind": "4",
    "holder": "links and armatures",
    "world": "4 of the world",
    "own": "4 of the frame",
    "component": "6",
    "axis": "3",
    "parameter": "10",
    "part": "any",
    **{count: f"count of {count}" for count in ("c2", "c1", "g", "tau", "h1")},
}
"""Axes as the page names them, where their names in the table do not say enough."""
OWN = {"not": "left out", "alone": "they alone", "passive": "counted, unless `passive=False`"}
TIES = {
    "cut": "as if they were cut",
    "kept": "kept",
    "refused": "refused; call `constraints.forward_dynamics`",
}
BESIDE_IN_C = {
    "decomposition_blocks": "`packed` of blocks of samples",
    "link_1": "`packed` of one link and one sample, and so on for each link",
    "position_gradient": "`position_gradient` without its zeros",
    "passive_torque": "the sum of `passive_torque`, of one sample, where joints have any",
    "reactions": "the wrenches of links, of which `reactions` are made; not of joints that are tied",
    "share_variances": "what bodies do to shares through one link, squared, of which "
    "[`uncertainty`](package.md#how-certain-a-share-is) is made",
    "motion_variances_blocks": "what noise of the motion does to shares, their sums over links and powers, "
    "squared, of which [`uncertainty`](package.md#how-certain-a-share-is) is made too",
    "constrained_response": "of which induced accelerations and reactions of tied joints are made",
    "constrained_response_of_links": "the same with `passive=False`",
    "constrained_dynamics_of_links": "`constraints.forward_dynamics(passive=False)`",
    "simulate": "`simulate` by RK4, of many motions at once, without loads",
    "partial_impedance": "a [controller](control.md)",
    "cancel": "what a [controller](control.md) cancels at a given acceleration",
    "frame_partial_impedance": "a [controller](control.md) of a frame",
    "constrained_partial_impedance": "a [controller](control.md) of tied joints, and what ties bear then",
    "constrained_frame_partial_impedance": "a [controller](control.md) of a frame that tied joints move",
    "constrained_cancel": "what such a controller cancels at a given acceleration",
    "contacts_keep": "whether contacts that touch at one point keep within their cones of friction",
}
"""Functions of C that no row has."""

OVER_TIME = (Trajectory, TracedMotion, Counterfactual)
"""Records whose answers have instants before their samples."""


def signature(row: Call) -> str:
    """Return the call that is this row, as it is written."""
    given = [f"{name}={value!r}" if value is not REQUIRED else name for name, value in row.options.items()]
    chosen = [f"{name}={value!r}" for name, value in row.chosen.items()]
    out = ["out=None"] if row.out else []
    return f"`{row.name.rpartition('.')[2]}({', '.join([*row.motion, *given, *chosen, *out])})`"


def axes() -> dict[str, NamedAxis]:
    """Axes of a robot that has joints, and rows of constraints, of both kinds."""
    kinds = ("rad", "m")
    found = axes_of(kinds, kinds, ["link"], ["share"]) | tied_axes(kinds, kinds, kinds, kinds)
    several = ("frame", "load", "holder", "tree_joint", "origin", "window")
    unnamed = {axis: NamedAxis(axis, ()) for axis in several}
    return found | unnamed | {"mover": found["cause"]}


def unit(quantity: Quantity) -> str:
    """Return the quantity's unit, and in parentheses that of entries which are measured otherwise."""
    if not quantity.unit:
        return "as the layout says"
    units = units_of([quantity], axes() | {"moved": axes()["joint"]})[1]
    first, *others = dict.fromkeys(map(str, units.flat))
    return f"{first} ({', '.join(others)})" if others else first


def field(row: Call, at: int) -> str:
    """The name of an answer in its record; nothing of one that is alone."""
    names: tuple[str, ...] = getattr(row.record, "_fields", ("",))
    return f"`{names[at]}`: " if names[at] else ""


def shape(row: Call, quantity: Quantity) -> str:
    """Return the quantity's axes behind those of the samples; of a motion over time, instants stand before
    these."""
    axes = (WORDS.get(axis, axis) for axis in quantity.axes)
    before = ["…"] if row.record not in OVER_TIME else ["time", "…"][: 1 + (quantity.name != "time")]
    return f"({', '.join([*before, *axes])})"


def answers(row: Call) -> list[str]:
    """A line of the table for each array of an answer; the call and its function of C stand in the first."""
    c = f"`NAME_{row.c}`{', one sample' * row.one}" if row.c else ""
    firsts = [(signature(row), c), *[("", "")] * (len(row.answers) - 1)]
    return [
        f"| {call} | {field(row, at)}{one.meaning} | {shape(row, one)} | {unit(one)} | {of_c} |"
        for at, (one, (call, of_c)) in enumerate(zip(row.answers, firsts, strict=True))
    ]


def short(row: Call) -> str:
    """The call, and what is chosen of it where others are chosen too."""
    several = sum(other.name == row.name for other in CALLS.values()) > 1
    chosen = ", ".join(f"{name}={value!r}" for name, value in row.chosen.items())
    return f"`{row.name.rpartition('.')[2]}{f'({chosen})' * several}`"


def counted(rows: Sequence[Call]) -> list[str]:
    """Return what calls count, and where they are: a line for all that are alike."""
    alike: dict[str, list[str]] = {}
    for row in rows:
        links = "rigid alone" if row.rigid else "any"
        lacking = ", ".join(f"`{name}`" for name in row.lacking) or "none"
        own = "counted" if "passive" in row.chosen and row.own == "passive" else OWN[row.own]
        facts = f"{own} | {TIES[row.ties]} | {links} | {lacking}"
        alike.setdefault(facts, []).append(short(row))
    return [f"| {', '.join(calls)} | {facts} |" for facts, calls in alike.items()]


def tables() -> str:
    """Yield, for each group, what calls take and answer, and what they count."""
    lines = []
    for title, (owner, rows) in GROUPS.items():
        lines += [f"## {title}", "", f"Calls of `{owner}`:", ""]
        lines += ["| call | answer | shape | unit | in C |", "|---|---|---|---|---|"]
        lines += [line for row in rows for line in answers(row)]
        lines += ["", "| calls | springs, damping, friction, armature | ties | links | not on |"]
        lines += ["|---|---|---|---|---|", *counted(rows), ""]
    lines += ["## Functions of C beside these", "", "| function | what it has |", "|---|---|"]
    lines += [f"| `NAME_{name}` | {meaning} |" for name, meaning in BESIDE_IN_C.items()]
    return "\n".join(lines) + "\n"


def page() -> str:
    """The page as the table has it, below what is written by hand."""
    return f"{PAGE.read_text(encoding='utf-8').partition(MARK)[0]}{MARK}\n{tables()}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    sys.exit(0)
