"""OpenSim's ExternalLoads: which columns of a storage file are forces on which body, and in whose axes.

A misspelt name would silently move or remove a force, so that names close to known ones are refused.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from xml.etree.ElementTree import Element

from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.column_matching import time_column
from linkwise.analysis.loads import WORLD, LoadColumns
from linkwise.analysis.logs import open_log
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.input_file import require_file
from linkwise.robot.notes import effects
from linkwise.robot.readers.osim.document import yes
from linkwise.robot.readers.xml_file import parse
from linkwise.robot.readers.xml_names import Known, ignored, names

NAME = names("name")
OF_TAG = {
    "OpenSimDocument": Known(once=names("ExternalLoads"), attributes=names("Version")),
    "ExternalLoads": Known(
        once=names("objects datafile"),
        attributes=NAME,
        idle=names(
            "defaults groups data_source_name external_loads_model_kinematics_file_name "
            "lowpass_cutoff_frequency_for_load_kinematics"
        ),
    ),
    "objects": Known(many=names("ExternalForce")),
    "ExternalForce": Known(
        once=names(
            "applied_to_body force_expressed_in_body point_expressed_in_body force_identifier "
            "point_identifier torque_identifier data_source_name isDisabled appliesForce"
        ),
        attributes=NAME,
    ),
}
"""Names read in each element; no force here depends on the model's kinematics, which are the log's."""
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
    require_file(path)
    root = parse(path)
    loads = root if root.tag == LOADS_TAG else root.find(LOADS_TAG)
    there = [] if loads is None else loads.findall(f"objects/{FORCE_TAG}")
    unread = ignored([root], lambda element: OF_TAG.get(str(element.tag)), "OpenSim's ExternalLoads")
    told = list(effects(unread))
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
