"""A manifest's tree for any values of the run-time parameters, by the formulas that it gives."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from linkwise_runtime.parameter_values import ParametricBody, faults
from linkwise_runtime.rule.joint_tree import JointTree, TreeLink

from linkwise.arrays import Array
from linkwise.check.compare import Result
from linkwise.oracle.formula_text import TextFormula, parameter_values
from linkwise.package.entries import PLACE
from linkwise.package.manifest import Manifest

MOMENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
VARIED = {"joints": ("translation",), "links": ("mass", "com", "inertia"), "frames": ("translation",)}
"""Numbers of a tree's entries that may depend on parameters; gravity may too."""
ROUNDING = 1e-12
"""Largest difference of formulas and numbers, relative to the largest number of a vector or an inertia."""


def tree_with(tree: JointTree, formulas: Mapping[str, str], values: Mapping[str, float]) -> JointTree:
    """Return the tree for other values of the parameters; raises Unreadable where a text is no formula."""
    given = parameter_values(values)
    found = {place: float(TextFormula(text).value(given)) for place, text in formulas.items()}

    def at(place: str, value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(at(f"{place}[{i}]", item) for i, item in enumerate(value))
        return found.get(place, value)

    entries = {
        kind: tuple(
            replace(entry, **{name: at(f"{kind}[{number}].{name}", getattr(entry, name)) for name in names})
            for number, entry in enumerate(getattr(tree, kind))
        )
        for kind, names in VARIED.items()
    }
    return replace(tree, gravity=at("gravity", tree.gravity), **entries)


def changed_values(values: Mapping[str, float], manifest: Manifest) -> dict[str, float]:
    """Return each value changed by up to 3 % of its own; a zero, by 1 to 3 % of the numbers beside it.

    These are the lengths, the mass or the moments of the links that it belongs to; 1 where there are none.
    """
    generator = np.random.default_rng(2)
    sizes = _neighbours(values, manifest.tree, manifest.formulas) if manifest.tree else {}
    return {
        name: value * generator.uniform(0.97, 1.03)
        or (sizes.get(name) or 1.0) * generator.uniform(0.01, 0.03)
        for name, value in values.items()
    }


def _neighbours(
    values: Mapping[str, float], tree: JointTree, formulas: Mapping[str, str]
) -> dict[str, float]:
    """Return, by parameter, the largest of the numbers beside it in the tree."""
    own = parameter_values({name: name for name in values})
    sizes: dict[str, float] = {}
    for place, text in formulas.items():
        found = PLACE.fullmatch(place)
        numbers: Any = tree.gravity
        if found and found["link"]:
            link = tree.links[int(found["link"])]
            lengths = (*link.com, *tree.joints[link.joint].translation)
            numbers = link.inertia if "inertia" in place else link.mass if "mass" in place else lengths
        elif found and found["list"] == "joints":
            joint = int(found["at"])
            carried = (link.com for link in tree.links if link.joint == joint)
            numbers = (*tree.joints[joint].translation, *(x for com in carried for x in com))
        elif found and found["list"] == "frames":
            numbers = tree.frames[int(found["at"])].translation
        for name in TextFormula(text).names():
            sizes[own[name]] = max(sizes.get(own[name], 0.0), float(np.abs(numbers).max()))
    return sizes


def check_numbers(name: str, manifest: Manifest, values: Mapping[str, float]) -> Result:
    """Check the tree's numbers against its formulas, for the values that it was generated with."""
    tree = manifest.tree
    assert tree is not None
    varied = tree_with(tree, manifest.formulas, values)
    links = [tree.link_name(j) for j in range(len(tree.links))]
    names = {
        "joints": [f"joint {joint.name!r}" for joint in tree.joints],
        "links": [f"link {link!r}" for link in links],
        "frames": [f"frame {frame.name!r}" for frame in tree.frames],
    }
    wrong = [
        f"{field} of {entry}"
        for kind, fields in VARIED.items()
        for entry, number, formula in zip(
            names[kind], getattr(tree, kind), getattr(varied, kind), strict=True
        )
        for field in fields
        if not _alike(getattr(number, field), getattr(formula, field))
    ]
    wrong += [] if _alike(tree.gravity, varied.gravity) else ["gravity"]
    return _result(f"{name}: formulas of the bodies give their numbers", wrong)


def check_bodies(
    name: str,
    manifest: Manifest,
    bodies: Sequence[ParametricBody],
    values: Mapping[str, float],
    unphysical: bool,
) -> Result:
    """Check the bodies that `load` looks at against the tree's formulas, for any values."""
    tree, known, wrong = manifest.tree, {body.link: body for body in bodies}, []
    assert tree is not None
    varied = tree_with(tree, manifest.formulas, values).links
    for j, (own, body) in enumerate(zip(tree.links, varied, strict=True)):
        link, names = tree.link_name(j), _names(manifest.formulas, j, list(values))
        looked_at = bool(names) and not unphysical and not faults(_listed(own)).any()
        rule = known.pop(link, None)
        if looked_at != (rule is not None):
            wrong.append(f"link {link!r} is {'not ' if looked_at else ''}among them")
        elif rule is not None:
            numbers = {parameter: np.float64(value) for parameter, value in values.items()}
            found = np.array(rule.mass_and_inertia(numbers), dtype=float)
            same = _alike(body.mass, found[0]) and _alike(_listed(body)[1:], found[1:])
            if set(rule.parameters) != names or not same:
                wrong.append(f"link {link!r} hangs otherwise on the parameters")
    wrong += [f"link {link!r} is not in the tree" for link in known]
    return _result(f"{name}: bodies that load looks at", wrong)


def _names(formulas: Mapping[str, str], j: int, parameters: Sequence[str]) -> set[str]:
    """Return the parameters that the mass and the inertia of a link depend on."""
    place = re.compile(rf"links\[{j}\]\.(mass|inertia.*)")
    read = [TextFormula(text) for at, text in formulas.items() if place.fullmatch(at)]
    used = {name for formula in read for name in formula.names()}
    own = parameter_values({name: name for name in parameters})
    return {own[text] for text in used}


def _listed(body: TreeLink) -> Array:
    """Return the mass, and xx, yy, zz, xy, xz, yz of the inertia, (7,)."""
    return np.array([body.mass, *(body.inertia[i][k] for i, k in MOMENTS)])


def _alike(one: Any, other: Any) -> bool:
    a, b = np.array(one, dtype=float), np.array(other, dtype=float)
    return bool(np.abs(a - b).max() <= ROUNDING * max(np.abs(a).max(), np.abs(b).max()))


def _result(name: str, wrong: Sequence[str]) -> Result:
    return Result(name, not wrong, None, "; ".join(wrong[:3]) if wrong else "as the tree's formulas say")
