"""A manifest's rigid bodies for any values of the run-time parameters, by the formulas that it gives."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from linkwise_runtime.parameter_values import ParametricBody, faults

from linkwise.arrays import Array
from linkwise.check.compare import Result
from linkwise.oracle.formula_text import TextFormula, parameter_values
from linkwise.package.entries import PLACE, BodyEntry, RigidTree

MOMENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
VARIED = ("translation", "mass", "com", "inertia")
"""Fields of a body that may depend on parameters."""
ROUNDING = 1e-12
"""Largest difference of formulas and numbers, relative to the largest number of a vector or an inertia."""


def tree_with(tree: RigidTree, values: Mapping[str, float]) -> RigidTree:
    """Return the tree for other values of the parameters; raises Unreadable where a text is no formula."""
    given = parameter_values(values)
    found = {place: float(TextFormula(text).value(given)) for place, text in tree.formulas.items()}

    def at(place: str, value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(at(f"{place}[{i}]", item) for i, item in enumerate(value))
        return found.get(place, value)

    bodies = [
        replace(body, **{name: at(f"bodies[{b}].{name}", getattr(body, name)) for name in VARIED})
        for b, body in enumerate(tree.bodies)
    ]
    frames = [
        replace(frame, translation=at(f"frames[{f}].translation", frame.translation))
        for f, frame in enumerate(tree.frames)
    ]
    return replace(tree, gravity=at("gravity", tree.gravity), bodies=tuple(bodies), frames=tuple(frames))


def changed_values(values: Mapping[str, float], tree: RigidTree | None) -> dict[str, float]:
    """Return each value changed by up to 3 % of its own; a zero, by 1 to 3 % of the numbers beside it.

    These are the lengths, the mass or the moments of the bodies that it belongs to; 1 where there are none.
    """
    generator = np.random.default_rng(2)
    sizes = _neighbours(values, tree) if tree else {}
    return {
        name: value * generator.uniform(0.97, 1.03)
        or (sizes.get(name) or 1.0) * generator.uniform(0.01, 0.03)
        for name, value in values.items()
    }


def _neighbours(values: Mapping[str, float], tree: RigidTree) -> dict[str, float]:
    """Return, by parameter, the largest of the numbers beside it in the tree."""
    own = parameter_values({name: name for name in values})
    sizes: dict[str, float] = {}
    for place, text in tree.formulas.items():
        body = PLACE.fullmatch(place)
        numbers: Any = tree.gravity
        if body and (b := body["body"] or body["whole"]):
            entry = tree.bodies[int(b)]
            lengths = (*entry.translation, *entry.com)
            numbers = entry.inertia if "inertia" in place else entry.mass if "mass" in place else lengths
        elif body and body["frame"]:
            numbers = tree.frames[int(body["frame"])].translation
        for name in TextFormula(text).names():
            sizes[own[name]] = max(sizes.get(own[name], 0.0), float(np.abs(numbers).max()))
    return sizes


def check_numbers(name: str, tree: RigidTree, values: Mapping[str, float]) -> Result:
    """Check the tree's numbers against its formulas, for the values that it was generated with."""
    varied = tree_with(tree, values)
    wrong = [
        f"{field} of link {number.link!r}"
        for number, formula in zip(tree.bodies, varied.bodies, strict=True)
        for field in VARIED
        if not _alike(getattr(number, field), getattr(formula, field))
    ]
    wrong += [
        f"translation of frame {number.name!r}"
        for number, formula in zip(tree.frames, varied.frames, strict=True)
        if not _alike(number.translation, formula.translation)
    ]
    wrong += [] if _alike(tree.gravity, varied.gravity) else ["gravity"]
    return _result(f"{name}: formulas of the bodies give their numbers", wrong)


def check_bodies(
    name: str,
    tree: RigidTree,
    bodies: Sequence[ParametricBody],
    values: Mapping[str, float],
    unphysical: bool,
) -> Result:
    """Check the bodies that `load` looks at against the tree's formulas, for any values."""
    known = {body.link: body for body in bodies}
    wrong = []
    for b, (own, body) in enumerate(zip(tree.bodies, tree_with(tree, values).bodies, strict=True)):
        names = _names(tree, b, list(values))
        looked_at = bool(names) and not unphysical and not faults(_listed(own)).any()
        rule = known.pop(body.link, None)
        if looked_at != (rule is not None):
            wrong.append(f"link {body.link!r} is {'not ' if looked_at else ''}among them")
        elif rule is not None:
            numbers = {parameter: np.float64(value) for parameter, value in values.items()}
            found = np.array(rule.mass_and_inertia(numbers), dtype=float)
            same = _alike(body.mass, found[0]) and _alike(_listed(body)[1:], found[1:])
            if set(rule.parameters) != names or not same:
                wrong.append(f"link {body.link!r} hangs otherwise on the parameters")
    wrong += [f"link {link!r} is not in the tree" for link in known]
    return _result(f"{name}: bodies that load looks at", wrong)


def _names(tree: RigidTree, b: int, parameters: Sequence[str]) -> set[str]:
    """Return the parameters that the mass and the inertia of a body depend on."""
    place = re.compile(rf"bodies\[{b}\]\.(mass|inertia.*)")
    formulas = [TextFormula(text) for at, text in tree.formulas.items() if place.fullmatch(at)]
    used = {name for formula in formulas for name in formula.names()}
    own = parameter_values({name: name for name in parameters})
    return {own[text] for text in used}


def _listed(body: BodyEntry) -> Array:
    """Return the mass, and xx, yy, zz, xy, xz, yz of the inertia, (7,)."""
    return np.array([body.mass, *(body.inertia[i][k] for i, k in MOMENTS)])


def _alike(one: Any, other: Any) -> bool:
    a, b = np.array(one, dtype=float), np.array(other, dtype=float)
    return bool(np.abs(a - b).max() <= ROUNDING * max(np.abs(a).max(), np.abs(b).max()))


def _result(name: str, wrong: Sequence[str]) -> Result:
    return Result(name, not wrong, None, "; ".join(wrong[:3]) if wrong else "as the tree's formulas say")
