"""Random robots that can exist: trees of joints of every type, masses with true moments, as TOML and URDF.

Everything is drawn from a `random.Random`: of a seed, or hypothesis's own, which then makes failures small.
"""

import json
import math
from dataclasses import dataclass
from random import Random
from typing import Any, Literal
from xml.sax.saxutils import quoteattr

import numpy as np

Row = tuple[float, float, float]
SINGLE = ("revolute", "continuous", "prismatic")
AXES = {"planar": 3, "ball": 3, "floating": 6, "fixed": 0}
OFTEN = {"revolute": 6, "continuous": 2, "prismatic": 3, "fixed": 2, "planar": 1, "ball": 1, "floating": 1}
SUFFIXES = {
    "planar": ("x", "y", "yaw"),
    "ball": ("yaw", "pitch", "roll"),
    "floating": ("x", "y", "z", "yaw", "pitch", "roll"),
}
ALIGNED = tuple(tuple(sign * float(k == at) for k in range(3)) for at in range(3) for sign in (1, -1))
QUARTERS = (0.0, math.pi / 2, -math.pi / 2, math.pi)
ODD_NAMES = (
    "Gelenk äöü",
    "a b",
    'say "so"',
    "x/y",
    "{q}",
    "<b&b>",
    "l\\1",
    "関節",
    "%s",
    "1",
    "class",
    "$x_1$",
)
STANDARD: Row = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class LinkData:
    """Mass in kg, centre of mass in m, inertia about it in kg·m², in the link's frame."""

    name: str
    mass: float = 0.0
    com: Row = (0.0, 0.0, 0.0)
    inertia: tuple[Row, ...] = ((0.0,) * 3,) * 3


@dataclass(frozen=True)
class JointData:
    """A joint; `mimic` is (master, ratio, offset)."""

    name: str
    type: str
    parent: str
    child: str
    xyz: Row
    rpy: Row
    axis: Row
    mimic: tuple[str, float, float] | None = None

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of its coordinates."""
        return (self.name,) if self.type in SINGLE else tuple(f"{self.name}_{s}" for s in SUFFIXES[self.type])


@dataclass(frozen=True)
class RobotData:
    """A tree of links, the root first, and joints, parents before children."""

    form: Literal["toml", "urdf"]
    gravity: Row
    links: tuple[LinkData, ...]
    joints: tuple[JointData, ...]

    @property
    def text(self) -> str:
        """The robot's file."""
        return toml_text(toml_data(self)) if self.form == "toml" else urdf_text(self)


def random_robot(rng: Random, joints: int, coordinates: int = 24) -> RobotData:
    """Draw a robot of so many joints, and of so many coordinates at most."""
    form: Literal["toml", "urdf"] = "toml" if rng.random() < 0.5 else "urdf"
    gravity = _vector(rng, 9.81) if form == "toml" else STANDARD
    branching, names = rng.choice((0.0, 0.2, 0.7)), _names(rng, joints)
    links, made, left = [LinkData("base")], list[JointData](), coordinates
    for at, name in enumerate(names):
        kinds = [kind for kind in OFTEN if AXES.get(kind, 1) <= max(1, left - (joints - at - 1))]
        kind = rng.choices(kinds, [OFTEN[kind] for kind in kinds])[0]
        if at == joints - 1 and left == coordinates:
            kind = "revolute"  # something has to move
        left -= AXES.get(kind, 1)
        parent = rng.choice(links).name if rng.random() < branching else links[-1].name
        made.append(JointData(name, kind, parent, f"{name} link", *_place(rng), _axis(rng)))
        links.append(LinkData(f"{name} link"))
    leaves = {link.name for link in links} - {joint.parent for joint in made}
    bodies = [
        _body(rng, link.name, link.name in leaves) if link.name in leaves or rng.random() < 0.8 else link
        for link in links
    ]
    return RobotData(form, gravity, tuple(bodies), tuple(_mimicking(rng, made)))


def _names(rng: Random, count: int) -> list[str]:
    names = [f"joint{k + 1}" for k in range(count)]
    if rng.random() < 0.2:
        names[rng.randrange(count)] = rng.choice(ODD_NAMES)
    return names


def _vector(rng: Random, size: float) -> Row:
    x, y, z = (rng.uniform(-size, size) for _ in range(3))
    return x, y, z


def _axis(rng: Random) -> Row:
    """One of the frame's own axes, a skew one, or one that is not of length 1."""
    chance = rng.random()
    if chance < 0.5:
        return rng.choice(ALIGNED)
    axis = _vector(rng, 1.0)
    return axis if math.hypot(*axis) > 0.1 else (0.0, 0.6, 0.8)


def _place(rng: Random) -> tuple[Row, Row]:
    if rng.random() < 0.4:  # as arms are built: quarter turns and offsets along an axis
        r, p, y = (rng.choice(QUARTERS) for _ in range(3))
        x, yy, z = (rng.choice((0.0, 0.0, rng.uniform(-0.5, 0.5))) for _ in range(3))
        return (x, yy, z), (r, p, y)
    return _vector(rng, 0.5), _vector(rng, 3.0)


def _body(rng: Random, name: str, solid: bool) -> LinkData:
    """A body with second moments of mass a, b, c ≥ 0, so that its inertia can be, turned at random.

    A solid one has inertia about every axis; another may be a rod or a point.
    """
    mass = 10.0 ** rng.uniform(-1.5, 1.5)
    flat = 1.0 if solid else rng.choice((0.0, 1.0))
    a, b, c = (mass * rng.choice((1.0, flat)) * 10.0 ** rng.uniform(-5, -1) for _ in range(3))
    turn = rotation(*(_vector(rng, 3.0) if rng.random() < 0.7 else (0.0, 0.0, 0.0)))
    tensor = turn @ np.diag([b + c, a + c, a + b]) @ turn.T
    rows = [[float(tensor[min(i, k), max(i, k)]) for k in range(3)] for i in range(3)]
    com = _vector(rng, 0.3) if rng.random() < 0.8 else (0.0, 0.0, 0.0)
    return LinkData(name, mass, com, tuple((r[0], r[1], r[2]) for r in rows))


def _mimicking(rng: Random, joints: list[JointData]) -> list[JointData]:
    """Let some joints of one axis follow another coordinate, which itself follows none."""
    if rng.random() < 0.5:
        return joints
    followers = {j.name for j in joints if j.type in SINGLE and rng.random() < 0.25}
    masters = [name for j in joints if j.name not in followers and j.type != "fixed" for name in j.axis_names]
    if not masters:
        return joints
    return [
        JointData(
            j.name, j.type, j.parent, j.child, j.xyz, j.rpy, j.axis,
            (rng.choice(masters), rng.choice((1.0, -1.0, rng.uniform(-2.0, 2.0))), rng.uniform(-1.0, 1.0)),
        )
        if j.name in followers
        else j
        for j in joints
    ]  # fmt: skip


def rotation(roll: float, pitch: float, yaw: float) -> Any:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return z @ y @ x


def toml_data(robot: RobotData) -> dict[str, Any]:
    """The robot as the tables of a TOML file."""
    keys = (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))
    links = [
        {
            "name": link.name,
            "mass": link.mass,
            "com": list(link.com),
            "inertia": {key: link.inertia[i][k] for key, i, k in keys},
        }
        for link in robot.links
    ]
    joints = [
        {"name": j.name, "type": j.type, "parent": j.parent, "child": j.child}
        | {"xyz": list(j.xyz), "rpy": list(j.rpy), "axis": list(j.axis)}
        | ({"mimic": dict(zip(("joint", "multiplier", "offset"), j.mimic, strict=True))} if j.mimic else {})
        for j in robot.joints
    ]
    return {"schema": 1, "name": "random", "gravity": list(robot.gravity), "link": links, "joint": joints}


def toml_text(data: dict[str, Any]) -> str:
    """TOML with every table inside the value of a key of the top."""
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in data.items())


def _key(key: str) -> str:
    return json.dumps(key).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    match value:
        case dict():
            return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(_value, value)) + "]"
        case str():
            return _key(value) if value.isascii() else f"'{value}'" if "'" not in value else "'?'"
        case bool():
            return str(value).lower()
        case None:
            return '""'
    return repr(value)


def urdf_text(robot: RobotData) -> str:
    """The robot as URDF; ball joints, which URDF has not, are called `ball`."""
    parts = ["<?xml version='1.0' encoding='UTF-8'?>", '<robot name="random">']
    for link in robot.links:
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
        parts.append(
            f'<link name={quoteattr(link.name)}><inertial><origin xyz="{_row(link.com)}"/>'
            f'<mass value="{link.mass!r}"/><inertia ixx="{xx!r}" iyy="{yy!r}" izz="{zz!r}" ixy="{xy!r}" '
            f'ixz="{xz!r}" iyz="{yz!r}"/></inertial></link>'
        )
    for j in robot.joints:
        mimic = ""
        if j.mimic:
            master, ratio, offset = j.mimic
            mimic = f'<mimic joint={quoteattr(master)} multiplier="{ratio!r}" offset="{offset!r}"/>'
        parts.append(
            f'<joint name={quoteattr(j.name)} type="{j.type}"><parent link={quoteattr(j.parent)}/>'
            f'<child link={quoteattr(j.child)}/><origin xyz="{_row(j.xyz)}" rpy="{_row(j.rpy)}"/>'
            f'<axis xyz="{_row(j.axis)}"/>{mimic}</joint>'
        )
    return "\n".join([*parts, "</robot>"]) + "\n"


def _row(values: Row) -> str:
    return " ".join(map(repr, values))
