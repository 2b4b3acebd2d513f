"""`manifest.json` of a generated package: what it is of, from what it was made, and how to make it again."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Literal, get_args, get_origin, get_type_hints

from linkwise.errors import LinkwiseError

SCHEMA = 2
FILE = "manifest.json"
UNITS = {"angle": "rad", "length": "m", "mass": "kg", "time": "s", "torque": "N m", "force": "N"}
CONVENTIONS = {
    "decomposition": "tau_ij = sum_k c2_ijk qdd_k + sum_k c1_ijk qd_k + g_ij: joint i, link j, coordinate k",
    "velocity": "closing: c1 = 1/2 d(tau)/d(qd) of the part quadratic in the velocities",
    "indices": "in this file they count from 0; parent is an index of tree.bodies, None for the ground",
    "operations": "additions, multiplications and divisions for one sample; sines and the like apart",
}

Row = tuple[float, float, float]


@dataclass(frozen=True)
class JointEntry:
    """A coordinate's name and unit."""

    name: str
    unit: Literal["rad", "m"]


@dataclass(frozen=True)
class LinkEntry:
    """A link's name, the coordinates that move it (counted from 0), and its decomposition's operations."""

    name: str
    path: tuple[int, ...]
    operations: int


@dataclass(frozen=True)
class BodyEntry:
    """A moving frame on its parent's, as `linkwise.robot.robot.Joint` places it, and the mass it carries.

    parent: index of an earlier body, None for the ground; coordinate: index of a joint of the manifest
    translation, com in m, mass in kg, inertia about the centre of mass in kg·m², in the body's own axes
    """

    link: str
    parent: int | None
    joint: str
    kind: Literal["revolute", "prismatic"]
    coordinate: int
    ratio: float
    rotation: tuple[Row, Row, Row]
    translation: Row
    mass: float
    com: Row
    inertia: tuple[Row, Row, Row]


@dataclass(frozen=True)
class RigidTree:
    """The rigid bodies, parents before children, and gravity in m/s² in the base's axes."""

    gravity: Row
    bodies: tuple[BodyEntry, ...]


@dataclass(frozen=True)
class Manifest:
    """What a package is of; `tree` is None for energies that a user wrote.

    request: the options of `generate`; files: the SHA-256 of every other file, by its path in the package
    shared_operations: those of the kernel in which links share work; None without such a kernel
    """

    name: str
    robot: str
    generator: Mapping[str, str]
    request: Mapping[str, Any]
    joints: tuple[JointEntry, ...]
    links: tuple[LinkEntry, ...]
    shared_operations: int | None
    parameters: Mapping[str, float]
    tree: RigidTree | None
    files: Mapping[str, str]

    def __post_init__(self) -> None:
        """Raise ValueError where entries contradict each other."""
        count = len(self.joints)
        if not count or not self.links:
            raise ValueError("there must be a joint and a link")
        for link in self.links:
            if not all(0 <= k < count for k in link.path):
                raise ValueError(f"the path of link {link.name!r} names a joint that is not there")
        if self.tree is not None:
            _check_tree(self.tree, count, {link.name for link in self.links})

    def text(self) -> str:
        """JSON, one entry of a list a line."""
        data = {"schema": SCHEMA, **asdict(self), "units": UNITS, "conventions": CONVENTIONS}
        return "{\n" + ",\n".join(f' "{key}": {_lines(value)}' for key, value in data.items()) + "\n}\n"

    @classmethod
    def read(cls, directory: Path) -> "Manifest":
        """Manifest of the package in `directory`; raises LinkwiseError for none, or for a damaged one."""
        path = directory / FILE
        if not path.is_file():
            raise LinkwiseError(
                f"{directory}: no generated robot there (no {FILE}); make one with `linkwise generate`"
            )
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            schema = data.get("schema", SCHEMA) if isinstance(data, dict) else SCHEMA
            manifest: Manifest | None = _decoded(cls, data, "") if schema == SCHEMA else None
        except OSError as error:
            raise LinkwiseError(f"{path} cannot be read: {error.strerror}") from error
        except (ValueError, RecursionError) as error:
            reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
            raise LinkwiseError(f"{path} is damaged: {reason}; generate the robot again") from error
        if manifest is None:
            raise LinkwiseError(
                f"{path} was written by another version of linkwise (schema {schema!r}, this one reads "
                f"{SCHEMA}); generate the robot again"
            )
        return manifest


def _check_tree(tree: RigidTree, count: int, links: set[str]) -> None:
    for index, body in enumerate(tree.bodies):
        if not 0 <= body.coordinate < count:
            raise ValueError(f"body {index} of the tree hangs on no joint")
        if body.parent is not None and not 0 <= body.parent < index:
            raise ValueError(f"the parent of body {index} of the tree is not an earlier body")
    lost = sorted(links - {body.link for body in tree.bodies})
    if lost:
        raise ValueError(f"link {lost[0]!r} is not in the tree")


def _lines(value: Any) -> str:
    """JSON of one entry; the items of a list or an object that holds some stand on lines of their own."""
    if isinstance(value, Mapping) and value:
        return "{\n" + ",\n".join(f"  {json.dumps(k)}: {_items(v)}" for k, v in value.items()) + "\n }"
    return _items(value)


def _items(value: Any) -> str:
    if isinstance(value, (list, tuple)) and value and isinstance(value[0], Mapping):
        return "[\n" + ",\n".join(f"  {json.dumps(item)}" for item in value) + "\n ]"
    return json.dumps(value)


def _decoded(kind: Any, data: Any, place: str) -> Any:
    """Return JSON data as a value of the annotated type `kind`; raises ValueError that names the place."""
    inner = get_args(kind)
    if isinstance(kind, type) and is_dataclass(kind):
        _require(isinstance(data, dict), place, "an object")
        hints = get_type_hints(kind)
        lost = [name for name in hints if name not in data]
        _require(not lost, place, f"an object with {', '.join(lost)}")
        return kind(**{name: _decoded(hint, data[name], f"{place}.{name}") for name, hint in hints.items()})
    if get_origin(kind) is UnionType:  # X | None
        return None if data is None else _decoded(inner[0], data, place)
    if get_origin(kind) is tuple:
        endless = inner[-1] is Ellipsis
        expected = "a list" if endless else f"a list of {len(inner)}"
        _require(isinstance(data, list) and (endless or len(data) == len(inner)), place, expected)
        kinds = inner[:1] * len(data) if endless else inner
        return tuple(
            _decoded(k, item, f"{place}[{n}]") for n, (k, item) in enumerate(zip(kinds, data, strict=True))
        )
    if get_origin(kind) is Literal:
        _require(data in inner, place, " or ".join(map(repr, inner)))
        return data
    if get_origin(kind) is Mapping:
        _require(isinstance(data, dict), place, "an object")
        return {key: _decoded(inner[1], item, f"{place}.{key}") for key, item in data.items()}
    if kind is float:
        number = isinstance(data, (int, float)) and not isinstance(data, bool)
        _require(number and math.isfinite(data), place, "a finite number")
        return float(data)
    if kind is not Any:
        _require(type(data) is kind, place, {int: "a whole number", str: "a string"}[kind])
    return data


def _require(met: bool, place: str, expected: str) -> None:
    if not met:
        raise ValueError(f"{place.lstrip('.') or 'the whole'} is not {expected}")
