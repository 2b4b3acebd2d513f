"""Readers of printed formulas: LaTeX with sums, products, fractions, powers and functions, and plain text."""

import ast
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np

from linkwise.extras import extra
from linkwise.package.formula_symbols import parameter_symbols


class Unreadable(Exception):
    """Error for text that is no formula; the message is the text where reading ended."""


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
        return bool(re.match(r"[+\-})\]]|\\right|$", self._text[self._at :]))

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
        function = self._matched(self.FUNCTION)
        if function:
            name = function[1] or function[2]
            if name not in self._functions:
                raise Unreadable(name)
            exponent = self._group() if self._taken("^") else 1
            return np.power(self._functions[name](self._group()), exponent)
        number = self._matched(self.NUMBER)
        if number:
            return float(number[0])
        for symbol, value in self._symbols:
            if self._taken(symbol):
                return value
        raise self._lost()

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


Functions = Mapping[str, Callable[..., Any]]

CONSTANTS = {"pi": np.pi, "E": np.e}
NUMPY_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "Abs": "abs"}
NAMES = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"),
    *("exp", "log", "sqrt", "sign", "Abs"),
)
NUMPY: Functions = {name: getattr(np, NUMPY_NAMES.get(name, name)) for name in NAMES}
"""Functions of formulas, for arrays of NumPy."""

HELD = re.compile('[ -"$-~]*')
"""Characters of formulas. Python would leave out what follows #, and read some letters as others."""

OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}


class TextFormula:
    """A formula in plain text; raises Unreadable for text that is none."""

    def __init__(self, text: str) -> None:
        if not HELD.fullmatch(text):
            raise Unreadable(repr(text[:40]))
        try:
            # Term by term, since Python's parser fails on a sum of some thousands.
            self._terms = [(sign, ast.parse(term, mode="eval").body) for sign, term in _terms(text)]
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise Unreadable(repr(text[:40])) from error

    def value(self, names: Mapping[str, Any], functions: Functions = NUMPY) -> Any:
        """Return the value for given values of its names."""
        known = {**CONSTANTS, **names}
        return sum(sign * _value(term, known, functions) for sign, term in self._terms)

    def names(self) -> set[str]:
        """Return the names that its value depends on; parameters may be called like functions."""
        nodes = [node for _, term in self._terms for node in ast.walk(term)]
        called = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
        found = {node.id for node in nodes if isinstance(node, ast.Name) and id(node) not in called}
        return found - CONSTANTS.keys()


def _terms(text: str) -> Iterator[tuple[float, str]]:
    """Yield the terms of a sum with their signs; a sign within parentheses belongs to its term."""
    depth, start, sign = 0, 0, 1.0
    for found in re.finditer(r"[()]| [+-] ", text):
        if found[0] in "()":
            depth += 1 if found[0] == "(" else -1
        elif not depth:
            yield sign, text[start : found.start()]
            start, sign = found.end(), 1.0 if found[0] == " + " else -1.0
    yield sign, text[start:]


def parameter_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values of parameters by the symbols that formulas have for them."""
    symbols = parameter_symbols(list(values))
    return {symbol.text: value for symbol, value in zip(symbols, values.values(), strict=True)}


@cache
def torch_functions() -> Functions:
    """Return the functions of formulas for tensors; raises LinkwiseError without torch."""
    torch = extra("torch")
    return {name: getattr(torch, name.lower()) for name in NAMES}


def _value(node: ast.AST, names: Mapping[str, Any], functions: Functions) -> Any:
    spine: list[ast.BinOp] = []
    while isinstance(node, ast.BinOp):  # a sum of a thousand terms leans to the left
        spine.append(node)
        node = node.left
    value = _operand(node, names, functions)
    for above in reversed(spine):
        if type(above.op) not in OPERATORS:
            raise _unreadable(above)
        try:
            value = OPERATORS[type(above.op)](value, _value(above.right, names, functions))
        except ArithmeticError as error:  # of plain numbers
            raise _unreadable(above) from error
    return value


def _operand(node: ast.AST, names: Mapping[str, Any], functions: Functions) -> Any:
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            try:
                return float(number)
            except OverflowError as error:
                raise _unreadable(node) from error
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_value(operand, names, functions))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in functions:
            return functions[name](_value(argument, names, functions))
    raise _unreadable(node)


def _unreadable(node: ast.AST) -> Unreadable:
    return Unreadable(repr(ast.unparse(node)[:40]))
