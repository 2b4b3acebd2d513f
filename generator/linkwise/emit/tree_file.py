"""tree.py: a package's joints and what its links carry, in the numbers and formulas of its manifest."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from linkwise_runtime.rule.joint_tree import TreeCoupling, TreeCurve, TreeFrame, TreeTie
from linkwise_runtime.version import VERSION

from linkwise.escape import python_literal
from linkwise.package.entries import PLACE, BodyEntry, RigidTree
from linkwise.package.formula_symbols import parameter_symbols
from linkwise.render import render

WORD = re.compile(r"\b([A-Za-z_]\w*)(\(?)")
"""Pattern of a name in a formula, and of the parenthesis after that of a function."""


@dataclass(frozen=True)
class TreeText:
    """One joint, link or frame: its name, its other entries as Python expressions, and a joint's curve."""

    name: str
    entries: tuple[str, ...]
    curve: TreeCurve | None = None


def tree_text(tree: RigidTree, links: Sequence[str], parameters: Sequence[str]) -> str:
    """Return tree.py, for the names of the links that carry mass and of the run-time parameters."""
    at = {body.link: b for b, body in enumerate(tree.bodies)}
    carriers = {at[link]: j for j, link in enumerate(links)}
    expression = _expressions(parameters)
    view = {
        "version": VERSION,
        "gravity": repr(tuple(tree.gravity)),
        "joints": [_joint(body) for body in tree.bodies],
        "curved": any(body.curve for body in tree.bodies),
        "links": [_link(b, tree.bodies[b]) for b in carriers],
        "frames": [_frame(frame) for frame in tree.frames],
        "ties": [_tie(tie, tree) for tie in tree.ties],
        "couplings": [_coupling(coupling) for coupling in tree.couplings],
        "independent": repr(tree.independent) if tree.independent else "",
        "closed_position": repr(tree.closed_position),
        "records": _records(tree),
        "formulas": [
            (place, expression(text))
            for found, text in tree.formulas.items()
            for place in _place(found, carriers)
        ],
    }
    return render("package/tree.py.j2", view)


def _joint(body: BodyEntry) -> TreeText:
    placed = f"{body.rotation!r}", f"{body.translation!r}"
    moved = f"{body.parent!r}", repr(body.kind), f"{body.coordinate}", f"{body.ratio!r}"
    return TreeText(python_literal(body.joint), (", ".join(moved), *placed), body.curve)


def _link(b: int, body: BodyEntry) -> TreeText:
    return TreeText(
        python_literal(body.link), (f"{b}", f"{body.mass!r}", f"{body.com!r}", f"{body.inertia!r}")
    )


def _frame(frame: TreeFrame) -> TreeText:
    entries = f"{frame.joint!r}", f"{frame.rotation!r}", f"{frame.translation!r}"
    return TreeText(python_literal(frame.name), entries)


def _tie(tie: TreeTie, tree: RigidTree) -> str:
    """Return the arguments of a TreeTie, and which frames it joins as a comment."""
    length = f", {tie.length!r}" if tie.kind == "distance" else ""
    ends = " and ".join(python_literal(tree.frames[frame].name) for frame in (tie.first, tie.second))
    named = python_literal(tie.name)
    return f"TreeTie({named}, {tie.kind!r}, {tie.first}, {tie.second}{length}),  # {ends}"


def _coupling(coupling: TreeCoupling) -> str:
    return f"TreeCoupling({python_literal(coupling.name)}, {coupling.terms!r}),"


def _records(tree: RigidTree) -> str:
    """Return the names that the file needs of joint_tree.py."""
    curves = [body.curve for body in tree.bodies if body.curve]
    optional = {"TreeCoupling": tree.couplings, "TreeTie": tree.ties, "TreeCurve": curves}
    used = [name for name, found in optional.items() if found]
    return ", ".join(sorted(["JointTree", "TreeFrame", "TreeJoint", "TreeLink", *used]))


def _place(place: str, carriers: dict[int, int]) -> Iterator[str]:
    """Yield a place of the manifest's tree, such as bodies[2].com[0], as tree.py has it.

    There is none for what has no mass.
    """
    found = PLACE.fullmatch(place)
    body = found and (found["body"] or found["whole"])
    if not body:
        yield place
        return
    b, rest = int(body), place.partition(".")[2]
    if rest.startswith("translation"):
        yield f"joints[{b}].{rest}"
    elif b in carriers:
        yield f"links[{carriers[b]}].{rest.replace('com', 'centre')}"


def _expressions(parameters: Sequence[str]) -> Callable[[str], str]:
    """Return a function that writes the manifest's formulas in Python.

    Their functions are of the namespace xp, their parameters out of p.
    """
    symbols = dict(zip((s.text for s in parameter_symbols(parameters)), parameters, strict=True))

    def word(found: re.Match[str]) -> str:
        return f"xp.{found[1].lower()}(" if found[2] else f"p[{python_literal(symbols[found[1]])}]"

    return lambda text: WORD.sub(word, text)
