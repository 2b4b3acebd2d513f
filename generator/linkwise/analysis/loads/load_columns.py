"""Columns of loads in a log: BODY/force_x, NAME:BODY/force_x, and likewise for moment and point."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from linkwise_runtime.chosen_names import end_of_path

from linkwise.analysis.body_names import named_body
from linkwise.analysis.column_matching import time_column, with_nearest
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads.given_loads import FORCE, MOMENT, POINT, WORLD
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

PARTS = {"force": FORCE, "moment": MOMENT, "point": POINT}
NAMED = re.compile(r"(?P<load>.+)/(?P<part>force|moment|point)_(?P<axis>[xyz])")


@dataclass(frozen=True)
class LoadColumns:
    """A load in a log: numbers of its time column, and of its three columns of force, moment and point."""

    name: str
    body: str
    log: Path
    time: int
    columns: dict[str, tuple[int, ...]]
    axes: str = WORLD
    point_in: str | None = None
    """None for the loaded body; a force without a point acts at its origin."""
    warnings: tuple[str, ...] = ()
    """Warnings about the file that describes the load; each names the file."""


def load_columns(
    log: Path, columns: Sequence[str], robot: LoadedRobot, ignore_extra: bool
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
    robot: LoadedRobot,
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
