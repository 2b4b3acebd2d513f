"""Checks of formulas.txt and formulas.tex, read back as formulas, against the reference."""

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np
from linkwise_runtime.version import VERSION

from linkwise.arrays import Array
from linkwise.check.compare import Entries, Result, compare, skipped
from linkwise.check.subject import Subject
from linkwise.emit.formula_page import Line, formula_page
from linkwise.oracle.formula_text import NUMPY, TextFormula, Unreadable, parameter_values
from linkwise.oracle.latex_reader import LatexReader
from linkwise.oracle.reference import Reference
from linkwise.package.formula_symbols import MOTION, motion_symbol, parameter_symbols
from linkwise.package.manifest import Manifest

PATTERNS = {
    "txt": re.compile(r"^(\w+) = (.*)$", re.MULTILINE),
    "tex": re.compile(r"^\\\[ ([^=\n]*) = (.*) \\\]$", re.MULTILINE),
}
TORQUES = {
    "txt": re.compile(r"tau_(\d+)_(\d+)"),
    "tex": re.compile(r"\\tau_\{(\d+(?=,)|\d),?(\d+)\}"),
}
"""Patterns of symbols of τ_ij. In expanded LaTeX coordinates have one digit, as their number is small."""
DIGITS = 1e-12
"""Rounding of numbers in these texts, to twelve digits; what cancelling leaves below it is left out."""


def check_formulas(name: str, ending: str, subject: Subject) -> Iterator[Result]:
    """Yield the results of formulas.txt or formulas.tex; lines between the formulas count too."""
    manifest, rows = subject.manifest, subject.rows
    text = (subject.package.directory / f"formulas.{ending}").read_bytes().decode()
    found = PATTERNS[ending].findall(text)
    torques = [TORQUES[ending].fullmatch(symbol) for symbol, _ in found]
    places = [(int(t[1]) - 1, int(t[2]) - 1) for t in torques if t]
    if places != [(i, j) for i, j in rows.tau.tolist()]:
        yield Result(f"{name}: every tau_ij", False, None, "it lists other torques than the paths say")
        return
    if subject.as_generated:
        yield _lines(f"{name}: lines", manifest, ending, text, found)
    if not subject.has_numbers:
        yield skipped(f"{name}: not checked", "there is nothing to hold it against")
        return
    yield _numbers(name, ending, found, subject)


def _lines(name: str, manifest: Manifest, ending: str, text: str, found: Sequence[Line]) -> Result:
    """Compare the text with the page that linkwise makes of the same formulas."""
    version = manifest.generator.get("linkwise")
    if version != VERSION:
        return skipped(name, f"those of linkwise {version}, which is not at hand to compare with")
    joints, links = ([part.name for part in parts] for parts in (manifest.joints, manifest.links))
    method = manifest.request.get("derivation", "rule") if manifest.tree else None
    page = formula_page(ending, found, joints, links, list(manifest.parameters), method).split("\n")
    lines = zip_longest(text.split("\n"), page)
    wrong = next((number for number, (line, own) in enumerate(lines, 1) if line != own), None)
    told = (
        f"line {wrong} is not what linkwise writes there" if wrong else "beside the formulas are linkwise's"
    )
    return Result(name, not wrong, None, told)


def _numbers(name: str, ending: str, lines: Sequence[Line], subject: Subject) -> Result:
    """Compare the formulas' values with the reference; one that cannot be read as a formula fails."""
    reference = subject.reference
    names = _names(subject.parameters, reference)
    try:
        values = _values(ending, lines, names, subject.manifest)
        tau = np.stack([_filled(value, reference) for value in values], -1)
    except Unreadable as unread:
        return Result(f"{name}: can be read", False, None, f"it holds {unread}")
    at = (slice(None), *subject.rows.tau.T)
    entries = [Entries("entry ", tau, reference.values["tau"][at], reference.scales["tau"][at])]
    # The rounding is that of numbers with DIGITS, not that of float64.
    told = f"{name}: tau_ij against {reference.name}"
    return compare(told, entries, reference.tolerance, epsilon=DIGITS / 10)


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


def _values(
    ending: str, lines: Sequence[Line], names: Mapping[str, Any], manifest: Manifest
) -> Iterator[Any]:
    """Yield the torques, which lines give one after the other; raises Unreadable."""
    known = dict(names if ending == "txt" else _latex_symbols(manifest, names))
    for symbol, formula in lines:
        value = (
            TextFormula(formula).value(known)
            if ending == "txt"
            else LatexReader(formula, known, NUMPY).value()
        )
        if TORQUES[ending].fullmatch(symbol):
            yield value
        else:
            known[symbol] = value


def _latex_symbols(manifest: Manifest, names: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by the LaTeX of their symbols."""
    n = len(manifest.joints)
    motion = [motion_symbol(kind, k) for kind in MOTION for k in range(1, n + 1)]
    symbols = (*motion, *parameter_symbols(list(manifest.parameters)))
    return {r"\pi": np.pi, "e": np.e, **{symbol.latex: names[symbol.text] for symbol in symbols}}
