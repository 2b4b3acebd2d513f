"""What loads one joint, by cause, in each phase of the movement: stance against swing."""

import math
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from linkwise.analysis.loads.placed_load import moving_joints
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_columns import load_unit
from linkwise.analysis.result_quantities import PASSIVE, Quantity
from linkwise.errors import LinkwiseError
from linkwise.escape import printable
from linkwise.extras import extra
from linkwise.package.load import Array
from linkwise.plotstyle import BLUE, INK, colour, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 10
"""Joints whose motion has bars of its own; of others the sum has one."""
NOTHING = 1e-9
"""Of the largest cause, below which one is but rounding."""


@dataclass(frozen=True, eq=False)
class CauseCurve:
    """What one cause asks of the joint, (S,) in its unit; a motion has acceleration and velocity in one."""

    label: str
    values: Array
    is_motion: bool = False


@dataclass(frozen=True, eq=False)
class ShownPhase:
    """A phase, and which samples (S,) are in it."""

    label: str
    on: NDArray[np.bool_]


def causes(result: AnalysisResult, i: int) -> "Figure":
    """The joint's torque over time, and bars of each cause's mean and r.m.s. in each phase."""
    phases, curves = phases_of(result, i), largest(cause_curves(result, i))
    height = (0.17 * len(phases) + 0.13) * (len(curves) + 1)
    figure = extra("matplotlib.figure").Figure(figsize=(8.4, 3.3 + height), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.3, height))
    over_time = figure.add_subplot(grid[0, :])
    means = figure.add_subplot(grid[1, 0])
    sizes = figure.add_subplot(grid[1, 1], sharey=means)
    unit = load_unit(result.robot.units[i])
    _over_time(over_time, result, i, phases)
    rows = [CauseCurve("all causes together", _torque(result, i)), *curves]
    _bars(means, rows, phases, np.mean)
    _bars(sizes, rows, phases, _rms)
    means.set_title(f"mean ({unit})")
    sizes.set_title(f"root mean square ({unit})")
    means.set_yticks(range(len(rows)), [row.label for row in rows])
    means.get_yticklabels()[0].set_fontweight("bold")
    means.invert_yaxis()
    sizes.tick_params(labelleft=False)
    over_time.legend(
        *means.get_legend_handles_labels(),
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=len(phases),
        handlelength=1.5,
        borderaxespad=0.3,
    )
    figure.suptitle(
        f"What loads {drawn(result.robot.joints[i], 40)} · {drawn(result.robot.name, 40)}"
        f" · {drawn(result.source, 50)}",
        x=0.01,
        ha="left",
        fontsize=11,
    )
    told = [phase.told for phase in _asked(result, i)] if len(phases) > 1 else []
    foot = " · ".join(["motion: acceleration and velocity together", *told, result.provenance])
    figure.supxlabel(textwrap.fill(foot, 140), x=0.01, ha="left", fontsize=7, color="#5A6270")
    return figure  # type: ignore[no-any-return]


def cause_curves(result: AnalysisResult, i: int) -> list[CauseCurve]:
    """All causes of joint i's torque: gravity, what it has of its own, loads, and each joint's motion."""

    def of(*quantities: Quantity, cause: int | None = None) -> Array:
        out = np.zeros(len(result.time))
        for column, values in zip(result.columns, result.values, strict=True):
            if column.quantity in quantities and column.joint == i and column.cause == cause:
                out += values
        return out

    robot = result.robot
    found = [CauseCurve("gravity", of("tau_gravity"))]
    found += [CauseCurve(drawn(label), of("tau_load", cause=e)) for e, label in enumerate(result.load_labels)]
    found += [CauseCurve(f"own {name.removeprefix('tau_')}", of(name)) for name in PASSIVE]
    for k in robot.driven:
        label = f"{drawn(robot.joints[k])} motion"
        found.append(CauseCurve(label, of("tau_qdd", "tau_qd", cause=k), is_motion=True))
    most = max(float(np.abs(one.values).max(initial=0.0)) for one in found)
    return [one for one in found if float(np.abs(one.values).max(initial=0.0)) > NOTHING * most]


def largest(curves: list[CauseCurve]) -> list[CauseCurve]:
    """The largest over the movement first; of many motions the small ones are one, the last."""
    order = sorted(curves, key=lambda one: -_rms(one.values))
    small = [one for one in order if one.is_motion][MOST:]
    if len(small) < 2:
        return order
    rest = CauseCurve(f"motion of {len(small)} others", np.sum([one.values for one in small], axis=0))
    return [*(one for one in order if one not in small), rest]


def phases_of(result: AnalysisResult, i: int) -> list[ShownPhase]:
    """Phases that were asked for; else while the one load or contact that joint i bears acts, and while not.

    Raises LinkwiseError for a phase that has no sample.
    """
    made = not result.phases
    contacts = np.array(
        [v for c, v in zip(result.columns, result.values, strict=True) if c.quantity == "contact"]
    )
    found = []
    for phase in _asked(result, i):
        on = phase.on(result.robot, result.time, result.q, contacts)
        found.append(ShownPhase(drawn(phase.name, 34), on))
        if phase.rest:
            found.append(ShownPhase(drawn(phase.rest, 34), ~on))
    empty = [phase.label for phase in found if not phase.on.any()]
    if empty and not made:
        raise LinkwiseError(f"--phase: {empty[0]} has no sample between {_span(result)}")
    whole = ShownPhase("the whole movement", np.ones(len(result.time), dtype=np.bool_))
    return [whole] if made and (empty or not found) else found


def _span(result: AnalysisResult) -> str:
    return f"{result.time[0]:.4g} and {result.time[-1]:.4g} s"


def _asked(result: AnalysisResult, i: int) -> tuple[PlacedPhase, ...]:
    """Phases that were given; else while the one load or contact that the joint bears acts."""
    if result.phases:
        return result.phases
    ground, tree = result.robot.contacts, result.robot.package.manifest.tree
    loads = [one for one in result.loads if i in one.seat.joints]
    held: list[int] = []
    if ground is not None and tree is not None:
        body = {frame.name: frame.body for frame in tree.frames}
        moved = [moving_joints(tree, body[str(one.frame)]) for one in ground.contacts]
        held = [number for number, joints in enumerate(moved) if i in joints]
    if len(loads) + len(held) != 1:
        return ()
    if loads:
        name = printable(f"load {loads[0].name}")
        return (PlacedPhase(f"{name} acts", f"{name} does not act", load=loads[0]),)
    assert ground is not None
    name = printable(ground.names[held[0]])
    return (PlacedPhase(f"{name} stands", f"{name} does not stand", contact=held[0]),)


def _torque(result: AnalysisResult, i: int) -> Array:
    found: Array = result.torque[:, i]
    return found


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _over_time(panel: Any, result: AnalysisResult, i: int, phases: list[ShownPhase]) -> None:
    apart = np.sum([phase.on for phase in phases], axis=0).max() == 1
    time = result.time
    edges = np.concatenate([time[:1], (time[1:] + time[:-1]) / 2, time[-1:]])
    for at, phase in enumerate(phases if len(phases) > 1 else []):
        low, high = (0.0, 1.0) if apart else (at / len(phases), (at + 1) / len(phases))
        steps = np.diff(np.concatenate([[0], phase.on.astype(int), [0]]))
        for start, end in zip(np.flatnonzero(steps > 0), np.flatnonzero(steps < 0), strict=True):
            panel.axvspan(
                edges[start], edges[end], low, high, color=colour(at), alpha=0.16, linewidth=0, zorder=0
            )
    panel.plot(result.time, _torque(result, i), color=INK, linewidth=1.6)
    panel.axhline(0, color="#9AA3AF", linewidth=0.6, zorder=0)
    panel.set_title("all causes together")
    panel.set_ylabel(load_unit(result.robot.units[i]))
    panel.set_xlabel("time (s)")
    panel.set_xlim(result.time[0], result.time[-1])


def _bars(panel: Any, rows: list[CauseCurve], phases: list[ShownPhase], number: Any) -> None:
    """A group of bars for each cause, one bar for each phase, with its number at its end."""
    thick = 0.8 / len(phases)
    numbers = [[float(number(row.values[phase.on])) for row in rows] for phase in phases]
    most = max(abs(value) for values in numbers for value in values)
    decimals = max(0, 2 - math.floor(math.log10(most))) if most > 0.0 else 0
    for at, (phase, values) in enumerate(zip(phases, numbers, strict=True)):
        places = np.arange(len(rows)) - 0.4 + (at + 0.5) * thick
        ink = colour(at) if len(phases) > 1 else BLUE
        bars = panel.barh(places, values, height=0.9 * thick, color=ink, label=phase.label)
        panel.bar_label(
            bars, [f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values], padding=2, fontsize=7
        )
    panel.axvline(0, color=INK, linewidth=0.8)
    panel.axhline(0.5, color="#9AA3AF", linewidth=0.8)
    panel.margins(x=0.14)
    panel.grid(axis="y", visible=False)
