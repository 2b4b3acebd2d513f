"""`manifest.json` of a generated package: its robot, what it was made from, and how to make it again."""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from linkwise_runtime.file_joints import FileJoint
from linkwise_runtime.rule.joint_tree import JointTree
from linkwise_runtime.structure import PassiveJoint

from linkwise.errors import LinkwiseError
from linkwise.output import sweep
from linkwise.package.checked_tree import check_curve, check_energies, check_passive, check_places, check_tree
from linkwise.package.decode import decode, parse_json, require
from linkwise.package.entries import (
    CodeSize,
    EnergiesEntry,
    FollowerEntry,
    JointEntry,
    KernelKind,
    LinkEntry,
    RuntimeEntry,
)

SCHEMA = 15
LARGEST = 1 << 28
"""Most bytes of a manifest, or of any file of a package; a manifest of a robot of 1000 joints takes some 2
MB."""
FILE = "manifest.json"
UNITS = {"angle": "rad", "length": "m", "mass": "kg", "time": "s", "torque": "N m", "force": "N"}
CONVENTIONS = {
    "decomposition": "tau_ij = sum_k c2_ijk qdd_k + sum_k c1_ijk qd_k + g_ij: joint i, link j, coordinate k",
    "velocity": "closing: c1 = 1/2 d(tau)/d(qd) of the part quadratic in the velocities",
    "indices": "in this file they count from 0; parent, and joint of a link or frame, is an index of "
    "tree.joints, None for the ground; first and second of a tie are of tree.frames; coordinate, independent "
    "and those of couplings' terms are of joints",
    "limits": "of joints: lower and upper of the position, velocity and effort either way, as the robot's "
    "file has them; null for none",
    "operations": "additions, multiplications and divisions for one sample; sines and the like apart",
    "code_size": "bytes of code and constants of all functions of a number type, those of math.h apart, as "
    "gcc -Os -DLINKWISE_SMALL makes them for a Cortex-M with a unit for that type: an estimate, to a fifth",
}


@dataclass(frozen=True)
class Manifest:
    """Contents of a package: a `tree` of rigid links, or `energies` that a user wrote, link by link.

    request: the options of `generate`; kernel: how its C computes
    followers: joints of the robot's file that are none here: they follow others, or are fixed
    file_joints: the file's joints that move, where some are several here, or Pinocchio has another order
    in_radians: joints and followers that logs have in radians, also where others are in degrees
    files: the SHA-256 of every other file, by its path in the package
    operations: those of a full decomposition
    passive: springs, damping, friction and armature of joints that have any
    formulas: by its place, such as links[2].com[0], each number of the tree that depends on run-time
    parameters, as text in their symbols
    code_size: an estimate for C on a microcontroller; None without C
    """

    name: str
    robot: str
    generator: Mapping[str, str]
    runtime: RuntimeEntry
    request: Mapping[str, Any]
    kernel: KernelKind
    joints: tuple[JointEntry, ...]
    links: tuple[LinkEntry, ...]
    followers: tuple[FollowerEntry, ...]
    file_joints: tuple[FileJoint, ...]
    in_radians: tuple[str, ...]
    operations: int
    code_size: CodeSize | None
    parameters: Mapping[str, float]
    tree: JointTree | None
    passive: tuple[PassiveJoint, ...]
    formulas: Mapping[str, str]
    energies: EnergiesEntry | None
    files: Mapping[str, str]

    def __post_init__(self) -> None:
        """Raise ValueError where entries contradict each other, or a path leads out of the package."""
        if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", self.name, re.ASCII):
            raise ValueError(f"name is {self.name[:80]!a}, which no module can be called")
        count = len(self.joints)
        if not count or not self.links:
            raise ValueError("there must be a joint and a link")
        names = {"joints": [joint.name for joint in self.joints], "links": [link.name for link in self.links]}
        for what, given in names.items():
            twice = [name for name, times in Counter(given).items() if times > 1]
            if twice:
                raise ValueError(f"{what} has {twice[0][:80]!a} twice")
        for link in self.links:
            if not all(k < count for k in link.path):
                raise ValueError(f"the path of link {link.name!r} names a joint that is not there")
        for number, follower in enumerate(self.followers):
            if follower.joint is not None and not follower.joint < count:
                raise ValueError(f"followers[{number}] follows a joint that is not there")
            check_curve(f"followers[{number}]", follower.curve)
        _check_file_joints(self.file_joints, count)
        for path, digest in self.files.items():
            if not is_inside(path) or path == FILE:
                raise ValueError(f"files has {path[:80]!a}, which is not a path of a file in the package")
            if not re.fullmatch("[0-9a-f]{64}", digest):
                raise ValueError(f"files has for {path[:80]!a} something else than a SHA-256")
        if (self.tree is None) == (self.energies is None):
            raise ValueError("there must be either a tree or energies")
        if self.tree is not None:
            check_tree(self.tree, self.joints, self.links)
            check_passive(self.tree, self.passive)
            check_places(self.tree, self.formulas)
        elif self.passive or self.formulas:
            raise ValueError("passive and formulas are of a tree, and there is none")
        if self.energies is not None:
            check_energies(self.energies, names["links"], count)

    @property
    def tied(self) -> bool:
        """True if there are constraints beside the joints."""
        if self.tree is not None:
            return self.tree.tied
        return self.energies is not None and bool(self.energies.constraints)

    def text(self) -> str:
        """Return the manifest as JSON, one entry of a list per line.

        Its `checksums` show which entry was changed by hand.
        """
        data = {"schema": SCHEMA, **asdict(self), "units": UNITS, "conventions": CONVENTIONS}
        data["checksums"] = {key: _checksum(value) for key, value in data.items() if key != "files"}
        return "{\n" + ",\n".join(f' "{key}": {_lines(value)}' for key, value in data.items()) + "\n}\n"

    @classmethod
    def read(cls, directory: Path) -> "Manifest":
        """Return the manifest of the package in `directory`; raises LinkwiseError if missing or damaged."""
        path = directory / FILE
        data = _read(path)
        schema = data.get("schema")
        if type(schema) is int and schema != SCHEMA:
            raise LinkwiseError(
                f"{path} was written by another version of linkwise (schema {schema}, this one reads "
                f"{SCHEMA}); generate the robot again"
            )
        try:
            require(schema == SCHEMA and type(schema) is int, "schema", f"the number {SCHEMA}")
            return decode(cls, data, "", also=("schema", "units", "conventions", "checksums"))
        except ValueError as error:
            raise LinkwiseError(f"{path} is damaged: {error}; generate the robot again") from error


def _check_file_joints(entries: Sequence[FileJoint], count: int) -> None:
    """Raise ValueError where joints of the file are not those of the manifest, each once."""
    if entries and sorted(k for entry in entries for k in entry.coordinates) != list(range(count)):
        raise ValueError("file_joints does not have each joint once")
    if sorted(entry.pinocchio for entry in entries) != list(range(len(entries))):
        raise ValueError("file_joints has places in Pinocchio that are not those of so many")


def altered_entries(directory: Path) -> list[str]:
    """Return faults of the entries that no file of a package determines, each in words; empty if none.

    Raises LinkwiseError where the manifest cannot be read.
    """
    data = _read(directory / FILE)
    checksums = data.get("checksums")
    known = checksums if isinstance(checksums, dict) else {}
    fixed = {"units": UNITS, "conventions": CONVENTIONS}
    return [
        f"the entry {key} of {FILE} was changed"
        for key in sorted({*known, *data} - {"files", "checksums"})
        if known.get(key) != _checksum(data.get(key)) or data.get(key) != fixed.get(key, data.get(key))
    ]


def is_too_large(file: Path) -> bool:
    """Return whether a file is larger than any of a package is: nobody reads it to its end.

    Raises OSError.
    """
    return file.stat().st_size > LARGEST


def is_inside(path: str) -> bool:
    """Return whether a path, of / and names, stays in the folder that it is relative to."""
    parts = path.split("/")
    return path.isprintable() and "\\" not in path and not {"", ".", ".."}.intersection(parts)


def _read(path: Path) -> dict[str, Any]:
    """Return the JSON object of a manifest; raises LinkwiseError if there is none, or it is not JSON."""
    if not path.is_file():
        sweep(path.parent.absolute().parent)  # a writer may have died while it took the package away
    if not path.is_file():
        raise LinkwiseError(
            f"{path.parent}: no generated robot there (no {FILE}); make one with `linkwise generate`"
            f"{', or with `linkwise.kept_package`' if path.parent.is_file() else ''}"
        )
    try:
        require(not is_too_large(path), f"the file of {path.stat().st_size} bytes", "a manifest")
        data = parse_json(path.read_text(encoding="utf-8"))
        require(isinstance(data, dict), "the whole", "an object")
    except OSError as error:
        raise LinkwiseError(f"{path} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise LinkwiseError(f"{path} is damaged: {error}; generate the robot again") from error
    entries: dict[str, Any] = data
    return entries


def _checksum(value: Any) -> str:
    """Return the hash of an entry, however its JSON is laid out."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def _lines(value: Any) -> str:
    """Return the JSON of one entry; the items of a list or object that is not empty have their own lines."""
    if isinstance(value, Mapping) and value:
        return "{\n" + ",\n".join(f"  {json.dumps(k)}: {_items(v)}" for k, v in value.items()) + "\n }"
    return _items(value)


def _items(value: Any) -> str:
    if isinstance(value, (list, tuple)) and value and isinstance(value[0], Mapping):
        return "[\n" + ",\n".join(f"  {json.dumps(item)}" for item in value) + "\n ]"
    if isinstance(value, Mapping) and len(value) > 1:
        return "{\n" + ",\n".join(f"   {json.dumps(k)}: {json.dumps(v)}" for k, v in value.items()) + "\n  }"
    return json.dumps(value)
