"""A package's constraints as a TOML file beside its URDF file, which cannot express loops."""

import json
from collections.abc import Iterator, Sequence

import numpy as np
from linkwise_runtime.rule.joint_tree import TreeFrame

from linkwise.escape import printable
from linkwise.identification.urdf_file import root_link, rpy
from linkwise.package.entries import JointEntry, RigidTree


def constraint_text(tree: RigidTree, joints: Sequence[JointEntry]) -> str:
    """Return the file for `generate ROBOT.urdf --constraints`; ties end on the URDF file's links."""
    names = [joint.name for joint in joints]
    independent = ", ".join(_text(names[k]) for k in tree.independent)
    return "\n".join(["schema = 1", f"independent = [{independent}]", *_tables(tree, names), ""])


def _tables(tree: RigidTree, names: Sequence[str]) -> Iterator[str]:
    for tie in tree.ties:
        yield from ("", "[[constraint]]", f"name = {_text(tie.name)}", f"type = {_text(tie.kind)}")
        yield f"first = {_end(tree, tree.frames[tie.first])}"
        yield f"second = {_end(tree, tree.frames[tie.second])}"
        if tie.kind == "distance":
            yield f"length = {tie.length!r}"
    for coupling in tree.couplings:
        yield from ("", "[[constraint]]", f"name = {_text(coupling.name)}", 'type = "coupling"')
        terms = ", ".join(f"{_text(names[k])} = {list(factors)!r}" for k, factors in coupling.terms)
        yield f"terms = {{ {terms} }}"


def _end(tree: RigidTree, frame: TreeFrame) -> str:
    link = root_link(tree) if frame.joint is None else tree.bodies[frame.joint].link
    turn = rpy(np.array(frame.rotation)).tolist()
    return f"{{ frame = {_text(link)}, xyz = {list(frame.translation)!r}, rpy = {turn!r} }}"


def _text(name: str) -> str:
    """Return a name as the URDF file has it, in quotes."""
    return json.dumps(printable(name), ensure_ascii=False)
