"""Robots in TOML, schema 1."""

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.robot import transforms
from linkwise.robot.description import Body, Connection, Description, Mimic
from linkwise.robot.joint_types import SINGLE
from linkwise.robot.readers.bounded import MIB, check_toml_bounds, content
from linkwise.robot.readers.formula import parse_formula
from linkwise.robot.robot import Mat3, Passive, Scalar, Vec3, unusable

TOP = {"schema", "name", "gravity", "base", "parameters", "link", "joint"}
LINK = {"name", "mass", "com", "inertia", "allow_unphysical"}
PASSIVE = ("stiffness", "rest", "damping", "friction", "armature")
JOINT = {"name", "type", "parent", "child", "xyz", "rpy", "axis", "mimic", *PASSIVE}
INERTIA = ("xx", "yy", "zz", "xy", "xz", "yz")


class _Table:
    """One table of the file; getters that name table and key when something is wrong."""

    def __init__(self, place: str, data: Any, known: Iterable[str], parameters: Mapping[str, float]) -> None:
        if not isinstance(data, dict):
            raise LinkwiseError(f"{place} must be a table")
        self.place, self.data, self.parameters = place, data, parameters
        for key in data:
            if key not in known:
                raise LinkwiseError(
                    f"{place} has the unknown key {key!r}; known are {listed(sorted(known), 20)}"
                )

    def text(self, key: str, default: str | None = None) -> str:
        value = self.data.get(key, default)
        if not isinstance(value, str):
            raise LinkwiseError(f"{self.place} needs {key!r}, a string")
        return value

    def scalar(self, key: str, value: Any) -> Scalar:
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return _float(f"{self.place}: {key!r}", value)
        if isinstance(value, str):
            with within(f"{self.place}, {key}"):
                return parse_formula(value, self.parameters)
        raise LinkwiseError(f"{self.place}: {key!r} must be a number or a formula in quotes")

    def number(self, key: str) -> float:
        value = self.scalar(key, self.data[key])
        if not isinstance(value, float):
            raise LinkwiseError(f"{self.place}: {key!r} takes a number only, without parameters")
        return value

    def vector(self, key: str, default: list[float] | None) -> Vec3:
        value = self.data.get(key, default)
        if not isinstance(value, list) or len(value) != 3:
            raise LinkwiseError(f"{self.place} needs {key!r}, three numbers")
        x, y, z = (self.scalar(key, item) for item in value)
        return x, y, z

    def numbers(self, key: str, default: list[float]) -> tuple[float, float, float]:
        x, y, z = self.vector(key, default)
        if not all(isinstance(item, float) for item in (x, y, z)):
            raise LinkwiseError(f"{self.place}: {key!r} takes numbers only, parameters cannot turn a frame")
        return x, y, z


def read_toml(path: Path) -> Description:
    """Read a robot; raises LinkwiseError naming the table, the key and the remedy."""
    try:
        text = content(path, MIB).decode("utf-8-sig").replace("\r\n", "\n")
        check_toml_bounds(text)
        data = tomllib.loads(text)
    except LinkwiseError:
        raise
    except (ValueError, RecursionError) as error:  # ValueError: not TOML, not UTF-8
        raise LinkwiseError(f"malformed TOML: {error}") from None
    if type(data.get("schema")) is not int or data["schema"] != 1:
        raise LinkwiseError(f"the schema is {data.get('schema')!r}; write schema = 1 at the top")
    parameters = _parameters(data.get("parameters", {}))
    top = _Table("the file", data, TOP, parameters)
    base = top.text("base", "base")
    bodies = tuple(_body(item, parameters) for item in _list(data, "link"))
    if base not in {body.name for body in bodies}:
        bodies = (Body(base), *bodies)
    return Description(
        top.text("name", path.stem),
        bodies,
        tuple(_connection(item, parameters) for item in _list(data, "joint")),
        top.vector("gravity", [0.0, 0.0, -9.81]),
        tuple(parameters.items()),
    )


def _parameters(data: Any) -> dict[str, float]:
    if not isinstance(data, dict):
        raise LinkwiseError("[parameters] must be a table of numbers")
    for name, value in data.items():
        if not name.isidentifier() or name == "pi":
            raise LinkwiseError(
                f"parameter {name!r} is not a usable name; use letters, digits and _, and not pi"
            )
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise LinkwiseError(f"parameter {name!r} must be a number")
        if fault := unusable(_float(f"parameter {name!r}", value)):
            raise LinkwiseError(f"parameter {name!r} has {fault} for a value; give a number")
    return {name: float(value) for name, value in data.items()}


def _float(place: str, value: int | float) -> float:
    try:
        return float(value)
    except OverflowError:
        raise LinkwiseError(f"{place} is too large a number; 1e308 is about the largest") from None


def _list(data: dict[str, Any], key: str) -> list[Any]:
    items = data.get(key, [])
    if not isinstance(items, list):
        raise LinkwiseError(f"write each {key} as a table of its own, headed [[{key}]]")
    for number, item in enumerate(items, 1):
        if not isinstance(item, dict):
            raise LinkwiseError(f"entry {number} of {key} must be a table; head each with [[{key}]]")
    return items


def _body(data: dict[str, Any], parameters: Mapping[str, float]) -> Body:
    name = data.get("name")
    table = _Table(f"link {name!r}", data, LINK, parameters)
    return Body(
        table.text("name"),
        table.scalar("mass", data.get("mass", 0.0)),
        table.vector("com", [0.0, 0.0, 0.0]),
        _inertia(table, data.get("inertia", {})),
        table.text("allow_unphysical", ""),
    )


def _inertia(table: _Table, data: Any) -> Mat3:
    inner = _Table(f"{table.place}, inertia", data, INERTIA, table.parameters)
    xx, yy, zz, xy, xz, yz = (inner.scalar(key, data.get(key, 0.0)) for key in INERTIA)
    return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))


def _connection(data: dict[str, Any], parameters: Mapping[str, float]) -> Connection:
    name = data.get("name")
    table = _Table(f"joint {name!r}", data, JOINT, parameters)
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
        passive=_passive(table),
    )


def _passive(table: _Table) -> Passive:
    there = [key for key in PASSIVE if key in table.data]
    kind = table.data.get("type", "revolute")
    if there and kind not in SINGLE:
        raise LinkwiseError(f"{table.place} is {kind}, and only a joint of one axis takes {there[0]!r}")
    return Passive(**{key: table.number(key) for key in there})


def _mimic(table: _Table, data: Any) -> Mimic:
    inner = _Table(f"{table.place}, mimic", data, ("joint", "multiplier", "offset"), {})
    ratio, offset = (
        inner.scalar("multiplier", data.get("multiplier", 1.0)),
        inner.scalar("offset", data.get("offset", 0.0)),
    )
    return Mimic(inner.text("joint"), float(ratio), float(offset))
