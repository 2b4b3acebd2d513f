"""Motion in a user's expressions: coordinates, time and inputs, as symbols or as functions of time.

Functions are those of `sympy.physics.mechanics.dynamicsymbols`; their derivatives are velocities.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.robot.robot import Coordinate


class WrittenMotion:
    """Coordinates, time and inputs of a system, and the symbols that expressions have for them."""

    def __init__(self, coordinates: Any, time: object, inputs: object) -> None:
        """Read them as `energy_system` is given them; raises LinkwiseError for what is none of it."""
        self._of_function: dict[sp.Expr, sp.Symbol] = {}
        self._accelerations: set[sp.Expr] = set()
        self._refused: dict[sp.Expr, str] = {}
        functions = (
            [one for one in coordinates if isinstance(one, AppliedUndef)] if _listed(coordinates) else []
        )
        self.time = _time(
            time, [*functions, *(one for one in _items(inputs) if isinstance(one, AppliedUndef))]
        )
        self.coordinates = tuple(self._coordinates(coordinates))
        self._input_functions: set[sp.Expr] = set()
        self.inputs = tuple(self._input(one) for one in _items(inputs))

    @property
    def positions(self) -> list[sp.Symbol]:
        """Symbols of the coordinates."""
        return [c.q for c in self.coordinates]

    @property
    def velocities(self) -> list[sp.Symbol]:
        """Symbols of the velocities."""
        return [c.qd for c in self.coordinates]

    @property
    def varying(self) -> dict[sp.Symbol, float]:
        """Time and inputs, with the value of none given."""
        return dict.fromkeys(([self.time] if self.time is not None else []) + list(self.inputs), 0.0)

    def known(self) -> set[sp.Symbol]:
        """Return the symbols that expressions may have beside parameters."""
        return {*self.positions, *self.velocities, *self.varying}

    def plain(self, expr: sp.Expr) -> sp.Expr:
        """Return an expression with symbols for functions and their derivatives.

        Raises LinkwiseError for a function that is no coordinate and no input, and for accelerations.
        """
        if not expr.has(AppliedUndef, sp.Derivative):
            return expr
        worked_out = expr.doit()
        parts = sorted(worked_out.atoms(sp.Derivative), key=str) + sorted(
            worked_out.atoms(AppliedUndef), key=str
        )
        for part in parts:
            if part not in self._of_function:
                raise LinkwiseError(self._unknown(part))
        return worked_out.xreplace(self._of_function)

    def rate(self, expr: sp.Expr) -> sp.Expr:
        """Return the time derivative of an expression in coordinates and time."""
        found = self.plain(sp.sympify(expr))
        for kind, symbols in (("the input", self.inputs), ("the velocity", self.velocities)):
            for symbol in symbols:
                if found.has(symbol):
                    raise LinkwiseError(
                        f"where it is depends on {kind} {symbol}, whose rate is not known; use coordinates, "
                        "time and parameters"
                    )
        own = sum((sp.diff(found, c.q) * c.qd for c in self.coordinates), sp.S.Zero)
        return own + (sp.diff(found, self.time) if self.time is not None else 0)

    def index(self, given: object, told: str = "its forces name") -> int:
        """Return the index of a coordinate given as one, as its symbol or function, or by its name."""
        for k, c in enumerate(self.coordinates):
            functions = [function for function, symbol in self._of_function.items() if symbol == c.q]
            if given in (c, c.q, c.name, *functions):
                return k
        names = ", ".join(c.name for c in self.coordinates)
        raise LinkwiseError(f"{told} {short(repr(given))}, which is no coordinate; choose among {names}")

    def check_apart(self) -> None:
        """Raise LinkwiseError for a symbol that is given as two of coordinate, velocity, time and input."""
        known = dict.fromkeys((*self.positions, *self.velocities), "a coordinate or its velocity")
        if self.time is not None and self.time in known:
            raise LinkwiseError(
                f"`time` is {self.time}, which is {known[self.time]} too; give its own symbol"
            )
        known |= {self.time: "time"} if self.time is not None else {}
        for symbol in self.inputs:
            if symbol in known:
                raise LinkwiseError(f"the input {symbol} is {known[symbol]} too; give each its own symbol")
            known[symbol] = "another input"

    def _coordinates(self, given: Any) -> Iterable[Coordinate]:
        units = dict(given) if isinstance(given, Mapping) else {}
        if not _listed(given):
            raise LinkwiseError(
                "the coordinates are no list; give linkwise.Coordinate of each, or {function: unit}"
            )
        for one in given:
            if isinstance(one, Coordinate) and not units:
                yield one
            elif isinstance(one, AppliedUndef) and one in units:
                coordinate = Coordinate(one.func.__name__, units[one])
                speed = one.diff(self.time)
                self._of_function |= {one: coordinate.q, speed: coordinate.qd}
                self._accelerations.add(speed.diff(self.time))
                yield coordinate
            elif isinstance(one, AppliedUndef):
                raise LinkwiseError(
                    f"the coordinate {one} has no unit; give a dictionary, {{{one.func}: 'rad'}}"
                )
            else:
                raise LinkwiseError(
                    f"the coordinate {short(repr(one))} is no linkwise.Coordinate and no function of time"
                )

    def _input(self, given: object) -> sp.Symbol:
        if isinstance(given, AppliedUndef):
            symbol = sp.Symbol(given.func.__name__, real=True)
            if given in self._of_function:
                raise LinkwiseError(f"the input {given} is a coordinate too; give each its own function")
            self._of_function[given] = symbol
            self._input_functions.add(given)
            return symbol
        if not isinstance(given, sp.Symbol):
            raise LinkwiseError(f"the input {short(repr(given))} is no symbol and no function of time")
        return given

    def _unknown(self, part: sp.Expr) -> str:
        if part in self._accelerations:
            return f"{part} is an acceleration, which energies and forces do not depend on"
        if isinstance(part, sp.Derivative) and part.expr in self._input_functions:
            return f"{part} is the rate of an input, which is not known; make it an input of its own"
        return (
            f"{part} is neither a coordinate or its velocity nor among `inputs`; add it to `coordinates`, "
            "or to `inputs` if it is given from outside"
        )


def _listed(given: object) -> bool:
    return isinstance(given, list | tuple | Mapping)


def _items(given: object) -> list[Any]:
    if not isinstance(given, list | tuple):
        raise LinkwiseError(f"`inputs` is {short(repr(given))}; give a list of symbols or functions of time")
    return [*given]


def _time(given: object, functions: Iterable[AppliedUndef]) -> sp.Symbol | None:
    """Return the symbol of time: the one given, or that of which functions are."""
    if given is not None and not isinstance(given, sp.Symbol):
        raise LinkwiseError(f"`time` is {short(repr(given))}; give its symbol")
    for function in functions:
        if len(function.args) != 1 or not isinstance(function.args[0], sp.Symbol):
            raise LinkwiseError(f"{function} is no function of time alone")
        given = given if given is not None else function.args[0]
        if function.args[0] != given:
            raise LinkwiseError(f"{function} is a function of {function.args[0]}, and time is {given}")
    return given
