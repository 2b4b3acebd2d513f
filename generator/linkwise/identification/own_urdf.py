"""The user's own URDF file with the inertias and friction that were identified, and nothing else changed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linkwise.errors import LinkwiseError, within
from linkwise.identification.placed_xml import (
    Edit,
    PlacedElement,
    edited,
    placed_elements,
    with_attributes,
    with_child,
)
from linkwise.identification.pseudo_inertia import MOMENTS, central_of, pseudo_inertia, pseudo_inertia_of
from linkwise.identification.shared_mass import shared_mass
from linkwise.package.entries import FrameEntry, RigidTree
from linkwise.package.load import Array
from linkwise.robot.joint_types import SINGLE
from linkwise.robot.readers.urdf import root_tag
from linkwise.robot.transforms import from_rpy

SUFFIXES = (".urdf", ".xml")
KEYS = tuple(f"i{'xyz'[a]}{'xyz'[b]}" for a, b in MOMENTS)
"""Attributes of <inertia>, in the order of MOMENTS."""
ROUNDING = 1e-14
"""Of a link's second moments about where its body and it have their origins."""


@dataclass(frozen=True)
class OwnUrdf:
    """A robot's file as its user has it."""

    path: Path
    data: bytes

    @classmethod
    def of(cls, robot: Path) -> "OwnUrdf | None":
        """What `--robot` names, if it is a URDF file; raises LinkwiseError for one in UTF-16."""
        if not robot.is_file() or robot.suffix.lower() not in SUFFIXES:
            return None
        with within(str(robot)):
            if root_tag(robot) != "robot":
                return None
            data = robot.read_bytes()
            placed_elements(data)
        return cls(robot, data)

    def refuse_to_overwrite(self, out: Path) -> None:
        """Raise LinkwiseError where the file that is written back would take this one's place."""
        if (out / self.path.name).resolve() == self.path.resolve():
            raise LinkwiseError(
                f"--out {out}: {self.path.name} in it is the robot's own file; name another folder"
            )

    def identified(self, tree: RigidTree, pi: Mapping[str, Array], friction: Mapping[str, Array]) -> bytes:
        """The file, written back.

        tree: of the package that was made of it; pi: inertial parameters (10,) by its moving links; friction:
        viscous and Coulomb (2,) by joint
        """
        robot = placed_elements(self.data)
        links = {link.attributes.get("name"): link.first("inertial") for link in robot.every("link")}
        edits: list[Edit] = []
        for number, body in enumerate(tree.bodies):
            if body.link in pi:
                frames = [frame for frame in tree.frames if frame.body == number]
                members = [(f, own) for f in frames if (own := links.get(f.name)) is not None]
                edits += self._body(members, pi[body.link])
        for joint in robot.every("joint"):
            edits += self._friction(joint, friction)
        return edited(self.data, edits)

    def unwritten(self, friction: Mapping[str, Array]) -> tuple[str, ...]:
        """Joints whose friction has no place in the file: those that are parts of a joint of several axes."""
        joints = {_name(joint) for joint in placed_elements(self.data).every("joint") if _is_single(joint)}
        return tuple(name for name, own in friction.items() if own.any() and name not in joints)

    def _body(self, members: list[tuple[FrameEntry, PlacedElement]], pi: Array) -> Iterator[Edit]:
        """New inertias for the links of one rigid body."""
        places = [_place(frame) for frame, _ in members]
        own = [at @ _own(inertial) @ at.T for at, (_, inertial) in zip(places, members, strict=True)]
        for at, j, (_, inertial) in zip(
            places, shared_mass(np.array(own), pseudo_inertia(pi)), members, strict=True
        ):
            back = np.linalg.inv(at)
            moved = back @ j @ back.T
            # A point of mass stays one: readers refuse moments that rounding leaves below 0.
            rounding = ROUNDING * float(np.trace(j[:3, :3]) + np.trace(moved[:3, :3]))
            yield from self._inertial(inertial, moved, rounding)

    def _inertial(self, inertial: PlacedElement, j: Array, rounding: float) -> Iterator[Edit]:
        """New numbers of an <inertial>, in the axes that it has."""
        if not j.any():
            return
        mass, com, inertia = central_of(j, rounding)
        turn = _turn(inertial)
        turned = turn.T @ inertia @ turn
        values = {
            "origin": {"xyz": " ".join(map(repr, com.tolist()))},
            "mass": {"value": repr(mass)},
            "inertia": {key: repr(float(turned[at])) for key, at in zip(KEYS, MOMENTS, strict=True)},
        }
        for tag, attributes in values.items():
            if (element := inertial.first(tag)) is not None:
                yield from with_attributes(self.data, element, attributes)
            else:
                yield with_child(self.data, inertial, tag, attributes)

    def _friction(self, joint: PlacedElement, friction: Mapping[str, Array]) -> Iterator[Edit]:
        """New numbers of <dynamics>, where it has them or they are not 0."""
        if not _is_single(joint) or (name := _name(joint)) not in friction:
            return
        there = joint.every("dynamics")
        own = zip(("damping", "friction"), friction[name].tolist(), strict=True)
        said = there[-1].attributes if there else {}
        values = {key: f"{value:.6g}" for key, value in own if value or key in said}
        if there:
            yield from with_attributes(self.data, there[-1], values)
        elif values:
            yield with_child(self.data, joint, "dynamics", values)


def _name(element: PlacedElement) -> str:
    return element.attributes.get("name", "")


def _is_single(joint: PlacedElement) -> bool:
    """Whether a joint has one axis, and so friction."""
    return joint.attributes.get("type") in SINGLE


def _place(frame: FrameEntry) -> Array:
    """The frame in its body's, (4, 4)."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = frame.rotation, frame.translation
    return out


def _numbers(element: PlacedElement | None, key: str) -> Array:
    text = "" if element is None else element.attributes.get(key, "")
    return np.array(text.split() or (0.0, 0.0, 0.0), dtype=float)


def _turn(inertial: PlacedElement) -> Array:
    """From the axes of an <inertial> to its link's."""
    return np.array(from_rpy(*_numbers(inertial.first("origin"), "rpy").tolist()))


def _own(inertial: PlacedElement) -> Array:
    """The pseudo-inertia of an <inertial> in its link's frame."""
    mass, inertia, turn = inertial.first("mass"), inertial.first("inertia"), _turn(inertial)
    tensor = np.zeros((3, 3))
    for key, (a, b) in zip(KEYS, MOMENTS, strict=True):
        said = "0" if inertia is None else inertia.attributes.get(key, "0")
        tensor[a, b] = tensor[b, a] = float(said)
    kilograms = 0.0 if mass is None else float(mass.attributes["value"])
    return pseudo_inertia_of(kilograms, _numbers(inertial.first("origin"), "xyz"), turn @ tensor @ turn.T)
