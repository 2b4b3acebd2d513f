"""formulas.txt and formulas.tex, read back as formulas and held against the reference."""

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from linkwise.check.compare import Entries, Result, Skipped, compare
from linkwise.check.latex_reader import LatexReader, Unreadable
from linkwise.check.packed_layout import IndexRows
from linkwise.check.reference import Reference
from linkwise.check.text_reader import NUMPY, TextFormula, parameter_values
from linkwise.emit.formula_symbols import MOTION, motion_symbol, parameter_symbols
from linkwise.package.load import Array, Package
from linkwise.package.manifest import Manifest

DIGITS = 1e-12
"""Numbers in these texts are rounded to twelve digits, and terms smaller than this are left out."""


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
        at = (slice(None), *rows.tau.T)
        picked, scale = reference.values["tau"][at], reference.scales["tau"][at]
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
    return {**parameter_values(parameters), **named}


def _filled(value: Any, reference: Reference) -> Array:
    return np.broadcast_to(np.asarray(value, dtype=float), len(reference.states.q))


def _text_row(formula: str) -> Callable[[Mapping[str, Any]], Any]:
    return TextFormula(formula).value


def _latex_row(manifest: Manifest) -> Callable[[str], Callable[[Mapping[str, Any]], Any]]:
    def read(formula: str) -> Callable[[Mapping[str, Any]], Any]:
        return lambda names: LatexReader(formula, _latex_symbols(manifest, names), NUMPY).value()

    return read


def _latex_symbols(manifest: Manifest, names: Mapping[str, Any]) -> dict[str, Any]:
    """Values by the LaTeX of their symbols."""
    n = len(manifest.joints)
    motion = [motion_symbol(kind, k) for kind in MOTION for k in range(1, n + 1)]
    symbols = (*motion, *parameter_symbols(list(manifest.parameters)))
    return {r"\pi": np.pi, "e": np.e, **{symbol.latex: names[symbol.text] for symbol in symbols}}
