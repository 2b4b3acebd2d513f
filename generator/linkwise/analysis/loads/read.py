"""Loads on a robot, read from files and values and checked against its bodies and the motion's time."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from linkwise_runtime.chosen_names import end_of_path

from linkwise.analysis.column_matching import FAR, time_column, with_nearest
from linkwise.analysis.disk_rows import collected, copied
from linkwise.analysis.even_time import even_rate, usual_step
from linkwise.analysis.filtering import lowpass
from linkwise.analysis.loads import FORCE, MOMENT, PARTS, POINT, WIDTH, WORLD, Load, LoadColumns, Loads
from linkwise.analysis.loads.placed import LoadFrame, PlacedLoad, PlacedWrench, load_frame_of
from linkwise.analysis.logs import open_log
from linkwise.analysis.named_bodies import named_body, told_apart
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.samples import finite_blocks, slowness
from linkwise.analysis.settings import Lowpass, Reading
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.progress import Progress

NAMED = re.compile(r"(?P<load>.+)/(?P<part>force|moment|point)_(?P<axis>[xyz])")


def placed_loads(
    wanted: Loads,
    robot: OpenedRobot,
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
    in_files = [(one, path) for path in wanted.paths for one in _listed(path, robot, ignore_extra)]
    for columns, path in _with_doubles_told(in_files):
        loads.append(_read(columns, path, wanted.cutoff, robot, motion, progress, buffer))
    told_apart("load", [load.name for load in loads], (), "tell them apart as NAME:BODY, or by name= in XML")
    return tuple(loads)


def _listed(path: Path, robot: OpenedRobot, ignore_extra: bool) -> tuple[LoadColumns, ...]:
    if path.suffix.lower() == ".xml":
        # Imported here, as the readers need SymPy, which other loads can do without.
        from linkwise.analysis.loads.external import external_loads

        return external_loads(path)
    log = open_log(path)
    with within(str(path)):
        return load_columns(path, log.columns, robot, ignore_extra)


def load_columns(
    log: Path, columns: Sequence[str], robot: OpenedRobot, ignore_extra: bool
) -> tuple[LoadColumns, ...]:
    """Return the loads of a log, all in the world's axes; raise LinkwiseError for columns that form none."""
    time = time_column(columns, Reading())
    found: dict[str, dict[str, dict[str, int]]] = {}
    extra = []
    for at, column in enumerate(columns):
        match = NAMED.fullmatch(column)
        if match:
            found.setdefault(match["load"], {}).setdefault(match["part"], {})[match["axis"]] = at
        elif at != time:
            extra.append(column)
    if not found:
        raise LinkwiseError(
            f"no column of a load in {listed(map(repr, columns))}; name them BODY/force_x, BODY/force_y, …,"
            " or give OpenSim's XML of external loads"
        )
    if extra and not ignore_extra:
        raise LinkwiseError(
            f"no load for column {listed(map(repr, extra))}; name columns BODY/force_x, BODY/moment_x or"
            " BODY/point_x, or leave such columns out with --ignore-extra"
        )
    return tuple(_load(log, time, load, parts, robot, columns) for load, parts in found.items())


def _load(
    log: Path,
    time: int,
    load: str,
    parts: dict[str, dict[str, int]],
    robot: OpenedRobot,
    there: Sequence[str],
) -> LoadColumns:
    name, body = named_body(load, robot)
    missing = [f"{load}/{part}_{axis}" for part, axes in parts.items() for axis in "xyz" if axis not in axes]
    if missing:
        raise LinkwiseError(f"no column {with_nearest(missing, there)}; a load has x, y and z of what it has")
    if not {"force", "moment"} & set(parts):
        raise LinkwiseError(f"load {load!r} has a point and neither force nor moment; add {load}/force_x, …")
    columns = {part: tuple(parts[part][axis] for axis in "xyz") for part in parts}
    return LoadColumns(
        name or end_of_path(body), body, log, time, columns, point_in=WORLD if "point" in parts else None
    )


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


def _given(load: Load, robot: OpenedRobot, motion: Array) -> PlacedLoad:
    load_frame = load_frame_of(load.name, load.body, load.axes, load.point_in, robot)
    table = load.table()
    _about_origin(load_frame, table)
    if load.time is not None:
        with within(f"load {load.name!r}"):
            check_time(table[:, 0], motion, 1)
    before = None if load.unfiltered is None else _given(load.unfiltered, robot, motion)
    wrenches = (PlacedWrench(load_frame, table),)
    return PlacedLoad(load.name, wrenches, load.source, load.filtered, unfiltered=before)


def _read(
    load: LoadColumns,
    path: Path,
    cutoff: float | None,
    robot: OpenedRobot,
    motion: Array,
    progress: Progress,
    buffer: Path | None,
) -> PlacedLoad:
    with within(str(path)):
        load_frame = load_frame_of(load.name, load.body, load.axes, load.point_in, robot)
    log = open_log(load.log)

    def blocks() -> Iterator[Array]:
        wanted = (load.time, *(at for some in load.columns.values() for at in some))
        for block in finite_blocks(log, wanted, progress):
            rows = np.zeros((len(block), WIDTH))
            rows[:, 0] = block[:, 0]
            for number, part in enumerate(load.columns):
                rows[:, PARTS[part]] = block[:, 1 + 3 * number : 4 + 3 * number]
            _about_origin(load_frame, rows)
            yield rows

    table, unfiltered = collected(blocks(), WIDTH, buffer), None
    with within(str(load.log)):
        check_time(table[:, 0], motion, log.first_row)
        if cutoff is not None:
            mend = "for --loads-cutoff bring it to an even rate, in Hz such as"
            rate = even_rate(table[:, 0], log.first_row, strict=True, mend=mend)
            unfiltered = PlacedLoad(
                load.name, (PlacedWrench(load_frame, copied(table, buffer)),), load.log.name
            )
            lowpass(table[:, 1:7], rate, Lowpass(cutoff), flag="--loads-cutoff")
    noticed = (*log.warnings, *slowness(1 / usual_step(table[:, 0], log.first_row)))
    noticed += _far(load, table)
    warnings = (*load.warnings, *(f"{load.log.name}: {warning}" for warning in noticed))
    wrenches = (PlacedWrench(load_frame, table),)
    return PlacedLoad(load.name, wrenches, load.log.name, cutoff, warnings, unfiltered=unfiltered)


def _far(load: LoadColumns, table: Array) -> tuple[str, ...]:
    """Return a warning if the load's point is implausibly far away."""
    largest = float(np.abs(table[:, POINT]).max())
    if largest <= FAR:
        return ()
    return (f"load {load.name!r}: its point reaches {largest:.4g} m: if that is mm, divide it by 1000",)


def _about_origin(load_frame: LoadFrame, rows: Array) -> None:
    """Refer moments to the world's origin where force and point are given in the world, in place."""
    if load_frame.in_world:
        rows[:, MOMENT] += np.cross(rows[:, POINT], rows[:, FORCE])


def check_time(time: Array, motion: Array, first_row: int) -> None:
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
                f"row {row}, time column: it {verb} at {own:.6g} s, the motion at {other:.6g} s; analyse less"
                " of the motion, by --from and --to"
            )
