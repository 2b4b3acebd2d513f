"""formulas.txt and formulas.tex, read back as formulas and held against the reference."""

import ast
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from linkwise.check.compare import Entries, Result, Skipped, compare
from linkwise.check.latex_reader import LatexReader, Unreadable
from linkwise.check.packed_layout import IndexRows
from linkwise.check.reference import Reference
from linkwise.emit.formula_symbols import MOTION, motion_symbol, parameter_symbols
from linkwise.package.load import Array, Package
from linkwise.package.manifest import Manifest

DIGITS = 1e-12
"""Numbers in these texts are rounded to twelve digits, and terms smaller than this are left out."""

CONSTANTS = {"pi": np.pi, "E": np.e}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: getattr(np, spelled)
    for name, spelled in {
        **{
            name: name for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "sinh", "cosh", "tanh", "sign")
        },
        **{"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2", "Abs": "abs"},
    }.items()
}
OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.USub: np.negative,
    ast.UAdd: np.positive,
}


def check_formulas(
    package: Package,
    rows: IndexRows,
    parameters: Mapping[str, float],
    label: str,
    reference: Reference | None,
) -> Iterator[Result]:
    """One result for each text there is; a formula that cannot be read as one fails."""
    manifest, directory = package.manifest, package.directory
    texts: tuple[tuple[str, Callable[[str], Any], str], ...] = (
        ("formulas.txt", _text_row, r"^tau_(\d+)_(\d+) = (.*)$"),
        ("formulas.tex", _latex_row(manifest), r"^\\\[ \\tau_\{(\d+)(?:, ?)?(\d+)\} = (.*) \\\]$"),
    )
    for file, read, pattern in texts:
        if file not in manifest.files:
            continue
        if reference is None:
            yield Skipped(f"{file}{label}: not checked", "there is nothing to hold it against")
            continue
        text = (directory / file).read_text(encoding="utf-8")
        found = re.findall(pattern, text, re.MULTILINE)
        given = [(int(i) - 1, int(j) - 1) for i, j, _ in found]
        if given != [(i, j) for i, j in rows.tau.tolist()]:
            yield Result(
                f"{file}{label}: every tau_ij", False, None, "it lists other torques than the paths say"
            )
            continue
        names = _names(parameters, reference)
        try:
            tau = np.stack([_filled(read(formula)(names), reference) for *_, formula in found], -1)
        except Unreadable as unread:
            yield Result(f"{file}{label}: can be read", False, None, f"it holds {unread}")
            continue
        picked = reference.values["tau"][(slice(None), *rows.tau.T)]
        scale = reference.scales["tau"][tuple(rows.tau.T)]
        # Rounding of numbers with DIGITS in place of that of float64.
        entries = [Entries("entry ", tau, picked, scale)]
        yield compare(
            f"{file}{label}: tau_ij against {reference.name}",
            entries,
            reference.tolerance,
            epsilon=DIGITS / 100,
        )


def _names(parameters: Mapping[str, float], reference: Reference) -> dict[str, Any]:
    states = reference.states
    named = {
        f"{symbol}_{k + 1}": motion[:, k]
        for symbol, motion in zip(("q", "qd", "qdd"), states.motion, strict=True)
        for k in range(motion.shape[1])
    }
    symbols = parameter_symbols(list(parameters))
    shown = {symbol.text: value for symbol, value in zip(symbols, parameters.values(), strict=True)}
    return {**CONSTANTS, **shown, **named}


def _filled(value: Any, reference: Reference) -> Array:
    return np.broadcast_to(np.asarray(value, dtype=float), len(reference.states.q))


def _text_row(formula: str) -> Callable[[Mapping[str, Any]], Any]:
    try:
        tree = ast.parse(formula, mode="eval").body
    except SyntaxError as error:
        raise Unreadable(f"{formula[:40]!r}") from error
    return lambda names: _evaluated(tree, names)


def _evaluated(node: ast.AST, names: Mapping[str, Any]) -> Any:
    """Value of a formula in Python's notation; numbers, names, operators and known functions only."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_evaluated(operand, names))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_evaluated(left, names), _evaluated(right, names))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](*(_evaluated(argument, names) for argument in arguments))
    raise Unreadable(ast.unparse(node)[:40])


def _latex_row(manifest: Manifest) -> Callable[[str], Callable[[Mapping[str, Any]], Any]]:
    def read(formula: str) -> Callable[[Mapping[str, Any]], Any]:
        return lambda names: LatexReader(formula, _latex_symbols(manifest, names), FUNCTIONS).value()

    return read


def _latex_symbols(manifest: Manifest, names: Mapping[str, Any]) -> dict[str, Any]:
    """Values by the LaTeX of their symbols."""
    n = len(manifest.joints)
    motion = [motion_symbol(kind, k) for kind in MOTION for k in range(1, n + 1)]
    symbols = (*motion, *parameter_symbols(list(manifest.parameters)))
    return {r"\pi": np.pi, "e": np.e, **{symbol.latex: names[symbol.text] for symbol in symbols}}
