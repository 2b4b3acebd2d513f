"""Files of loads: columns such as BODY/force_x in a log, and OpenSim's ExternalLoads.

The latter says which columns of a storage file are forces on which body, and in whose axes.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path
from xml.etree.ElementTree import Element

from linkwise_runtime.chosen_names import end_of_path, nearest_first

from linkwise.analysis.body_names import named_body
from linkwise.analysis.column_matching import time_column, with_nearest
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads.given_loads import FORCE, MOMENT, POINT, WORLD
from linkwise.analysis.logs import open_log
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.input_file import require_file

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


GROUND = "ground"
LOADS_TAG, FORCE_TAG = "ExternalLoads", "ExternalForce"
"""Names of elements; an element inside <defaults> is no load."""
NONE = ("", "Unassigned")
"""Texts that OpenSim writes where nothing is given."""
AXES = ("xyz", "123")
"""Letters in which three columns' names differ; digits where OpenSim has flattened a table of vectors."""
IDENTIFIERS = {"force": "force_identifier", "moment": "torque_identifier", "point": "point_identifier"}


def external_loads(path: Path) -> tuple[LoadColumns, ...]:
    """Return the forces that are on, each with the columns of its data file; warn of the others.

    Raises LinkwiseError for a file without any, misspelt names, missing data, and identifiers of other than
    three columns.
    """
    with within(str(path)):
        forces, told = _forces(path)
        unread = [_unread(force, log) for force, log in forces]
        found = [_with_columns(load, force) for load, (force, _) in zip(unread, forces, strict=True)]
    told += [
        f"load {load.name!r} has no point_identifier, so its force acts at the origin of {load.body}"
        for load in found
        if "force" in load.columns and "point" not in load.columns
    ]
    return (replace(found[0], warnings=tuple(f"{path.name}: {one}" for one in told)), *found[1:])


def data_files(path: Path) -> tuple[Path, ...]:
    """Return the files that hold the numbers of external loads, each once, whether they exist or not.

    Raises LinkwiseError for a file of loads without any.
    """
    with within(str(path)):
        return tuple(dict.fromkeys(log for _, log in _forces(path)[0]))


def _forces(path: Path) -> tuple[list[tuple[Element, Path]], list[str]]:
    """Return the forces that are on, each with its data file, and notes on what is left out."""
    # Imported here, as the readers need SymPy, which other loads can do without.
    from linkwise.analysis.loads.external_names import unread_names
    from linkwise.robot.readers.osim.document import yes
    from linkwise.robot.readers.xml_file import parse

    require_file(path)
    root = parse(path)
    loads = root if root.tag == LOADS_TAG else root.find(LOADS_TAG)
    there = [] if loads is None else loads.findall(f"objects/{FORCE_TAG}")
    told = list(unread_names(root))
    # Files of OpenSim 3 say isDisabled, those of 4 appliesForce.
    is_on = [yes(force, "appliesForce", True) and not yes(force, "isDisabled") for force in there]
    forces = [force for force, on in zip(there, is_on, strict=True) if on]
    if not forces:
        raise LinkwiseError("no ExternalForce that is on; give OpenSim's file of ExternalLoads")
    told += [
        f"force {_name(force)!r} is switched off there, and left out"
        for force, on in zip(there, is_on, strict=True)
        if not on
    ]
    return [(force, _data_file(path, loads, force)) for force in forces], told


def _unread(force: Element, log: Path) -> LoadColumns:
    body = _body(force, "applied_to_body", "")
    name = _name(force)
    if not body:
        raise LinkwiseError(f"load {name!r} has no applied_to_body; name the body there")
    axes, point_in = (_body(force, f"{what}_expressed_in_body", GROUND) for what in ("force", "point"))
    return LoadColumns(
        name, body, log, 0, {}, _world(axes), _world(point_in) if _told(force, "point_identifier") else None
    )


def _name(force: Element) -> str:
    return force.get("name", "").strip() or _body(force, "applied_to_body", "")


def _with_columns(load: LoadColumns, force: Element) -> LoadColumns:
    """Return the load with the numbers of its columns: the three whose names begin with each identifier."""
    columns = open_log(load.log).columns
    found = {}
    for part, key in IDENTIFIERS.items():
        identifier = _told(force, key)
        if identifier:
            found[part] = _three(load, key, identifier, columns)
    if not {"force", "moment"} & set(found):
        raise LinkwiseError(f"load {load.name!r} has neither a force_identifier nor a torque_identifier")
    return replace(load, time=time_column(columns, Reading()), columns=found)


def _three(load: LoadColumns, key: str, identifier: str, columns: Sequence[str]) -> tuple[int, ...]:
    """Return the numbers of the columns x, y and z.

    Raises LinkwiseError unless their names stand in that order: OpenSim accepts three columns in any order.
    """
    found = [at for at, name in enumerate(columns) if name in {identifier + axis for axis in "xyz"}]
    if len(found) != 3:
        found = [at for at, name in enumerate(columns) if name.startswith(identifier)]
    names = [columns[at] for at in found]
    if len(found) == 3 and (parts := _parts(names)) not in AXES:
        how = "bring them into the order x, y, z"
        if "".join(sorted(parts)) not in AXES:
            how = "name one of them x, one y and one z, as in force_vx, force_vy, force_vz"
        raise LinkwiseError(
            f"load {load.name!r}: the columns of {load.log.name} that begin with {key} {identifier!r} stand"
            f" as {listed(map(repr, names))}; {how}"
        )
    if len(found) != 3:
        there = f"{len(found)} columns of {load.log.name} begin so"
        raise LinkwiseError(
            f"load {load.name!r}: {key} is {identifier!r}, and {there}; it needs three, x, y and z, of"
            f" {listed(map(repr, nearest_first(identifier, columns)))}"
        )
    return tuple(found)


def _parts(names: Sequence[str]) -> str:
    """Return the letters in which names differ, in lower case: xyz for Fx_left, Fy_left and Fz_left."""
    beside = zip_longest(*names, fillvalue=" ")
    return "".join("".join(letters) for letters in beside if len(set(letters)) > 1).lower()


def _data_file(path: Path, loads: Element | None, force: Element) -> Path:
    """Return the path of the storage file of all forces, or of this one."""
    told = "" if loads is None else (loads.findtext("datafile") or "").strip()
    if told in NONE:
        told = _told(force, "data_source_name")
    if not told:
        raise LinkwiseError("no datafile; name the .mot or .sto file of the forces there")
    return path.parent / told.replace("\\", "/")


def _told(force: Element, key: str) -> str:
    text = (force.findtext(key) or "").strip()
    return "" if text in NONE else text


def _body(force: Element, key: str, default: str) -> str:
    """Return a body's name, without the path of the set that contains it."""
    return _told(force, key).rpartition("/")[2] or default


def _world(body: str) -> str:
    return WORLD if body == GROUND else body
