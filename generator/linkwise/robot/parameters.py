"""Names for the numbers of links and joints, and numbers in place of a description's named parameters."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.description import AnchoredTie, Body, Connection, Description
from linkwise.robot.notes import Note
from linkwise.robot.robot import Link, Mat3, Parameter, Scalar, Vec3, unusable

Values = Sequence[tuple[str, float]]

KINDS = {
    "m": ("kg", "mass"),
    "c": ("m", "centre of mass in m, in the link's own frame as the file has it"),
    "I": ("kg m^2", "inertia about the centre of mass in kg·m², along the axes of that frame"),
    "p": (
        "m",
        "place of the joint that moves the link in m, in the frame of its parent in the file; on the ground "
        "it moves no torque and is no parameter",
    ),
}
MOST_USES = 4
"""Most uses of a file's own parameter that its meaning names."""

Named = Literal["every", "nonzero", "none"]
"""Kinds of numbers that get a name, beside those that the file names itself."""


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


def _values(given: Values) -> dict[sp.Symbol, float]:
    for name, value in given:
        if fault := unusable(value):
            raise LinkwiseError(f"parameter {name!r} has {fault} for a value; give a number")
    return {sp.Symbol(name, real=True): value for name, value in given}


def numeric(description: Description) -> Description:
    """Return the description with numbers in place of parameters."""
    values = _values(description.parameters)
    return replace(
        description,
        bodies=tuple(_body(body, values) for body in description.bodies),
        connections=tuple(
            replace(c, translation=_vector(c.translation, values)) for c in description.connections
        ),
        gravity=_vector(description.gravity, values),
        ties=tuple(_tie(tie, values) for tie in description.ties),
    )


class Naming:
    """Naming of numbers: m_LINK, c_LINK_x, I_LINK_xy of a link, p_LINK_x of its joint; formulas stay.

    Values are the file's. A name that the file's own parameters (`given`) have already gets an underscore.
    """

    def __init__(self, named: Named, given: Mapping[str, float]) -> None:
        self.named, self.given = named, given
        self._made: dict[str, dict[str, Parameter]] = {}
        self._uses: dict[str, list[str]] = {}

    def place(self, connection: Connection, varied: bool) -> Vec3:
        """Return the place of a joint, in m, its numbers replaced by names if `varied`."""
        self._made.setdefault(connection.child, {})
        link, what = connection.child, f"place of joint {connection.name!r}"
        frame = f"in the frame of link {connection.parent!r}"
        x, y, z = (
            self._scalar(link, "p", axis, value, f"{what}: {axis} {frame}", varied)
            for axis, value in zip("xyz", connection.translation, strict=True)
        )
        return x, y, z

    def body(
        self, link: str, merged: bool, mass: Scalar, com: Vec3, inertia: Mat3
    ) -> tuple[Scalar, Vec3, Mat3]:
        """Return mass, centre of mass and inertia of a link, named; a link without any of them gets none."""
        if mass == 0 and all(entry == 0 for row in inertia for entry in row):
            return mass, com, inertia
        whole = f"link {link!r}{' with what is fixed to it' if merged else ''}"
        mass = self._scalar(link, "m", "", mass, f"mass of {whole}")
        x, y, z = (
            self._scalar(link, "c", axis, value, f"centre of mass of {whole}: {axis} in the link's frame")
            for axis, value in zip("xyz", com, strict=True)
        )
        moments = {
            (i, k): self._scalar(
                link,
                "I",
                f"{'xyz'[i]}{'xyz'[k]}",
                inertia[i][k],
                f"inertia of {whole} about its centre of mass: {'xyz'[i]}{'xyz'[k]} in the link's axes",
            )
            for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        }
        a, b, c = (tuple(moments[min(i, k), max(i, k)] for k in range(3)) for i in range(3))
        return mass, (x, y, z), (a, b, c)  # type: ignore[return-value]

    def parameters(
        self, links: Iterable[Link], gravity: Vec3, tied: Iterable[tuple[str, Scalar]] = ()
    ) -> tuple[Parameter, ...]:
        """Return the file's own parameters that are used, then those made, link by link: joint before body.

        tied: numbers of constraints, each with its name
        """
        others = [*((f"gravity_{axis}", value) for axis, value in zip("xyz", gravity, strict=True)), *tied]
        for use, value in others:
            self._note(value, use)
        numbers = (*(value for _, value in others), *_numbers(links))
        used = {symbol.name for value in numbers for symbol in _symbols(value)}
        own = (
            Parameter(name, value, "", f"of the file's own, for {listed(self._uses[name], MOST_USES)}")
            for name, value in self.given.items()
            if name in used
        )
        return (*own, *(p for made in self._made.values() for p in made.values()))

    def notes(self) -> list[Note]:
        """Return a note on the meaning of each kind of name that was made."""
        letters = {name[0] for made in self._made.values() for name in made}
        return [
            Note("promoted", f"{letter}_…", f"{what}{' in kg' if letter == 'm' else ''}")
            for letter, (_, what) in KINDS.items()
            if letter in letters
        ]

    def _scalar(
        self, link: str, letter: str, component: str, value: Scalar, meaning: str, varied: bool = True
    ) -> Scalar:
        name = "_".join(part for part in (letter, link, component) if part)
        if not isinstance(value, (int, float)) and not value.is_number:
            self._note(value, name)
            return value
        number = float(value)
        if not varied or self.named == "none" or (self.named == "nonzero" and number == 0.0):
            return number
        while name in self.given:
            name += "_"
        self._made.setdefault(link, {})[name] = Parameter(name, number + 0.0, KINDS[letter][0], meaning)
        return sp.Symbol(name, real=True)

    def _note(self, value: Scalar, use: str) -> None:
        for symbol in sorted(_symbols(value), key=str):
            self._uses.setdefault(symbol.name, []).append(use)


def _symbols(value: Scalar) -> set[sp.Symbol]:
    return value.free_symbols if isinstance(value, sp.Expr) else set()


def _numbers(links: Iterable[Link]) -> Iterator[Scalar]:
    for link in links:
        yield from (link.mass, *link.com, *link.joint.translation, *(e for row in link.inertia for e in row))
