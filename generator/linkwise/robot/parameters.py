"""Named parameters: given values, left as symbols, or made from a robot's numbers."""

from collections.abc import Sequence
from dataclasses import replace

import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.robot.description import Body, Description
from linkwise.robot.notes import Note
from linkwise.robot.robot import Link, Mat3, Robot, Scalar, Vec3, unusable

PROMOTED = (
    ("m_", Note("promoted", "m_…", "mass in kg")),
    (
        "c_",
        Note(
            "promoted", "c_…", "centre of mass in m, in linkwise's frame of the link: z on the joint's axis"
        ),
    ),
    ("I_", Note("promoted", "I_…", "inertia about the centre of mass in kg·m², in the same frame")),
    ("p_", Note("promoted", "p_…", "place of the joint in m, in linkwise's frame of the parent")),
)

Values = Sequence[tuple[str, float]]


def _number(value: Scalar, values: dict[sp.Symbol, float]) -> float:
    return value if isinstance(value, float) else float(sp.sympify(value).xreplace(values))


def _vector(a: Vec3, values: dict[sp.Symbol, float]) -> Vec3:
    x, y, z = (_number(e, values) for e in a)
    return x, y, z


def _body(body: Body, values: dict[sp.Symbol, float]) -> Body:
    a, b, c = (_vector(row, values) for row in body.inertia)
    return replace(body, mass=_number(body.mass, values), com=_vector(body.com, values), inertia=(a, b, c))


def _symbols(values: Values) -> dict[sp.Symbol, float]:
    for name, value in values:
        if fault := unusable(value):
            raise LinkwiseError(f"parameter {name!r} has {fault} for a value; give a number")
    return {sp.Symbol(name, real=True): value for name, value in values}


def numeric(description: Description) -> Description:
    """Return the description with numbers in place of parameters."""
    values = _symbols(description.parameters)
    return replace(
        description,
        bodies=tuple(_body(body, values) for body in description.bodies),
        connections=tuple(
            replace(c, translation=_vector(c.translation, values)) for c in description.connections
        ),
        gravity=_vector(description.gravity, values),
    )


def promoted(robot: Robot) -> Robot:
    """Return the robot with a named parameter for each number of its lengths, masses and inertias.

    Zeros stay: they are the robot's structure, such as an arm's being planar. Names are m, c_x, I_xy of the
    link and p_x of its joint, with the link's name after the letter. They are in linkwise's own frame of
    the link, z on the joint's axis (p in the parent's), which a file's frame need not be.
    """
    values = dict(robot.parameters)

    def scalar(name: str, value: Scalar) -> Scalar:
        if not isinstance(value, (int, float)) or value == 0.0:
            return value
        values[name] = float(value)
        return sp.Symbol(name, real=True)

    def vector(name: str, a: Vec3) -> Vec3:
        x, y, z = (scalar(f"{name}_{axis}", e) for axis, e in zip("xyz", a, strict=True))
        return x, y, z

    def link(old: Link) -> Link:
        n = old.name
        joint = replace(old.joint, translation=vector(f"p_{n}", old.joint.translation))
        moments = {
            (i, k): scalar(f"I_{n}_{'xyz'[i]}{'xyz'[k]}", old.inertia[i][k])
            for i in range(3)
            for k in range(i, 3)
        }
        a, b, c = (tuple(moments[min(i, k), max(i, k)] for k in range(3)) for i in range(3))
        inertia: Mat3 = (a, b, c)  # type: ignore[assignment]
        return replace(
            old,
            joint=joint,
            mass=scalar(f"m_{n}", old.mass),
            com=vector(f"c_{n}", old.com),
            inertia=inertia,
        )

    links = tuple(link(old) for old in robot.links)
    used = _used(links, robot.gravity)
    given = {name for name, _ in robot.parameters}
    notes = [note for letter, note in PROMOTED if any(k[:2] == letter and k not in given for k in values)]
    parameters = tuple((k, v) for k, v in values.items() if k in used)
    return replace(robot, links=links, parameters=parameters, notes=(*robot.notes, *notes))


def _used(links: tuple[Link, ...], gravity: Vec3) -> set[str]:
    scalars = [*gravity]
    for link in links:
        scalars += [
            link.mass,
            *link.com,
            *link.joint.translation,
            *(e for row in link.inertia for e in row),
        ]
    return {s.name for value in scalars if isinstance(value, sp.Basic) for s in value.free_symbols}
