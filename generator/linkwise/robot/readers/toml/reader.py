"""Reader of robots in TOML, schema 1."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from linkwise.bounded_file import toml_data
from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import Body, Connection, Description, Mimic
from linkwise.robot.joint_types import SINGLE
from linkwise.robot.notes import Note, winding
from linkwise.robot.readers.toml.constraints import with_constraints
from linkwise.robot.readers.toml.table import TomlTable, named_parameters, tables
from linkwise.robot.robot import LIMITS, Limits, Mat3, Passive

TOP = {"schema", "name", "gravity", "base", "parameters", "link", "joint", "constraint", "independent"}
LINK = {"name", "mass", "com", "inertia", "allow_unphysical"}
PASSIVE = ("stiffness", "rest", "damping", "friction", "armature")
JOINT = {"name", "type", "parent", "child", "xyz", "rpy", "axis", "mimic", *PASSIVE, *LIMITS}
INERTIA = ("xx", "yy", "zz", "xy", "xz", "yz")


def read_toml(path: Path) -> Description:
    """Return the description of a robot; raises LinkwiseError naming the table, the key and the remedy."""
    data = toml_data(path)
    parameters = named_parameters(data.get("parameters", {}))
    top = TomlTable("the file", data, TOP, parameters)
    base = top.text("base", "base")
    bodies = tuple(_body(item, parameters) for item in tables(data, "link"))
    if base not in {body.name for body in bodies}:
        bodies = (Body(base), *bodies)
    joints = tables(data, "joint")
    described = Description(
        top.text("name", path.stem),
        bodies,
        tuple(_connection(item, parameters) for item in joints),
        top.vector("gravity", [0.0, 0.0, -9.81]),
        tuple(parameters.items()),
        _winding(joints, parameters),
    )
    return with_constraints(described, data)


def _body(data: dict[str, Any], parameters: Mapping[str, float]) -> Body:
    name = data.get("name")
    table = TomlTable(f"link {name!r}", data, LINK, parameters)
    return Body(
        table.text("name"),
        table.scalar("mass", data.get("mass", 0.0)),
        table.vector("com", [0.0, 0.0, 0.0]),
        _inertia(table, data.get("inertia", {})),
        table.text("allow_unphysical", ""),
    )


def _inertia(table: TomlTable, data: Any) -> Mat3:
    inner = TomlTable(f"{table.place}, inertia", data, INERTIA, table.parameters)
    xx, yy, zz, xy, xz, yz = (inner.scalar(key, data.get(key, 0.0)) for key in INERTIA)
    return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))


def _connection(data: dict[str, Any], parameters: Mapping[str, float]) -> Connection:
    name = data.get("name")
    table = TomlTable(f"joint {name!r}", data, JOINT, parameters)
    rotation, snapped = transforms.snapped(transforms.from_rpy(*table.numbers("rpy", [0.0, 0.0, 0.0])))
    return Connection(
        table.text("name"),
        table.text("type", "revolute"),
        table.text("parent"),
        table.text("child"),
        rotation,
        table.vector("xyz", [0.0, 0.0, 0.0]),
        table.numbers("axis", [0.0, 0.0, 1.0]),
        _mimic(table, data["mimic"]) if "mimic" in data else None,
        snapped=snapped,
        passive=Passive(**_of_one_axis(table, PASSIVE)),
        limits=Limits(**_of_one_axis(table, LIMITS)),
    )


def _winding(joints: Iterable[dict[str, Any]], parameters: Mapping[str, float]) -> tuple[Note, ...]:
    """Return notes on angles of joints and of ranges that look like degrees."""
    turns, ends = {}, {}
    for data in joints:
        table = TomlTable(f"joint {data['name']!r}", data, JOINT, parameters)
        turns[table.place] = table.numbers("rpy", [0.0, 0.0, 0.0])
        if data.get("type", "revolute") == "revolute":
            limits = _of_one_axis(table, LIMITS)
            ends[f"range of {data['name']!r}"] = [limits.get(end, 0.0) for end in ("lower", "upper")]
    return winding(turns, ends)


def _of_one_axis(table: TomlTable, keys: Iterable[str]) -> dict[str, float]:
    """Return the values of the keys that are there; raises LinkwiseError if the joint is not of one axis."""
    there = [key for key in keys if key in table.data]
    kind = table.data.get("type", "revolute")
    if there and kind not in SINGLE:
        raise LinkwiseError(f"{table.place} is {kind}, and only a joint of one axis takes {there[0]!r}")
    return {key: table.number(key) for key in there}


def _mimic(table: TomlTable, data: Any) -> Mimic:
    inner = TomlTable(f"{table.place}, mimic", data, ("joint", "multiplier", "offset"), {})
    ratio, offset = (
        inner.scalar("multiplier", data.get("multiplier", 1.0)),
        inner.scalar("offset", data.get("offset", 0.0)),
    )
    return Mimic(inner.text("joint"), float(ratio), float(offset))
