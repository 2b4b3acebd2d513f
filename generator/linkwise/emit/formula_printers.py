"""Formulas of nodes to read: as text that SymPy and Python read, and that text as LaTeX."""

import ast
from collections.abc import Mapping
from typing import cast

from linkwise.emit.printer import ATOM, PRODUCT, Printer, Text, wrapped
from linkwise.expression.expression_graph import Entry

POWER = 2.5
"""Precedence of a square, between those of products and names."""
NAMES = {"abs": "Abs"}
OWN_IN_LATEX = frozenset(("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log"))
SIGNS: dict[type[ast.AST], str] = {ast.Lt: "<", ast.LtE: r"\leq"}


class FormulaPrinter(Printer):
    """Printer of formulas in SymPy's notation."""

    def function(self, name: str) -> str:
        """Return SymPy's name of a function."""
        return NAMES.get(name, name)

    def choice(self, condition: str, then: str, other: str) -> str:
        """Return a sympy.Piecewise, or the sign that it is."""
        argument = condition.removeprefix("0.0 < ")
        if (then, other) == ("1.0", f"Piecewise((-1.0, {argument} < 0.0), (0.0, True))"):
            return f"sign({argument})"
        return f"Piecewise(({then}, {condition}), ({other}, True))"

    def print(self, entry: Entry, operands: tuple[Text, ...]) -> Text:
        """Return the text of one node; equal factors are a square."""
        if entry[0] == "select" and operands[2][1] == ATOM and operands[2][0].startswith("Piecewise("):
            text, _ = super().print(entry, operands)
            inner = f"({operands[2][0]}, True))"
            return text.replace(inner, operands[2][0].removeprefix("Piecewise(")), ATOM
        if entry[0] == "pow":
            (a, pa), (b, pb) = operands
            return f"{wrapped(a, pa, ATOM)}**{wrapped(b, pb, ATOM)}", POWER
        if entry[0] != "mul":
            return super().print(entry, operands)
        (a, pa), (b, pb) = operands
        if a == b and pa == ATOM:
            return f"{a}**2", POWER
        return f"{wrapped(a, pa, PRODUCT)}*{wrapped(b, pb, POWER)}", PRODUCT


def latex_of(text: str, symbols: Mapping[str, str]) -> str:
    """Return a formula of FormulaPrinter in LaTeX, of these symbols by their names."""
    return _Latex(symbols).text(ast.parse(text, mode="eval").body)


class _Latex:
    def __init__(self, symbols: Mapping[str, str]) -> None:
        self._symbols = symbols

    def text(self, node: ast.AST) -> str:
        """Return the LaTeX of a formula; raises ValueError for what FormulaPrinter does not write."""
        match node:
            case ast.Constant(value=value):
                return _number(cast(float, value))
            case ast.Name(id=name):
                return self._symbols[name]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"- {self._grouped(operand, ast.Add, ast.Sub)}"
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return f"{self.text(left)} + {self.text(right)}"
            case ast.BinOp(left=left, op=ast.Sub(), right=right):
                return f"{self.text(left)} - {self._grouped(right, ast.Add, ast.Sub)}"
            case ast.BinOp(left=left, op=ast.Mult(), right=right):
                factors = [self._grouped(part, ast.Add, ast.Sub, ast.USub) for part in (left, right)]
                return (r" \cdot " if factors[1][0].isdigit() else " ").join(factors)
            case ast.BinOp(left=left, op=ast.Div(), right=right):
                return rf"\frac{{{self.text(left)}}}{{{self.text(right)}}}"
            case ast.BinOp(left=base, op=ast.Pow(), right=right):
                return rf"{self._bracketed(base)}^{{{self.text(right)}}}"
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self._call(name, arguments)
        raise ValueError(f"no LaTeX is known for {ast.dump(node)[:80]}")

    def _call(self, name: str, arguments: list[ast.expr]) -> str:
        match name, arguments:
            case "Piecewise", [*pieces, ast.Tuple(elts=[other, _])]:
                rows = [*map(self._piece, pieces), rf"{self.text(other)} & \text{{otherwise}}"]
                return r"\begin{cases} " + r" \\ ".join(rows) + r" \end{cases}"
            case "sqrt", [argument]:
                return rf"\sqrt{{{self.text(argument)}}}"
            case "Abs", [argument]:
                return rf"\left|{{{self.text(argument)}}}\right|"
        function = rf"\{name}" if name in OWN_IN_LATEX else rf"\operatorname{{{name}}}"
        return rf"{function}{{\left({', '.join(map(self.text, arguments))}\right)}}"

    def _piece(self, piece: ast.expr) -> str:
        assert isinstance(piece, ast.Tuple)
        then, condition = piece.elts
        assert isinstance(condition, ast.Compare)
        sign = SIGNS[type(condition.ops[0])]
        holds = f"{self.text(condition.left)} {sign} {self.text(condition.comparators[0])}"
        return rf"{self.text(then)} & \text{{if}}\: {holds}"

    def _bracketed(self, node: ast.AST) -> str:
        text = self.text(node)
        return text if isinstance(node, ast.Name) else rf"\left({text}\right)"

    def _grouped(self, node: ast.AST, *kinds: type[ast.AST]) -> str:
        """Return a part in brackets if it is an operation of one of these kinds."""
        text = self.text(node)
        return rf"\left({text}\right)" if isinstance(getattr(node, "op", None), kinds) else text


def _number(value: float) -> str:
    mantissa, _, exponent = repr(value).partition("e")
    return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa
