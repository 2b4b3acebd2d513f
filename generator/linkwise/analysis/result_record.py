"""The record of an analysis: everything but the samples, as plain data."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from linkwise.analysis.closed_motion import ClosedLog
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import MEANING
from linkwise.analysis.settings import choices
from linkwise.analysis.work import Work

SCHEMA = 2
"""Version of the record's fields."""


def record(result: AnalysisResult) -> dict[str, Any]:
    """Return everything but the samples as plain data: choices, closure, columns and their totals."""
    robot = result.robot
    return {
        "schema": SCHEMA,
        "log": result.source,
        "robot": {
            "name": robot.name,
            "joints": list(robot.joints),
            "links": list(robot.links),
            "backend": robot.backend,
            "manifest_sha256": robot.manifest_sha256,
        },
        **choices(result.reading, result.processing),
        "payloads": [payload.record() for payload in robot.payloads],
        "rate_hz": result.rate,
        "samples": result.total,
        "loads": [borne.record() for borne in result.loads],
        "induced": list(result.induced),
        "phases": [phase.told for phase in result.phases],
        "closure": asdict(result.closure),
        **({} if result.closed is None else {"constraints": _constraints(result, result.closed)}),
        **({} if robot.contacts is None else {"contacts": _contacts(result)}),
        "work": _work(result),
        "ignored_columns": list(result.ignored),
        "warnings": [*result.warnings, *result.load_warnings],
        "columns": [
            {
                "name": column.name,
                "unit": column.unit,
                "meaning": MEANING[column.quantity],
                "mean_magnitude": float(mean),
                "peak_magnitude": float(peak),
            }
            for column, mean, peak in zip(result.columns, result.totals.mean, result.totals.peak, strict=True)
        ],
    }


def _constraints(result: AnalysisResult, closed: ClosedLog) -> dict[str, Any]:
    tied = result.robot.constrained
    names = () if tied is None else tied.constraints.independent
    return {"independent": list(names), **closed.record()}


def _contacts(result: AnalysisResult) -> dict[str, Any]:
    ground = result.robot.contacts
    assert ground is not None
    record = ground.record(result.robot.joints)
    for number, one in enumerate(record["held"]):
        one |= {} if result.times is None else result.times.record(number)
        one["largest_slip"] = dict(zip(("m/s", "rad/s"), result.largest_slip(number), strict=True))
    return record


def _work(result: AnalysisResult) -> dict[str, Any]:
    """Return the work in J of each joint in all, into each link that it moves, and against each load.

    Work of contacts is added where there are any.
    """
    joints, links = result.robot.joints, result.robot.links

    def entry(work: Work, *at: int) -> dict[str, float]:
        given, taken = float(work.given[at]), float(work.taken[at])
        return {"given": given, "taken_back": taken, "net": given - taken}

    borne = [(c.joint or 0, c.cause or 0) for c in result.columns if c.quantity == "power_load"]
    pairs = [(c.joint or 0, c.link or 0) for c in result.columns if c.quantity == "power_link"]
    return {
        "unit": "J",
        "of_joints": [{"joint": name, **entry(result.joint_work, i)} for i, name in enumerate(joints)],
        "into_links": [{"joint": joints[i], "link": links[j], **entry(result.work, i, j)} for i, j in pairs],
        "against_loads": [
            {"joint": joints[i], "load": result.loads[e].name, **entry(result.load_work, i, e)}
            for i, e in borne
        ],
        **_fed(result, entry),
    }


def _fed(result: AnalysisResult, entry: Callable[..., dict[str, float]]) -> dict[str, Any]:
    """Return the work of contacts that slip, where there are any."""
    ground, links = result.robot.contacts, result.robot.links
    if ground is None:
        return {}
    fed = [
        {"contact": name, "link": link, **entry(result.contact_work, j, c)}
        for c, name in enumerate(ground.names)
        for j, link in enumerate(links)
    ]
    return {"of_contacts": fed}
