"""`report.html`: the analysis as one file that needs no network."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from linkwise.analysis.loads.placed import model_pose
from linkwise.analysis.muscle_remainder import remainder_line
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import (
    BY_POWER,
    FORCES,
    GROUND,
    INDUCED,
    MOTION,
    REACTIONS,
    TORQUE_OF,
    TRACED,
)
from linkwise.analysis.result_rows import DEVIATION, Column, ResultRows
from linkwise.analysis.show.induced_figure import induced_panels
from linkwise.analysis.show.page_certainty import certainty_data
from linkwise.analysis.show.page_curves import (
    CurveSums,
    at_instants,
    band_data,
    curve_data,
    encoded,
    packed,
    page_pieces,
    plotly_parts,
    point_data,
    stride_for,
)
from linkwise.analysis.show.page_cutoff import cutoff_data
from linkwise.analysis.show.reaction_figure import reaction_panels
from linkwise.analysis.show.sourced_panels import SourcedPanels
from linkwise.analysis.show.trace_figure import trace_panels
from linkwise.arrays import Array
from linkwise.escape import printable, script_data
from linkwise.plotstyle import COLOURS, GRAVITY, ON_DARK
from linkwise.render import render

NUMBERS, SAMPLES = 500_000, 1500
"""Most numbers and samples on a page; longer logs are thinned, and the page says so."""

FIRM = 0.05
"""Part of the largest upright force below which a centre of pressure means nothing."""
TEMPLATE = "analysis/report.html.j2"


def report(result: AnalysisResult) -> str:
    """Return the page as HTML."""
    return render(TEMPLATE, view(result))


def view(result: AnalysisResult) -> dict[str, str]:
    """Return the template's values: a title (escaped there), the data, and plotly's script and notice."""
    return {
        "title": f"{result.robot.name} · {result.source}",
        "data": packed(page_data(result)),
        **plotly_parts(),
    }


OFF_PAGE = ("tau_before_muscles", *TORQUE_OF, *FORCES, *GROUND, *INDUCED, *BY_POWER, *REACTIONS, *TRACED)
"""Quantities that a page does not hold: power, the product of two that it holds, power by source, and those
of contacts; of what `sourced` shows it holds sums."""


def is_on_page(quantity: str) -> bool:
    """Return whether a page holds a quantity; it holds the standard deviations of those that it does."""
    return quantity.removeprefix(DEVIATION) not in OFF_PAGE


def sourced(result: AnalysisResult) -> list[SourcedPanels]:
    """Return what the page shows by sources: points that are accelerated, joints that carry, traces."""
    traced = () if result.traced is None else result.traced["joints"]
    return [
        *(induced_panels(result, point, angular=True) for point in range(len(result.induced))),
        *(reaction_panels(result, number) for number in range(len(result.reactions))),
        *(trace_panels(result, number) for number in range(len(traced))),
    ]


def numbers_on_page(rows: ResultRows, shown: Sequence[SourcedPanels] = ()) -> int:
    """Return the count of numbers per sample on a page."""
    return sum(is_on_page(name) for name, _ in rows.places) + sum(one.count for one in shown)


def page_data(result: AnalysisResult) -> str:
    """Return JSON with numbers as base64 of little-endian float64: the table's, to the last bit.

    For long movements the page has evenly spaced instants, and beside them the curves' least and greatest
    values; the numbers that it states cover all samples.

    Names are made printable, except those of columns, which are the table's. Joints that follow others are
    left out.
    """
    robot, by_source, sums = result.robot, sourced(result), CurveSums(result)
    drawn = len(sums.keys) + sum(one.count for one in by_source)
    pieces = page_pieces(drawn if result.uncertain is None else 2 * drawn)
    stride = stride_for(result.total, numbers_on_page(result.rows, by_source), NUMBERS, SAMPLES)
    instants = replace(result, values=at_instants(result, stride))
    force, pressed = _largest_forces(result)
    shown = [
        at
        for at, c in enumerate(result.columns)
        if is_on_page(c.quantity) and (c.joint is None or c.joint in robot.driven)
    ]
    data = {
        "robot": printable(robot.name),
        "log": printable(result.source),
        "provenance": " · ".join(
            filter(
                None,
                [result.provenance, result.markers.line if result.markers else "", remainder_line(result)],
            )
        ),
        "rate": result.rate,
        "samples": len(instants.time),
        "total": result.total,
        "stride": stride,
        "convention": result.processing.convention,
        "joints": _joints(result),
        "residuals": [printable(line) for line in result.residual_report.lines],
        "links": list(map(printable, robot.links)),
        "columns": [_column(result.columns[at], robot.driven) for at in shown],
        "values": encoded(instants.values[shown]),
        "curves": curve_data(result, sums, pieces, stride > 1),
        "work": _work(result),
        "largestPower": _largest_power(result),
        "colours": list(COLOURS),
        "coloursDark": list(ON_DARK),
        "potential": robot.potential,
        "rigid": robot.tree is not None,
        "named": "tau_share" if robot.is_written else "tau_gravity",
        "shares": list(map(printable, robot.share_names)),
        "unstored": robot.is_unstored,
        "gravityColour": GRAVITY,
        "bodies": _bodies(instants),
        "certain": certainty_data(result),
        "cutoff": cutoff_data(result),
        "largestForce": force,
        "loads": _loads(instants),
        "reactions": _reactions(instants, pressed),
        "sourced": [_sourced(result, one, pieces if stride > 1 else None) for one in by_source],
    }
    return script_data(data)


def _column(column: Column, driven: Sequence[int]) -> dict[str, Any]:
    """Return a column's name, unit and indices, with joints as the page counts them."""

    def place(joint: int | None) -> int | None:
        return None if joint is None or joint not in driven else driven.index(joint)

    return {
        "quantity": column.quantity,
        "name": column.name,
        "unit": column.unit,
        "i": place(column.joint),
        "j": column.link,
        "k": place(column.cause) if column.quantity.removeprefix(DEVIATION) in MOTION else column.cause,
    }


def _joints(result: AnalysisResult) -> list[dict[str, Any]]:
    """Return the joints with torques: names, names as plots show them, units, and which are residuals."""
    robot = result.robot
    return [
        {
            "name": printable(robot.joints[i]),
            "shown": printable(robot.figure_joints[i]),
            "unit": robot.units[i],
            "residual": i not in robot.moving_itself,
        }
        for i in robot.driven
    ]


def _bodies(result: AnalysisResult) -> dict[str, Any] | None:
    """Return where joints and centres of mass are at every sample shown; None for a robot without a tree."""
    tree = result.robot.tree
    if tree is None:
        return None
    origins, centres = stick_figure(result.robot, result.q)
    place = {link: j for j, link in enumerate(result.robot.links)}
    order = [
        *result.robot.driven,
        *(i for i in range(len(result.robot.joints)) if i not in result.robot.driven),
    ]
    return {
        "parents": [-1 if joint.parent is None else joint.parent for joint in tree.joints],
        "links": [place.get(joint.link, -1) for joint in tree.joints],
        "coordinates": [order.index(joint.coordinate) if joint.ratio else -1 for joint in tree.joints],
        "up": list(result.robot.up),
        "origins": encoded(origins),
        "centres": encoded(centres),
    }


def _loads(result: AnalysisResult) -> list[dict[str, str]]:
    """Return the place and the force of each load at every sample shown, (samples, 3) each, in m and N."""
    pose = model_pose(result.robot.model)
    outside = [borne for borne in result.loads if not borne.is_muscle]
    wrenches = [borne.wrenches[0].wrench(result.time, result.q, pose) for borne in outside]
    return [
        {"name": printable(borne.label), "places": encoded(at.place), "forces": encoded(at.force)}
        for borne, at in zip(outside, wrenches, strict=True)
    ]


def _largest_forces(result: AnalysisResult) -> tuple[float, Array]:
    """Return the largest force of any load or contact, and upright of each contact, in N over all samples."""
    up, ground, pose = _upright(result), result.robot.contacts, model_pose(result.robot.model)
    force, pressed = 0.0, np.zeros(0 if ground is None else len(ground.names))
    for part in result.parts() if result.loads or ground is not None else ():
        outside = [load.wrenches[0] for load in result.loads if not load.is_muscle]
        borne = [one.wrench(part.time, part.q, pose).force for one in outside]
        forces = part.contact_wrench[..., 3:]
        every = np.concatenate([*(one[:, None] for one in borne), forces], axis=1)
        force = max(force, float(np.linalg.norm(every, axis=-1).max(initial=0.0)))
        np.maximum(pressed, np.abs(forces @ up).max(axis=0, initial=0.0), out=pressed)
    return force, pressed


def _largest_power(result: AnalysisResult) -> float:
    """Return the largest power of any joint or contact into any link, or against any load, in W.

    It is the largest over all samples.
    """
    rows = result.rows.numbers("power_link", "power_load", "power_contact")
    return float(result.totals.peak[rows].max(initial=0.0))


def _upright(result: AnalysisResult) -> Array:
    up: Array = np.array(result.robot.up) / np.linalg.norm(result.robot.up)
    return up


def _reactions(result: AnalysisResult, largest: Array) -> list[dict[str, str]]:
    """Return place and force of each contact, (samples, 3) each, and its power into links, (N, samples) in W.

    The force on a held frame acts where the moment has no component along the ground. largest: the largest
    upright force of each contact, in N
    """
    ground = result.robot.contacts
    if ground is None:
        return []
    up, out = _upright(result), []
    for c, place in enumerate(ground.places(result.robot.model, result.q)):
        moment, force = result.contact_wrench[:, c, :3], result.contact_wrench[:, c, 3:]
        pressed = force @ up
        firm = np.abs(pressed) > FIRM * largest[c]
        centre = place + np.cross(up, moment) / np.where(firm, pressed, np.inf)[:, None]
        if ground.contacts[c].kind == "rolling":
            centre = place + ground.touch(c)
        powers = result.values[result.rows.numbers("power_contact", contact=c)]
        label = printable(f"ground at {ground.names[c]}")
        arrow = {"name": label, "places": encoded(centre), "forces": encoded(force)}
        out.append(arrow | {"powers": encoded(powers)})
    return out


def _sourced(result: AnalysisResult, shown: SourcedPanels, pieces: int | None) -> dict[str, Any]:
    """Return panels, and the curves of their sources, (panels, samples) each, or thinned to pieces."""
    return {
        "bands": band_data(shown.bands(result, pieces or result.total)),
        "name": printable(shown.title),
        "rows": [{"name": printable(name), "unit": unit} for name, unit in shown.panels],
        "curves": [
            {
                "kind": source.kind,
                "label": printable(source.label),
                "at": source.number,
                "window": source.window,
                "points": {"values": encoded(found.values)}
                if pieces is None
                else point_data(result, found, pieces),
            }
            for source, found in shown.curves(result, pieces or result.total)
        ],
    }


def _work(result: AnalysisResult) -> list[dict[str, float]]:
    """Return the work, in J over all samples, that each joint i gave to each link j and took back.

    The loads come after the links.
    """
    place = {i: at for at, i in enumerate(result.robot.driven)}
    links, rows = len(result.robot.links), result.rows
    out = [(len(place) + c, j, result.contact_work, (j, c)) for j, c in rows["power_contact"].at.tolist()]
    out += [(place[i], j, result.work, (i, j)) for i, j in rows["power_link"].at.tolist()]
    out += [(place[i], links + e, result.load_work, (i, e)) for i, e in rows["power_load"].at.tolist()]
    return [
        {"i": i, "j": j, "given": float(work.given[at]), "taken": float(work.taken[at])}
        for i, j, work, at in out
    ]


def stick_figure(robot: OpenedRobot, q: Array) -> tuple[Array, Array]:
    """Return where joints are, and the centre of mass of what each moves, (S, joints, 3) each, in m.

    Without mass, the latter is where the joint is.
    q: coordinates (S, n) in rad or m
    """
    tree, recursion = robot.tree, robot.recursion
    assert tree is not None
    assert recursion is not None
    coms = {link.joint: np.array(link.com) for link in tree.links}
    joints = range(len(tree.joints))
    places = recursion.places(
        [*((f, np.zeros(3)) for f in joints), *((f, coms.get(f, np.zeros(3))) for f in joints)], q
    )
    return places[:, : len(joints)], places[:, len(joints) :]
