"""Reader of printed formulas in LaTeX: sums, products, fractions, powers, functions and cases."""

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from linkwise.oracle.formula_text import Unreadable


class LatexReader:
    """Evaluation of a formula for given values of its symbols: recursive descent, products by adjacency."""

    NUMBER = re.compile(r"\d+(?:\.\d+)?")
    FUNCTION = re.compile(r"\\(?:operatorname\{(\w+)\}|(sin|cos|tan|sinh|cosh|tanh|log|exp))(?![a-z])")

    def __init__(
        self, text: str, symbols: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]]
    ) -> None:
        self._text, self._at = text.replace(r"\,", " "), 0
        self._symbols = sorted(symbols.items(), key=lambda item: -len(item[0]))
        self._functions = functions

    def value(self) -> Any:
        """Return the value of the whole; raises Unreadable where anything is left over."""
        result = self._sum()
        if self._at < len(self._text):
            raise self._lost()
        return result

    def _sum(self) -> Any:
        result = self._signed()
        while (sign := self._taken("+", "-")) is not None:
            term = self._product()
            result = result + term if sign == "+" else result - term
        return result

    def _signed(self) -> Any:
        return -self._product() if self._taken("-") else self._product()

    def _product(self) -> Any:
        result = self._power()
        while True:
            times = self._taken(r"\cdot")
            if not times and self._ends():
                return result
            result = result * self._power()

    def _ends(self) -> bool:
        return bool(re.match(r"[+\-})\],&<]|\\right|\\leq|\\\\|$", self._text[self._at :]))

    def _power(self) -> Any:
        base = self._base()
        return np.power(base, self._group()) if self._taken("^") else base

    def _base(self) -> Any:
        if self._taken(r"\frac"):
            above = self._group()
            return above / self._group()
        if self._taken(r"\sqrt"):
            root = self._closed(self._sum(), "]") if self._taken("[") else 2.0
            return np.power(self._group(), 1 / root)
        if self._taken(r"\left("):
            return self._closed(self._sum(), r"\right)")
        if self._taken(r"\left|"):
            return np.abs(self._closed(self._group(), r"\right|"))
        if self._taken(r"\begin{cases}"):
            return self._cases()
        function = self._matched(self.FUNCTION)
        if function:
            name = function[1] or function[2]
            if name not in self._functions:
                raise Unreadable(name)
            if name == "atan2":
                return self._angle()
            exponent = self._group() if self._taken("^") else 1
            return np.power(self._functions[name](self._group()), exponent)
        number = self._matched(self.NUMBER)
        if number:
            return float(number[0])
        for symbol, value in self._symbols:
            if self._taken(symbol):
                return value
        raise self._lost()

    def _cases(self) -> Any:
        """Return the value of the first row whose condition holds, or of the last, after \\begin{cases}."""
        then = self._closed(self._sum(), "&")
        if self._taken(r"\text{otherwise}"):
            return self._closed(then, r"\end{cases}")
        self._closed(None, r"\text{if}\:")
        left = self._sum()
        strict = self._taken("<")
        right = self._sum() if strict else self._closed(None, r"\leq") or self._sum()
        self._closed(None, r"\\")
        other = self._cases()
        holds = left < right if strict else left <= right
        return self._functions["where"](holds, then, other)

    def _angle(self) -> Any:
        self._closed(None, r"{\left(")
        y, x = self._closed(self._sum(), ","), self._closed(self._sum(), r"\right)}")
        return self._functions["atan2"](y, x)

    def _group(self) -> Any:
        if not self._taken("{"):
            raise self._lost()
        return self._closed(self._sum(), "}")

    def _closed(self, value: Any, end: str) -> Any:
        if not self._taken(end):
            raise self._lost()
        return value

    def _taken(self, *words: str) -> str | None:
        self._skip()
        for word in words:
            if self._text.startswith(word, self._at):
                self._at += len(word)
                return word
        return None

    def _matched(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        found = pattern.match(self._text, self._at)
        if found:
            self._at = found.end()
        return found

    def _skip(self) -> None:
        while self._text[self._at : self._at + 1] == " ":
            self._at += 1

    def _lost(self) -> Unreadable:
        return Unreadable(repr(self._text[self._at : self._at + 40]))
