"""A result as xarray's Dataset, each quantity with names along its axes."""

from collections.abc import Iterator, Sequence
from typing import Any
from urllib.parse import unquote

import numpy as np
from linkwise_runtime.named_arrays import Part, dataset
from linkwise_runtime.robot_axes import NamedAxis, axes_of
from linkwise_runtime.version import VERSION

from linkwise.analysis.named_quantities import COLUMNS, WORKS
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_columns import Column, force_unit
from linkwise.extras import extra
from linkwise.package.load import Array

BASE = {"N·m": "rad", "N": "m"}
"""Unit of the violation of a constraint's row, by the unit of its force; no unit for a coupling."""


def named_result(result: AnalysisResult) -> Any:
    """Return the Dataset of `Analysis.to_xarray`."""
    extra("xarray")
    axes = _axes(result)
    there = {column.quantity for column in result.columns}
    names = {COLUMNS[kind].name for kind in there if kind in COLUMNS}
    parts: list[Part] = [
        (quantity, _values(result, kind, [axes[axis] for axis in quantity.axes]))
        for kind, quantity in COLUMNS.items()
        if quantity.name in names
    ]
    about = {
        "robot": result.robot.name,
        "log": result.source,
        "backend": result.robot.backend,
        "convention": result.processing.convention,
        "rate_hz": result.rate,
        "provenance": result.provenance,
        "linkwise": VERSION,
    }
    found = dataset(parts, axes, ["time"], {"time": ("time", result.time, {"units": "s"})}, about)
    return found.merge(dataset(list(_works(result)), axes, [], {}, {}))


def _works(result: AnalysisResult) -> Iterator[Part]:
    """Yield the work that was given and the work that was taken back, over the whole movement."""
    of = {"work": result.work, "joint_work": result.joint_work}
    of |= {"load_work": result.load_work} if result.loads else {}
    of |= {"contact_work": result.contact_work} if result.robot.contacts is not None else {}
    for name, work in of.items():
        for way, values in (("given", work.given), ("taken", work.taken)):
            yield WORKS[name]._replace(beside=("way", way)), values


def _axes(result: AnalysisResult) -> dict[str, NamedAxis]:
    robot = result.robot
    rows = robot.constraint_rows
    contacts = () if robot.contacts is None else robot.contacts.names
    components = {_component(column): column.unit.partition("/")[0] for column in _accelerations(result)}
    return axes_of(robot.joints, robot.units, robot.links) | {
        "load": NamedAxis("load", tuple(borne.name for borne in result.loads)),
        "constraint": NamedAxis("constraint", rows, tuple(BASE.get(force_unit(row), "") for row in rows)),
        "contact": NamedAxis("contact", contacts),
        "point": NamedAxis("point", result.induced),
        "component": NamedAxis("component", tuple(components), tuple(components.values())),
    }


def _accelerations(result: AnalysisResult) -> Sequence[Column]:
    return [column for column in result.columns if column.quantity == "acc"]


def _component(column: Column) -> str:
    """Return the name of the component that a column of an acceleration has."""
    return unquote(column.name.split("/")[2])


def _values(result: AnalysisResult, kind: str, axes: Sequence[NamedAxis]) -> Array:
    """Return a quantity's columns as one array, zeros without a column, NaN for rows that a point lacks."""
    out = np.zeros((len(result.time), *(len(axis.names) for axis in axes)))
    dimensions = [axis.dimension for axis in axes]
    if "point" in dimensions:
        rows = axes[1].names
        out[:] = np.nan
        for column in _accelerations(result):
            out[:, column.point, rows.index(_component(column))] = 0.0
    for column, values in zip(result.columns, result.values, strict=True):
        if column.quantity == kind:
            out[:, *(_place(column, axis) for axis in axes)] = values
    return out


def _place(column: Column, axis: NamedAxis) -> Any:
    """Return the position of a column along an axis."""
    match axis.dimension:
        case "joint" | "link" | "point":
            return getattr(column, axis.dimension)
        case "component":
            return axis.names.index(_component(column))
        case "load" if column.load is not None:
            return column.load
        case _:
            return column.cause
