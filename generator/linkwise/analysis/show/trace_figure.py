"""Panels of what velocities ask of a joint, and of its own velocity, by the sources that these came from."""

from dataclasses import replace
from typing import Any

from linkwise_runtime.motion.trace_equations import BETWEEN, LOAD, RESIDUAL, SHARE, START, TORQUE

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_rows import OVER_TIME
from linkwise.analysis.show.sourced_panels import SourceCurve, SourcedPanels, largest_alone
from linkwise.analysis.traced_rows import CONTACT
from linkwise.arrays import Index

MOST = 7
"""Sources that have curves of their own; all others are summed in one."""
PASSIVE = ("spring", "damping", "friction")


def trace_panels(result: AnalysisResult, number: int) -> SourcedPanels:
    """Return panels for what velocities ask of a joint that was asked for, and for its own velocity."""
    assert result.traced is not None
    joint = result.robot.joints.index(result.traced["joints"][number])
    name, unit = result.robot.figure_joints[joint], result.robot.units[joint]
    torques = result.rows.numbers("tau_from", joint=joint)
    weight = ""
    if result.traced["weight"] == "borne":
        weight = "; torques are what is beyond what holds the weight"
    panels = [("its velocity", unit + OVER_TIME["velocity"])]
    quantities: list[tuple[str, dict[str, Any]]] = [("qd_from", {"joint": joint})]
    if len(torques):
        panels.insert(0, ("asked by velocities", result.robot.torque_units[joint]))
        quantities.insert(0, ("tau_from", {"joint": joint}))
    return SourcedPanels(
        f"What velocities ask of {name}, by origin",
        panels,
        _sources(result, joint, quantities),
        (f"parts of velocities that one source gave since the start, in joint coordinates{weight}",),
    )


def _sources(
    result: AnalysisResult, joint: int, quantities: list[tuple[str, dict[str, Any]]]
) -> list[SourceCurve]:
    """Return the sum, and the sources with the largest mean magnitudes."""
    assert result.traced is not None
    windows, count = result.traced["windows"], len(result.rows.axes["origin"].names)

    def rows(*which: int) -> tuple[Index, ...]:
        return tuple(result.rows.numbers(name, **at, origin=list(which)) for name, at in quantities)

    wholes = {"tau_from": "tau_qd", "qd_from": "qd"}
    whole = tuple(result.rows.numbers(wholes[name], joint=joint) for name, _ in quantities)
    every = []
    for o in range(count):
        source, w = divmod(o, len(windows))
        begin, end = windows[w]
        when = f" {begin:.6g}..{end:.6g} s" if len(windows) > 1 else ""
        named = _named(result, result.traced["sources"][source], rows(o))
        every.append(replace(named, label=named.label + when, window=w))
    alone, rest = largest_alone(result, every, MOST)
    found = [SourceCurve("sum", "all together", 0, whole), *(every[o] for o in alone)]
    if rest:
        found.append(SourceCurve("others", f"{len(rest)} other sources", 0, rows(*rest)))
    return found


def _named(result: AnalysisResult, source: str, rows: tuple[Index, ...]) -> SourceCurve:
    """Return the curve of a source, named in words."""
    robot = result.robot
    kind, _, rest = source.partition(BETWEEN)
    if kind in (TORQUE, *PASSIVE) and rest in robot.joints:
        joint = robot.joints.index(rest)
        label = f"{kind} of {robot.figure_joints[joint]}"
        if kind == TORQUE:
            return SourceCurve("joint", label, robot.driven.index(joint), rows)
        return SourceCurve("passive", label, 0, rows)
    if kind == LOAD:
        number = [load.name for load in result.loads].index(rest)
        return SourceCurve("load", result.load_labels[number], number, rows)
    if kind == CONTACT:
        return SourceCurve("contact", f"ground at {rest}", 0, rows)
    if source == START:
        return SourceCurve("start", "motion at the start", 0, rows)
    if kind == RESIDUAL:
        own = robot.joints.index(rest) + 1 if rest else 0
        label = f"residual of {robot.figure_joints[own - 1]}" if rest else "what measured torques leave"
        return SourceCurve("named", label, max(1, len(robot.share_names)) + own, rows)
    name = rest if kind == SHARE else source
    return SourceCurve("named", name, list(robot.share_names).index(name), rows)
