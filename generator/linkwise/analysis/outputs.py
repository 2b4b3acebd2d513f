"""A result as others read it: Parquet or CSV, the record, xarray's Dataset, the table of a notebook."""

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

import numpy as np
from linkwise_runtime.html_tables import page_part, remark, table
from linkwise_runtime.named_arrays import Part, dataset
from linkwise_runtime.version import VERSION

from linkwise.analysis.closed_motion import ClosedLog
from linkwise.analysis.joint_causes import causes_of, largest_first, sizes
from linkwise.analysis.muscle_remainder import remainder_record
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import POWER_OF, QUANTITIES, WORKS, ResultQuantity
from linkwise.analysis.result_rows import Column
from linkwise.analysis.settings import choices
from linkwise.analysis.verify import SAMPLES
from linkwise.analysis.whole_movement import Work
from linkwise.arrays import Array
from linkwise.extras import extra

Format = Literal["parquet", "csv", "none"]


@contextmanager
def open_table(path: Path, columns: Sequence[Column], note: str) -> Iterator[Callable[[Array], None]]:
    """Open `path`, .parquet or .csv, and give the function that writes a block (columns, samples) to it.

    Nothing is written to a path that ends in .none.

    note: JSON that is kept in a Parquet file's schema
    """
    if path.suffix == ".none":
        yield lambda block: None
        return
    if path.suffix == ".csv":
        with path.open("w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(column.name for column in columns)
            yield lambda block: rows.writerows(block.T.tolist())  # numbers that read back exactly
        return
    arrow = extra("pyarrow")
    fields = [arrow.field(c.name, arrow.float64(), False, _metadata(c)) for c in columns]
    schema = arrow.schema(fields, {"linkwise": note})

    def write(block: Array) -> None:
        batch = arrow.record_batch(list(map(arrow.array, block)), schema=schema)
        writer.write_batch(batch, row_group_size=block.shape[1])

    # Torques hardly repeat, so that a dictionary would only cost time; long rests do compress.
    how = {"compression": "snappy", "use_dictionary": False, "write_statistics": False}
    with extra("pyarrow.parquet").ParquetWriter(path, schema, **how) as writer:
        yield write


def _metadata(column: Column) -> dict[str, str]:
    indices = ("joint", "link", "cause", "point", "row", "holder", "origin")
    found = {name: getattr(column, name) for name in indices}
    return {
        "unit": column.unit,
        "meaning": QUANTITIES[column.quantity].meaning,
        **{name: str(at) for name, at in found.items() if at is not None},
    }


SCHEMA = 2
"""Version of the record's fields."""
CLOSED_AT_FEW = f"{SAMPLES} samples of each block, all terms computed there"
"""Samples at which sums close, where columns that were not asked for are computed of these alone."""


def closed_at(result: AnalysisResult) -> str:
    """Return the samples at which sums close, in words."""
    if not result.rows.left_out:
        return "every sample"
    apart = "" if result.closure.nets_relative is None else "; net torques by cause of every sample"
    return f"{CLOSED_AT_FEW}{apart}"


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
        **({"left_by_muscles": remainder_record(result)} if "tau_before_muscles" in result.rows else {}),
        **({} if result.markers is None else {"markers": result.markers.record()}),
        "induced": list(result.induced),
        "reactions": list(result.reactions),
        "phases": [phase.told for phase in result.phases],
        **({} if result.traced is None else {"trace": dict(result.traced)}),
        **({} if result.uncertain is None else {"uncertain": {**result.uncertain, **result.signs.record()}}),
        **({} if result.cutoff_sweep is None else {"cutoff_sweep": result.cutoff_sweep.record()}),
        "asked_columns": list(result.asked_columns),
        "closure": asdict(result.closure),
        "closure_is_of": closed_at(result),
        **({} if result.closed is None else {"constraints": _constraints(result, result.closed)}),
        **({} if robot.contacts is None else {"contacts": _contacts(result)}),
        **({"residuals": result.residual_report.record()} if result.residual_report.residuals else {}),
        "work": _work(result),
        "ignored_columns": list(result.ignored),
        "warnings": [*result.warnings, *result.load_warnings],
        "columns": [_told_column(result, row) for row in result.told.tolist()],
    }


def _told_column(result: AnalysisResult, row: int) -> dict[str, Any]:
    column = result.columns[row]
    return {
        "name": column.name,
        "unit": column.unit,
        "meaning": QUANTITIES[column.quantity].meaning,
        "mean_magnitude": float(result.totals.mean[row]),
        "peak_magnitude": float(result.totals.peak[row]),
    }


def _constraints(result: AnalysisResult, closed: ClosedLog) -> dict[str, Any]:
    tied = result.robot.constrained
    names = () if tied is None else tied.constraints.independent
    return {"independent": list(names), **closed.record()}


def _contacts(result: AnalysisResult) -> dict[str, Any]:
    record = result.robot.ground.record(result.robot.joints)
    for number, one in enumerate(record["held"]):
        one |= {} if result.times is None else result.times.record(number)
        one["largest_slip"] = dict(zip(("m/s", "rad/s"), result.largest_slip(number), strict=True))
    return record


WORK_KEYS = {
    "joint_work": "of_joints",
    "work": "into_links",
    "load_work": "against_loads",
    "contact_work": "of_contacts",
}


def _work(result: AnalysisResult) -> dict[str, Any]:
    """Return the work in J of each joint in all, into each link that it moves, and against each load.

    Work of contacts is added where there are any, and that by source where it was asked for. Phases that were
    asked for have the same each.
    """
    found = {"unit": "J", **_work_of(result, {**result.works, **result.work_by_source})}
    if result.phases:
        in_phases = zip(result.phases, result.work_in_phases, strict=True)
        found["in_phases"] = [{"phase": phase.told, **_work_of(result, works)} for phase, works in in_phases]
    return found


def _work_of(result: AnalysisResult, works: Mapping[str, Work]) -> dict[str, Any]:
    """Return works, which are by the quantities that are their power."""
    found: dict[str, Any] = {}
    keys = {POWER_OF[name]: key for name, key in WORK_KEYS.items()}
    for power, work in works.items():
        if power == "power_contact" and result.robot.contacts is None:
            continue
        places = result.rows[power].at.tolist()
        if power == "power":  # joints that follow others too, whose work is none
            places = [[i] for i in range(len(result.robot.joints))]
        entries = [_entry(result, work, QUANTITIES[power], tuple(at)) for at in places]
        found[keys.get(power, power)] = entries
    return found


def _entry(
    result: AnalysisResult, work: Work, power: ResultQuantity, at: tuple[int, ...]
) -> dict[str, str | float]:
    """Return a work by the names along the axes of its power."""
    index, (given, taken) = dict(zip(power.axes, at, strict=True)), (work.given[at], work.taken[at])
    names = {axis: result.rows.axes[axis].names[index[axis]] for axis in power.written_axes}
    return {**names, "given": float(given), "taken_back": float(taken), "net": float(given - taken)}


def named_result(result: AnalysisResult) -> Any:
    """Return the Dataset of `Analysis.to_xarray`."""
    extra("xarray")
    arrays = {one.array.name for name, one in QUANTITIES.items() if name in result.rows and name != "time"}
    parts: list[Part] = [
        (one.array, _values(result, name)) for name, one in QUANTITIES.items() if one.array.name in arrays
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
    found = dataset(parts, result.rows.axes, ["time"], {"time": ("time", result.time, {"units": "s"})}, about)
    return found.merge(dataset(list(_works(result)), result.rows.axes, [], {}, {}))


def _works(result: AnalysisResult) -> Iterator[Part]:
    """Yield the work that was given and the work that was taken back, over the whole movement."""
    for name, quantity in WORKS.items():
        if POWER_OF[name] in result.works and all(result.rows.axes[axis].names for axis in quantity.axes):
            for way in ("given", "taken"):
                yield quantity._replace(beside=("way", way)), getattr(getattr(result, name), way)


def _values(result: AnalysisResult, name: str) -> Array:
    """Return a quantity as one array, zeros where it has no row, NaN for components that a point lacks."""
    out = result.dense(name)
    if "point" in QUANTITIES[name].axes:
        components = result.rows.axes["component"].names
        for number, point in enumerate(result.rows.points):
            out[:, number, [at for at, row in enumerate(components) if row not in point.rows]] = np.nan
    return out


RESIDUAL = " (residual)"
HEAD = ("joint", "peak |τ|", "mean |τ|", "largest cause", "its share", "gave", "took back")


def result_table(result: AnalysisResult) -> str:
    """Return the HTML of a result; peaks, means, shares and work are over all samples of the movement.

    Causes and shares are those of `--figure shares`. What was not asked for is left out.
    """
    joints, torques = result.robot.joints, result.rows["tau"].rows
    mean, peak = result.totals.mean[torques], result.totals.peak[torques]
    told = [0, *([] if "tau" in result.rows.left_out else [1, 2])]
    told += [3, 4] if not result.rows.left_out else []
    told += [5, 6] if "power" in result.works else []
    causes = causes_of(result, joints) if 3 in told else ()
    rows = []
    loads = sizes(result, causes).T if causes else np.zeros((len(result.robot.driven), 0))
    for i in result.robot.joints_apart:
        at = result.robot.driven.index(i)
        unit, loading = result.robot.torque_units[i], loads[at]
        cells = {0: f"{joints[i]}{RESIDUAL if i in result.robot.residuals else ''}"}
        if 1 in told:
            cells |= {1: f"{peak[at]:.4g} {unit}", 2: f"{mean[at]:.4g} {unit}"}
        if 3 in told:
            most, whole = largest_first(loading)[0], float(loading.sum())
            cells[3] = causes[most].label if whole else ""
            cells[4] = f"{100 * loading[most] / whole:.0f} %" if whole else ""
        if 5 in told:
            cells[5], cells[6] = _told(result.joint_work, i)
        rows.append(tuple(cells.values()))
    title = f"{result.robot.name}: who loads whom in {result.source}"
    warnings = (*result.warnings, *result.load_warnings)
    head = tuple(HEAD[at] for at in told)
    return page_part(title, table(head, rows)) + remark(
        result.provenance, *result.residual_report.lines, *warnings
    )


def _told(work: Work, joint: int) -> tuple[str, str]:
    """Return the work that a joint gave and the work that it took back, as text in J."""
    return f"{work.given[joint]:.4g} J", f"{work.taken[joint]:.4g} J"
