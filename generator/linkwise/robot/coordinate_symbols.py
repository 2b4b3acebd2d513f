"""SymPy's symbols of a coordinate and of its derivatives by time."""

from typing import Any

import sympy as sp
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.pretty.stringpict import prettyForm


class Position(sp.Symbol):  # type: ignore[misc]
    """Symbol of a position.

    Symbols of different classes differ even if their names agree, so a joint may have any name.
    """


class TimeDerivative(sp.Symbol):  # type: ignore[misc]
    """Symbol of a derivative by time, which text writes as a quotient and LaTeX with dots."""

    precedence = PRECEDENCE["Mul"]
    """Place among operations, by which SymPy brackets the text: (d(q)/dt)**2."""
    _accent = "dot"

    @property
    def _position(self) -> str:
        name: str = self.name
        return name.partition("(")[2].rpartition(")")[0]

    def _latex(self, printer: Any) -> str:
        return rf"\{self._accent}{{{printer._print(sp.Symbol(self._position))}}}"

    def _pretty(self, printer: Any) -> prettyForm:
        return prettyForm(self.name, binding=prettyForm.ADD)


class Velocity(TimeDerivative):
    """Symbol of a velocity."""


class Acceleration(TimeDerivative):
    """Symbol of an acceleration."""

    _accent = "ddot"
