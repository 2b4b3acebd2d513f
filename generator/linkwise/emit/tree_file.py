"""tree.py: a package's joints and what its links carry, in the numbers and formulas of its manifest."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from linkwise_runtime.rule.joint_tree import (
    JointTree,
    TreeCoupling,
    TreeCurve,
    TreeFrame,
    TreeJoint,
    TreeLink,
    TreeTie,
)
from linkwise_runtime.version import VERSION

from linkwise.escape import python_literal
from linkwise.package.formula_symbols import parameter_symbols
from linkwise.render import render

WORD = re.compile(r"\b([A-Za-z_]\w*)(\(?)")
"""Pattern of a name in a formula, and of the parenthesis after that of a function."""


@dataclass(frozen=True)
class TreeText:
    """One joint, link or frame: its name, its entries as Python expressions, and a joint's curve."""

    name: str
    entries: tuple[str, ...]
    curve: TreeCurve | None = None


def tree_text(tree: JointTree, formulas: Mapping[str, str], parameters: Sequence[str]) -> str:
    """Return tree.py, for the manifest's formulas in run-time parameters of these names."""
    expression = _expressions(parameters)
    view = {
        "version": VERSION,
        "kind": "ParametricTree" if formulas else "JointTree",
        "gravity": repr(tuple(tree.gravity)),
        "joints": [_joint(joint) for joint in tree.joints],
        "curved": any(joint.curve for joint in tree.joints),
        "links": [_link(link, tree.link_name(j)) for j, link in enumerate(tree.links)],
        "frames": [_frame(frame) for frame in tree.frames],
        "ties": [_tie(tie, tree) for tie in tree.ties],
        "couplings": [_coupling(coupling) for coupling in tree.couplings],
        "independent": repr(tree.independent) if tree.independent else "",
        "closed_position": repr(tree.closed_position),
        "records": _records(tree, bool(formulas)),
        "formulas": [(place, expression(text)) for place, text in formulas.items()],
    }
    return render("package/tree.py.j2", view)


def _joint(joint: TreeJoint) -> TreeText:
    moved = f"{joint.parent!r}", repr(joint.kind), f"{joint.coordinate}", f"{joint.ratio!r}"
    entries = python_literal(joint.link), ", ".join(moved), f"{joint.rotation!r}", f"{joint.translation!r}"
    return TreeText(python_literal(joint.name), entries, joint.curve)


def _link(link: TreeLink, name: str) -> TreeText:
    entries = f"{link.joint}", f"{link.mass!r}", f"{link.com!r}", f"{link.inertia!r}"
    return TreeText(python_literal(name), entries)


def _frame(frame: TreeFrame) -> TreeText:
    entries = f"{frame.joint!r}", f"{frame.rotation!r}", f"{frame.translation!r}"
    return TreeText(python_literal(frame.name), entries)


def _tie(tie: TreeTie, tree: JointTree) -> str:
    """Return the arguments of a TreeTie, and which frames it joins as a comment."""
    length = f", {tie.length!r}" if tie.kind == "distance" else ""
    ends = " and ".join(python_literal(tree.frames[frame].name) for frame in (tie.first, tie.second))
    named = python_literal(tie.name)
    return f"TreeTie({named}, {tie.kind!r}, {tie.first}, {tie.second}{length}),  # {ends}"


def _coupling(coupling: TreeCoupling) -> str:
    return f"TreeCoupling({python_literal(coupling.name)}, {coupling.terms!r}),"


def _records(tree: JointTree, parametric: bool) -> str:
    """Return the names that the file needs of joint_tree.py."""
    curves = [joint.curve for joint in tree.joints if joint.curve]
    optional = {"TreeCoupling": tree.couplings, "TreeTie": tree.ties, "TreeCurve": curves}
    used = [name for name, found in optional.items() if found]
    kind = "ParametricTree" if parametric else "JointTree"
    return ", ".join(sorted([kind, "TreeFrame", "TreeJoint", "TreeLink", *used]))


def _expressions(parameters: Sequence[str]) -> Callable[[str], str]:
    """Return a function that writes the manifest's formulas in Python.

    Their functions are of the namespace xp, their parameters out of p.
    """
    symbols = dict(zip((s.text for s in parameter_symbols(parameters)), parameters, strict=True))

    def word(found: re.Match[str]) -> str:
        return f"xp.{found[1].lower()}(" if found[2] else f"p[{python_literal(symbols[found[1]])}]"

    return lambda text: WORD.sub(word, text)
