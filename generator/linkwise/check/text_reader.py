"""A reader of formulas in Python's notation: numbers, names, operators and known functions, nothing else."""

import ast
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np

from linkwise.check.latex_reader import Unreadable
from linkwise.emit.formula_symbols import parameter_symbols
from linkwise.extras import extra

Functions = Mapping[str, Callable[..., Any]]

CONSTANTS = {"pi": np.pi, "E": np.e}
NUMPY_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "Abs": "abs"}
NAMES = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"),
    *("exp", "log", "sqrt", "sign", "Abs"),
)
NUMPY: Functions = {name: getattr(np, NUMPY_NAMES.get(name, name)) for name in NAMES}
"""The functions of formulas, for arrays of NumPy."""

HELD = re.compile('[ -"$-~]*')
"""Characters of formulas. Python would leave out what stands behind #, and take letters for others alike."""

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
    """One formula; raises Unreadable for what is none."""

    def __init__(self, text: str) -> None:
        if not HELD.fullmatch(text):
            raise Unreadable(repr(text[:40]))
        try:
            # Term by term, since Python's parser gives up a sum of some thousands.
            self._terms = [(sign, ast.parse(term, mode="eval").body) for sign, term in _terms(text)]
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise Unreadable(repr(text[:40])) from error

    def value(self, names: Mapping[str, Any], functions: Functions = NUMPY) -> Any:
        """Value for given values of its names."""
        known = {**CONSTANTS, **names}
        return sum(sign * _value(term, known, functions) for sign, term in self._terms)

    def names(self) -> set[str]:
        """Names that its value hangs on; parameters may be called like functions."""
        nodes = [node for _, term in self._terms for node in ast.walk(term)]
        called = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
        found = {node.id for node in nodes if isinstance(node, ast.Name) and id(node) not in called}
        return found - CONSTANTS.keys()


def _terms(text: str) -> Iterator[tuple[float, str]]:
    """The terms of a sum with their signs; a sign within parentheses is a term's own."""
    depth, start, sign = 0, 0, 1.0
    for found in re.finditer(r"[()]| [+-] ", text):
        if found[0] in "()":
            depth += 1 if found[0] == "(" else -1
        elif not depth:
            yield sign, text[start : found.start()]
            start, sign = found.end(), 1.0 if found[0] == " + " else -1.0
    yield sign, text[start:]


def parameter_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of parameters by the symbols that formulas have for them."""
    symbols = parameter_symbols(list(values))
    return {symbol.text: value for symbol, value in zip(symbols, values.values(), strict=True)}


@cache
def torch_functions() -> Functions:
    """The functions of formulas for tensors; raises LinkwiseError without torch."""
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
