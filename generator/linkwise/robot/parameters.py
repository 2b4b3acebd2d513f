"""Substitution of numbers for a description's named parameters."""

from collections.abc import Sequence
from dataclasses import replace

import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.robot.description import AnchoredTie, Body, Description
from linkwise.robot.robot import Scalar, Vec3, unusable

Values = Sequence[tuple[str, float]]


def _number(value: Scalar, values: dict[sp.Symbol, float]) -> float:
    return value if isinstance(value, float) else float(sp.sympify(value).xreplace(values))


def _vector(a: Vec3, values: dict[sp.Symbol, float]) -> Vec3:
    x, y, z = (_number(e, values) for e in a)
    return x, y, z


def _body(body: Body, values: dict[sp.Symbol, float]) -> Body:
    a, b, c = (_vector(row, values) for row in body.inertia)
    return replace(body, mass=_number(body.mass, values), com=_vector(body.com, values), inertia=(a, b, c))


def _tie(tie: AnchoredTie, values: dict[sp.Symbol, float]) -> AnchoredTie:
    first, second = (
        replace(end, translation=_vector(end.translation, values)) for end in (tie.first, tie.second)
    )
    return replace(tie, first=first, second=second, length=_number(tie.length, values))


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
        ties=tuple(_tie(tie, values) for tie in description.ties),
    )
