"""Loads on a robot, read from files and values and checked against its bodies and the motion's time."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from linkwise.analysis.body_names import told_apart
from linkwise.analysis.column_matching import FAR
from linkwise.analysis.disk_rows import collected
from linkwise.analysis.even_time import even_rate, usual_step
from linkwise.analysis.filtering import lowpass
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads.given_loads import FORCE, MOMENT, POINT, WIDTH, Load, Loads
from linkwise.analysis.loads.load_files import PARTS, LoadColumns, external_loads, load_columns
from linkwise.analysis.loads.placed_load import PlacedLoad, Seat, seat_of
from linkwise.analysis.logs import open_log
from linkwise.analysis.samples import finite_blocks, slowness
from linkwise.analysis.settings import Lowpass
from linkwise.errors import LinkwiseError, within
from linkwise.package.load import Array
from linkwise.progress import Progress


def placed_loads(
    wanted: Loads,
    robot: LoadedRobot,
    motion: Array,
    ignore_extra: bool,
    progress: Progress,
    buffer: Path | None = None,
) -> tuple[PlacedLoad, ...]:
    """Return all loads, over the motion's time (S,) in s.

    buffer: a folder that keeps their samples, in place of memory

    Raises LinkwiseError that names file, row and column for data that are missing, have gaps or are too
    short.
    """
    loads = [_given(load, robot, motion) for load in wanted.given]
    listed = [(one, path) for path in wanted.paths for one in _listed(path, robot, ignore_extra)]
    for columns, path in _with_doubles_told(listed):
        loads.append(_read(columns, path, wanted.cutoff, robot, motion, progress, buffer))
    told_apart("load", [load.name for load in loads], (), "tell them apart as NAME:BODY, or by name= in XML")
    return tuple(loads)


def _listed(path: Path, robot: LoadedRobot, ignore_extra: bool) -> tuple[LoadColumns, ...]:
    if path.suffix.lower() == ".xml":
        return external_loads(path)
    log = open_log(path)
    with within(str(path)):
        return load_columns(path, log.columns, robot, ignore_extra)


def _with_doubles_told(loads: Sequence[tuple[LoadColumns, Path]]) -> Iterator[tuple[LoadColumns, Path]]:
    """Yield the loads, with a warning for each whose force or moment comes from the columns of another."""
    first: dict[tuple[Path, tuple[int, ...]], str] = {}
    for load, path in loads:
        told = []
        for part in ("force", "moment"):
            if part in load.columns:
                other = first.setdefault((load.log.resolve(), load.columns[part]), load.name)
                if other != load.name:
                    what = f"the {part} of load {load.name!r} is from the columns of {other!r}"
                    told.append(f"{load.log.name}: {what}: is one body's given for two?")
        yield replace(load, warnings=(*load.warnings, *told)), path


def _given(load: Load, robot: LoadedRobot, motion: Array) -> PlacedLoad:
    seat = seat_of(load.name, load.body, load.axes, load.point_in, robot)
    table = load.table()
    _about_origin(seat, table)
    if load.time is not None:
        with within(f"load {load.name!r}"):
            _check_time(table[:, 0], motion, 1)
    return PlacedLoad(load.name, seat, table, "")


def _read(
    load: LoadColumns,
    path: Path,
    cutoff: float | None,
    robot: LoadedRobot,
    motion: Array,
    progress: Progress,
    buffer: Path | None,
) -> PlacedLoad:
    with within(str(path)):
        seat = seat_of(load.name, load.body, load.axes, load.point_in, robot)
    log = open_log(load.log)

    def blocks() -> Iterator[Array]:
        wanted = (load.time, *(at for some in load.columns.values() for at in some))
        for block in finite_blocks(log, wanted, progress):
            rows = np.zeros((len(block), WIDTH))
            rows[:, 0] = block[:, 0]
            for number, part in enumerate(load.columns):
                rows[:, PARTS[part]] = block[:, 1 + 3 * number : 4 + 3 * number]
            _about_origin(seat, rows)
            yield rows

    table = collected(blocks(), WIDTH, buffer)
    with within(str(load.log)):
        _check_time(table[:, 0], motion, log.first_row)
        if cutoff is not None:
            mend = "for --loads-cutoff bring it to an even rate, in Hz such as"
            rate = even_rate(table[:, 0], log.first_row, strict=True, mend=mend)
            lowpass(table[:, 1:7], rate, Lowpass(cutoff), flag="--loads-cutoff")
    noticed = (*log.warnings, *slowness(1 / usual_step(table[:, 0], log.first_row)))
    noticed += _far(load, table)
    warnings = (*load.warnings, *(f"{load.log.name}: {warning}" for warning in noticed))
    return PlacedLoad(load.name, seat, table, load.log.name, cutoff, warnings)


def _far(load: LoadColumns, table: Array) -> tuple[str, ...]:
    """Return a warning if the load's point is implausibly far away."""
    largest = float(np.abs(table[:, POINT]).max())
    if largest <= FAR:
        return ()
    return (f"load {load.name!r}: its point reaches {largest:.4g} m: if that is mm, divide it by 1000",)


def _about_origin(seat: Seat, rows: Array) -> None:
    """Refer moments to the world's origin where force and point are given in the world, in place."""
    if seat.in_world:
        rows[:, MOMENT] += np.cross(rows[:, POINT], rows[:, FORCE])


def _check_time(time: Array, motion: Array, first_row: int) -> None:
    """Raise LinkwiseError for time that runs back, has gaps, or does not cover the motion's."""
    if len(time) < 2:
        raise LinkwiseError(f"{len(time)} samples; a load over time has 2 or more")
    step = min(usual_step(time, first_row), float(np.diff(motion[:2]).sum()))
    for row, late, verb, own, other in (
        (first_row, time[0] - motion[0], "begins", time[0], motion[0]),
        (first_row + len(time) - 1, motion[-1] - time[-1], "ends", time[-1], motion[-1]),
    ):
        if late > step:
            raise LinkwiseError(
                f"row {row}, time column: it {verb} at {own:.6g} s, the motion at {other:.6g} s; cut the"
                " motion's log there"
            )
