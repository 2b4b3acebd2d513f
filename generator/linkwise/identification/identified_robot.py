"""The identified robot: the user's own file written back, or a new URDF file of the package.

The loops of the package go into a file of constraints beside the URDF file.
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree, TreeFrame

from linkwise.errors import within
from linkwise.escape import printable
from linkwise.identification.identification_result import Identification
from linkwise.identification.own_file import NotWrittenBack, OwnFile
from linkwise.identification.own_mjcf import OwnMjcf
from linkwise.identification.own_osim import OwnOsim
from linkwise.identification.own_sdf import OwnSdf
from linkwise.identification.own_toml import OwnToml
from linkwise.identification.own_urdf import OwnUrdf
from linkwise.identification.urdf_file import lost_gravity, root_link, rpy, urdf_text
from linkwise.package.entries import JointEntry
from linkwise.package.manifest import Manifest
from linkwise.robot.read import Reader, reader_of
from linkwise.robot.readers.mjcf.reader import read_mjcf
from linkwise.robot.readers.osim.reader import read_osim
from linkwise.robot.readers.sdf.reader import read_sdf
from linkwise.robot.readers.toml.reader import read_toml
from linkwise.robot.readers.urdf.reader import read_urdf

KINDS: dict[Reader, type[OwnFile]] = {
    read_mjcf: OwnMjcf,
    read_osim: OwnOsim,
    read_sdf: OwnSdf,
    read_toml: OwnToml,
    read_urdf: OwnUrdf,
}
"""Kinds of files by the function that reads them."""


def own_file(robot: Path) -> OwnFile | None:
    """Return the robot's file that `--robot` names, or None; raise LinkwiseError where it cannot be read."""
    if not robot.is_file():
        return None
    with within(str(robot)):
        reader = reader_of(robot)
        return None if reader is None else KINDS[reader](robot, robot.read_bytes(), reader(robot))


def identified_robot(
    found: Identification, manifest: Manifest, own: OwnFile | None
) -> tuple[dict[str, bytes], tuple[str, ...]]:
    """Return the robot's files by name, and what they do not say, in words; `own` is the package's source."""
    assert manifest.tree is not None
    pi = dict(zip(found.robot.links, found.physical.pi, strict=True))
    lost = []
    if own is not None:
        try:
            written = own.identified(manifest.tree, pi, found.frictions)
            return {own.path.name: written}, tuple(own.lost(found.frictions))
        except NotWrittenBack as error:
            lost.append(f"{error}; {manifest.name}.urdf is a new file")
    urdf = urdf_text(manifest, pi, found.frictions)
    files = {f"{manifest.name}.urdf": urdf.encode()}
    if manifest.tree.tied:
        files[f"{manifest.name}.toml"] = constraint_text(manifest.tree, manifest.joints).encode()
    return files, (*lost, *filter(None, [lost_gravity(manifest.tree)]))


def constraint_text(tree: JointTree, joints: Sequence[JointEntry]) -> str:
    """Return the file for `generate ROBOT.urdf --constraints`; ties end on the URDF file's links."""
    names = [joint.name for joint in joints]
    independent = ", ".join(_text(names[k]) for k in tree.independent)
    return "\n".join(["schema = 1", f"independent = [{independent}]", *_tables(tree, names), ""])


def _tables(tree: JointTree, names: Sequence[str]) -> Iterator[str]:
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


def _end(tree: JointTree, frame: TreeFrame) -> str:
    link = root_link(tree) if frame.joint is None else tree.joints[frame.joint].link
    turn = rpy(np.array(frame.rotation)).tolist()
    return f"{{ frame = {_text(link)}, xyz = {list(frame.translation)!r}, rpy = {turn!r} }}"


def _text(name: str) -> str:
    """Return a name as the URDF file has it, in quotes."""
    return json.dumps(printable(name), ensure_ascii=False)
