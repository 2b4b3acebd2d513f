"""Formulas in a file, such as "l1/2": parsed by Python's ast, never evaluated as code."""

import ast
import math
import operator
from collections.abc import Callable, Mapping

import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.robot.robot import Scalar

OPERATORS: dict[type[ast.operator], Callable[..., Scalar]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
FUNCTIONS = {"sin": math.sin, "cos": math.cos, "sqrt": math.sqrt}
ALLOWED = "write numbers, parameters, pi and + - * / **, and sin, cos, sqrt of numbers"
MAX_LENGTH = 200
MAX_POWER = 8


def parse_formula(text: str, parameters: Mapping[str, float]) -> Scalar:
    """Return the number or expression that `text` says: numbers, parameters, pi, + - * / **, sin, cos, sqrt.

    Raises LinkwiseError for a text that is too long, is not such a formula, or has no finite value.
    """
    if len(text) > MAX_LENGTH:
        raise LinkwiseError(
            f"the formula {text[:20]!r}… is longer than {MAX_LENGTH} characters; name a parameter"
        )
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise LinkwiseError(f"{text!r} is not a formula; {ALLOWED}") from None
    try:
        value = _value(tree, text, parameters)
        _check_finite(value, parameters)
    except (ZeroDivisionError, OverflowError, ValueError) as error:
        if isinstance(error, LinkwiseError):
            raise
        raise LinkwiseError(f"{text!r} has no value: {error}") from None
    return value


def _check_finite(value: Scalar, parameters: Mapping[str, float]) -> None:
    """Raise an error for a formula that the parameters' values make infinite or undefined.

    The errors are ZeroDivisionError and OverflowError, which the caller turns into a LinkwiseError.
    """
    if isinstance(value, sp.Expr):
        value = value.xreplace({symbol: sp.Float(parameters[symbol.name]) for symbol in value.free_symbols})
        if value.has(sp.zoo, sp.nan):
            raise ZeroDivisionError("division by zero")
    if not math.isfinite(float(value)):
        raise OverflowError("the result is too large")


def _value(node: ast.expr, text: str, parameters: Mapping[str, float]) -> Scalar:
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id="pi"):
            return math.pi
        case ast.Name(id=name):
            if name not in parameters:
                raise LinkwiseError(
                    f"{text!r} uses {name!r}, which is not among the parameters; add it there"
                )
            return sp.Symbol(name, real=True)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, text, parameters)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _value(operand, text, parameters)
        case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=int() as power)) if (
            0 <= power <= MAX_POWER
        ):
            return _value(left, text, parameters) ** power
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            a, b = _value(left, text, parameters), _value(right, text, parameters)
            return OPERATORS[type(op)](a, b)
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
            value = _value(argument, text, parameters)
            if isinstance(value, float):
                return FUNCTIONS[name](value)
    raise LinkwiseError(f"{text!r} is not a formula; {ALLOWED}")
