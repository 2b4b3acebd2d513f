"""Figure of the ground's forces at each contact, by link, and the torques of the joints above it."""

import textwrap
from collections.abc import Iterable
from functools import reduce
from itertools import chain
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
    write_title,
    zero_line,
)
from linkwise.arrays import Array, Index
from linkwise.plotstyle import GRAVITY, INK, drawn, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 5
"""Links with areas of their own; all other links are summed in one."""
JOINTS = 3
"""Most joints drawn, those nearest to the contact."""
LITTLE = 0.03
"""Part of the largest force below which a component is not drawn."""
SHADE, SHARED = "#F1F3F6", "#DADFE6"
WIDTH, HEIGHT = 4.4, 1.75
PARTS = ("x", "y", "z")


def contacts(result: AnalysisResult, _: int) -> "Figure":
    """Draw a column of panels for each contact: forces, with areas by link, then joints' torques."""
    ground = result.robot.ground
    peaks, asked = _sizes(result)
    shown = _components(result, peaks)
    alone = largest_few(asked.sum(axis=(0, 1))[:-1], MOST)[0]
    joints = [_joints(result, c) for c in range(len(ground.names))]
    count = len(shown) + max(map(len, joints))
    loaded = list(dict.fromkeys(chain.from_iterable(joints)))
    places = [(c, axis) for c in range(len(joints)) for axis in shown]
    forces = [_rows_of(result, "force", *place) for place in places]
    bands = Bands(result, [*forces, *(result.rows.numbers("tau", joint=i) for i in loaded)])
    figure = new_figure(HEIGHT * count + 1.3, WIDTH * len(ground.names) + 1.4)
    panels = figure.subplots(count, len(ground.names), sharex=True, sharey="row", squeeze=False)
    for c, name in enumerate(ground.names):
        panels[0, c].set_title(drawn(name))
        for panel, axis in zip(panels[:, c], shown, strict=False):
            _draw_force(panel, result, (c, axis), alone, np.flatnonzero(asked[c, axis]).tolist())
            draw_band(panel, bands[places.index((c, axis))], INK)
        for panel, i in zip(panels[len(shown) :, c], joints[c], strict=False):
            _draw_torque(panel, result, c, i)
            draw_band(panel, bands[len(places) + loaded.index(i)], INK)
        drawn_here = len(shown) + len(joints[c])
        for panel in panels[drawn_here:, c]:
            panel.set_axis_off()
        time_axis(panels[drawn_here - 1, c], result)
        panels[drawn_here - 1, c].tick_params(labelbottom=True)
    for panel, axis in zip(panels[:, 0], shown, strict=False):
        panel.set_ylabel(f"force {PARTS[axis]} (N)")
    figure.align_ylabels(panels[:, 0])
    _legend(figure, panels.flat, " ".join([*bands.notes, foot(result)]))
    write_title(figure, result, "What the ground bears")
    return figure


def _legend(figure: Any, panels: Iterable[Any], note: str) -> None:
    """Draw one legend of all panels below the figure, with a note."""
    handles: dict[str, Any] = {}
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside lower center",
        ncols=4,
        handlelength=2,
        fontsize=8,
        title=textwrap.fill(note, round(15 * float(figure.get_figwidth()))),
        title_fontsize=7,
    )


def _forces(result: AnalysisResult) -> Array:
    """Return the contact forces due to each link, and last due to all else, (contacts, 3, N + 1, S)."""
    robot, ground = result.robot, result.robot.ground
    whole, by_link = result.dense("force"), result.dense("force_link")
    out = np.zeros((len(ground.names), len(PARTS), len(robot.links) + 1, len(result.time)))
    for row, (owner, name) in enumerate(
        zip(ground.owners, ground.rows, strict=True), robot.contact_rows.start
    ):
        part = name.rpartition("force_")[2]
        if part in PARTS:
            shares = by_link[..., row].T
            out[owner, PARTS.index(part)] = [*shares, reduce(np.subtract, shares, whole[:, row])]
    return out


def _sizes(result: AnalysisResult) -> tuple[Array, Array]:
    """Return the largest forces (contacts, 3), and magnitudes by link summed up, (contacts, 3, N + 1)."""
    ground = result.robot.ground
    shape = len(ground.names), len(PARTS)
    peaks, asked = np.zeros(shape), np.zeros((*shape, len(result.robot.links) + 1))
    for part in result.parts():
        forces = _forces(part)
        np.maximum(peaks, np.abs(forces.sum(axis=2)).max(axis=-1), out=peaks)
        asked += np.abs(forces).sum(axis=-1)
    return peaks, asked


def _components(result: AnalysisResult, peaks: Array) -> list[int]:
    """Return the axes along which the ground carries any force, the upright one first."""
    sizes = peaks.max(axis=0)
    up = int(np.abs(result.robot.up).argmax())
    order = [up, *(axis for axis in range(3) if axis != up)]
    return [axis for axis in order if sizes[axis] > LITTLE * sizes.max()] or [up]


def _joints(result: AnalysisResult, contact: int) -> list[int]:
    """Return the driven joints between the base and a contact, the nearest to the contact first."""
    robot, ground = result.robot, result.robot.ground
    assert robot.tree is not None
    path = robot.tree.chain(robot.joint_of(ground.contacts[contact].frame))
    moving = dict.fromkeys(robot.tree.joints[f].coordinate for f in reversed(path))
    return [k for k in moving if k in robot.driven and k not in ground.unactuated][:JOINTS]


def _draw_force(
    panel: Any, result: AnalysisResult, place: tuple[int, int], alone: list[int], there: list[int]
) -> None:
    """Draw a component of a contact's force.

    place: contact and axis; alone: links with areas of their own; there: links, and all else, with any force
    """
    contact, axis = place
    _shade(panel, result, contact)
    rest = [j for j in range(len(result.robot.links) + 1) if j not in alone]
    groups = [[j] for j in alone] + ([rest] if set(rest) & set(there) else [])
    looks = [(drawn(result.robot.plot_links[j]), tone(at)) for at, j in enumerate(alone)]
    looks.append(("all else", GRAVITY))

    def stacked(part: AnalysisResult) -> Array:
        parts = _forces(part)[contact, axis]
        areas = np.array([parts[members].sum(axis=0) for members in groups])
        ends = [np.cumsum(some, axis=0) for some in (np.maximum(areas, 0.0), np.minimum(areas, 0.0))]
        return np.concatenate([*ends, parts.sum(axis=0)[None]])

    found = drawn_curves(result, stacked)
    for edges in (found.greatest[: len(groups)], found.least[len(groups) : -1]):
        base = np.zeros(len(found.middle))
        for (label, ink), top in zip(looks, edges, strict=False):
            panel.fill_between(found.middle, base, top, color=ink, alpha=0.55, linewidth=0, label=label)
            base = top
    panel.plot(found.time[-1], found.values[-1], color=INK, linewidth=1.6, label="found from the motion")
    _draw_measured(panel, result, contact, axis)
    zero_line(panel)


def _draw_measured(panel: Any, result: AnalysisResult, contact: int, axis: int) -> None:
    rows = _rows_of(result, "force_measured", contact, axis)
    _draw_rows(panel, result, rows, color="#C21E56", linestyle="dashed", label="measured")


def _rows_of(result: AnalysisResult, quantity: str, contact: int, axis: int) -> Index:
    """Return the numbers of the rows of a component of a contact's force."""
    ground, first = result.robot.ground, result.robot.contact_rows.start
    rows = [
        row
        for row in dict.fromkeys(result.rows[quantity].at[:, 0].tolist())
        if row >= first
        and ground.owners[row - first] == contact
        and ground.rows[row - first].endswith(f" force_{PARTS[axis]}")
    ]
    return result.rows.numbers(quantity, constraint=rows)


def _draw_torque(panel: Any, result: AnalysisResult, contact: int, i: int) -> None:
    _shade(panel, result, contact)
    name, unit = drawn(result.robot.figure_joints[i]), result.robot.torque_units[i]
    found, measured = (result.rows.numbers(kind, joint=i) for kind in ("tau", "tau_as_loads"))
    _draw_rows(panel, result, found, color=INK, linewidth=1.6, label="found from the motion")
    _draw_rows(panel, result, measured, color="#C21E56", linestyle="dotted", label="by what was measured")
    zero_line(panel)
    panel.set_title(f"torque of {name} ({unit})", fontsize=9)


def _draw_rows(panel: Any, result: AnalysisResult, rows: Index, **look: Any) -> None:
    if len(rows):
        found = drawn_curves(result, lambda part: part.values[rows])
        panel.plot(found.time[0], found.values[0], **look)


def _shade(panel: Any, result: AnalysisResult, contact: int) -> None:
    """Shade when a contact is on, darker when another is too: how they share forces is then a choice."""
    rows = result.rows["contact"].rows

    def stands(part: AnalysisResult) -> Array:
        on = part.values[rows] > 0.0
        return np.array([on[contact], on[contact] & (on.sum(axis=0) > 1)], dtype=float)

    found = drawn_curves(result, stands)
    looks = ((SHADE, "stands"), (SHARED, "others stand too"))
    for where, (ink, label) in zip(found.greatest > 0.0, looks, strict=True):
        panel.fill_between(
            found.middle,
            0,
            1,
            where=where,
            color=ink,
            linewidth=0,
            transform=panel.get_xaxis_transform(),
            zorder=-1,
            label=label if where.any() else None,
        )
