"""Reader of printed formulas in plain text, as SymPy prints them."""

import ast
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from linkwise.extras import extra
from linkwise.package.formula_symbols import parameter_symbols


class Unreadable(Exception):
    """Error for text that is no formula; the message is the text where reading ended."""


Functions = Mapping[str, Callable[..., Any]]
CONSTANTS = {"pi": np.pi, "E": np.e}
NUMPY_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "Abs": "abs"}
NAMES = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"),
    *("exp", "log", "sqrt", "sign", "Abs"),
)
CHOICES = {"Max": operator.gt, "Min": operator.lt}
"""Functions of several arguments, and how one of them is to stand to all others."""
NUMPY: Functions = {
    **{name: getattr(np, NUMPY_NAMES.get(name, name)) for name in NAMES},
    "atan2": np.arctan2,
    "where": np.where,
}
"""Functions of formulas, for arrays of NumPy."""
DEFINED = {"log": 1.0, "sqrt": 1.0, "asin": 0.0, "acos": 0.0}
"""Functions that not every number has, and a number with a value and a slope."""
COMPARED: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}

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

    def functions(self) -> set[str]:
        """Return the names of the functions that it calls."""
        nodes = (node for _, term in self._terms for node in ast.walk(term))
        return {
            node.func.id for node in nodes if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }

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

    def where(condition: Any, then: Any, other: Any) -> Any:
        sides = (torch.as_tensor(side, dtype=torch.float64) for side in (then, other))
        return torch.where(condition, *sides)

    named = {name: getattr(torch, name.lower()) for name in NAMES}
    return named | {"where": where, "atan2": torch.atan2}


def _value(node: ast.AST, names: Mapping[str, Any], functions: Functions) -> Any:
    spine: list[ast.BinOp] = []
    while isinstance(node, ast.BinOp):  # a sum of a thousand terms leans to the left
        spine.append(node)
        node = node.left
    value = _operand(node, names, functions)
    for above in reversed(spine):
        if type(above.op) not in OPERATORS:
            raise _unreadable(above)
        kind = type(above.op)
        try:
            value = functions.get(kind.__name__, OPERATORS[kind])(
                value, _value(above.right, names, functions)
            )
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
        case ast.Call(func=ast.Name(id="atan2"), args=[y, x], keywords=[]):
            return functions["atan2"](*(_value(one, names, functions) for one in (y, x)))
        case ast.Call(func=ast.Name(id="Max" | "Min" as name), args=[one, *others], keywords=[]):
            best = _value(one, names, functions)
            for other in (_value(other, names, functions) for other in others):
                best = functions["where"](CHOICES[name](best, other), best, other)
            return best
        case ast.Call(func=ast.Name(id="Piecewise"), args=pieces, keywords=[]):
            return _piece(node, pieces, names, functions)
    raise _unreadable(node)


def _piece(node: ast.AST, pieces: Sequence[ast.AST], names: Mapping[str, Any], functions: Functions) -> Any:
    """Return the value of the first piece whose condition is true, of those that sympy.Piecewise shows."""
    match pieces:
        case [ast.Tuple(elts=[value, condition]), *others]:
            holds = _condition(condition, names, functions)
            if isinstance(holds, bool):
                chosen = value if holds else None
                return _value(chosen, names, functions) if chosen else _piece(node, others, names, functions)
            then = _value(value, names, _guarded(functions, holds))
            other = _piece(node, others, names, _guarded(functions, ~holds))
            return functions["where"](holds, then, other)
    raise _unreadable(node)


def _condition(node: ast.AST, names: Mapping[str, Any], functions: Functions) -> Any:
    match node:
        case ast.Constant(value=bool() as known):
            return known
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in COMPARED:
            return COMPARED[type(op)](_value(left, names, functions), _value(right, names, functions))
        case ast.BinOp(left=left, op=ast.BitAnd() | ast.BitOr() as op, right=right):
            sides = (_condition(side, names, functions) for side in (left, right))
            return (operator.and_ if isinstance(op, ast.BitAnd) else operator.or_)(*sides)
        case ast.Call(func=ast.Name(id="Eq" | "Ne" as name), args=[left, right], keywords=[]):
            one, other = (_value(side, names, functions) for side in (left, right))
            equal = (one <= other) & (other <= one)
            return equal if name == "Eq" else ~equal
    raise _unreadable(node)


def _guarded(functions: Functions, holds: Any) -> Functions:
    """Return functions whose arguments are harmless where a condition does not hold.

    Both sides are computed everywhere.
    """

    def guarded(function: Callable[..., Any], at: int, instead: float) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            given = list(arguments)
            given[at] = functions["where"](holds, given[at], instead)
            return function(*given)

        return call

    div = guarded(functions.get("Div", operator.truediv), 1, 1.0)
    power = guarded(functions.get("Pow", operator.pow), 0, 1.0)
    defined = {name: guarded(functions[name], 0, instead) for name, instead in DEFINED.items()}
    return {**functions, **defined, "Div": div, "Pow": power}


def _unreadable(node: ast.AST) -> Unreadable:
    return Unreadable(repr(ast.unparse(node)[:40]))
