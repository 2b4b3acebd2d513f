"""The user's own file of a robot, with the identified numbers in it and nothing else changed."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeAlias
from xml.parsers.expat import ExpatError

import numpy as np
from linkwise_runtime.certainty.pseudo_inertia import central_of, pseudo_inertia, pseudo_inertia_of
from linkwise_runtime.rule.joint_tree import JointTree, TreeFrame

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.identification.shared_mass import shared_mass
from linkwise.robot.description import Body, Description
from linkwise.robot.joint_types import SINGLE
from linkwise.robot.parameters import numeric

ROUNDING = 1e-14
"""Part of a link's second moments, about its body's origin and its own, that counts as rounding."""


Friction: TypeAlias = Mapping[str, Mapping[str, str]]
"""Friction by joint: `damping` and `friction`, in N m s/rad and N m, or N s/m and N, where one is not 0."""


class NotWrittenBack(LinkwiseError):
    """Reason why numbers of a file cannot be replaced in it, and how to fix that.

    The message begins with the file's name.
    """


class LinkMass(NamedTuple):
    """A link's mass, kg, its centre (3,), m, and the inertia about that (3, 3), kg m², in its axes."""

    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True)
class OwnFile(ABC):
    """A robot's file, and what its reader made of it, with numbers for formulas."""

    path: Path
    data: bytes
    description: Description
    without_friction = ", part of a joint of several axes"
    """Reason why a joint has no place for friction."""

    @abstractmethod
    def written(self, links: Mapping[str, LinkMass], friction: Friction) -> bytes:
        """Return the file with these masses and this friction; links and joints that are not named stay.

        Raises NotWrittenBack where the file's own settings prevent it.
        """

    def has_friction(self, joint: str) -> bool:
        """Return whether the file has a joint of this name with a place for friction: one of one axis."""
        return any(c.name == joint and c.type in SINGLE for c in self.description.connections)

    def not_utf8(self) -> NotWrittenBack:
        """Return the reason why a file in another encoding is not written back."""
        return NotWrittenBack(f"{self.path.name} is in another encoding than UTF-8; save it as UTF-8")

    def refuse_to_overwrite(self, out: Path) -> None:
        """Raise LinkwiseError where the file that is written back would take this one's place."""
        if (out / self.path.name).resolve() == self.path.resolve():
            raise LinkwiseError(
                f"--out {out}: {self.path.name} in it is the robot's own file; name another folder"
            )

    def identified(self, tree: JointTree, pi: Mapping[str, Array], friction: Mapping[str, Array]) -> bytes:
        """Return the file, written back; raises NotWrittenBack.

        tree: the tree of the package that was made of it
        pi: inertial parameters (10,) by its moving links
        friction: viscous and Coulomb (2,) by joint
        """
        if b"\0" in self.data:
            raise self.not_utf8()
        links = {
            link: carried
            for number, joint in enumerate(tree.joints)
            if joint.link in pi
            for link, carried in self._shared(tree, number, pi[joint.link]).items()
        }
        rubs = {}
        for joint in self.description.connections:
            if joint.name in friction and self.has_friction(joint.name):
                own = joint.passive.damping, joint.passive.friction
                found = zip(("damping", "friction"), friction[joint.name].tolist(), own, strict=True)
                rubs[joint.name] = {what: f"{new:.6g}" for what, new, old in found if new or old}
        try:
            return self.written(links, rubs)
        except ExpatError as error:
            raise NotWrittenBack(f"{self.path.name} is not quite XML ({error}); mend that") from None

    def lost(self, friction: Mapping[str, Array]) -> Iterator[str]:
        """Yield what was identified and the file written back does not say, or what its user has to do."""
        for joint, own in friction.items():
            if own.any() and not self.has_friction(joint):
                yield f"{self.path.name} has no place for the friction of {joint}{self.without_friction}"

    def _shared(self, tree: JointTree, number: int, pi: Array) -> dict[str, LinkMass]:
        """Return the mass of each of the file's links that are one rigid body, except links without mass."""
        links = {body.name: body for body in numeric(self.description).bodies if not body.invented}
        frames = [frame for frame in tree.frames if frame.joint == number and frame.name in links]
        places = [_place(frame) for frame in frames]
        own = [at @ _own(links[f.name]) @ at.T for at, f in zip(places, frames, strict=True)]
        shared = shared_mass(np.array(own), pseudo_inertia(pi))
        found = {}
        for at, j, frame in zip(places, shared, frames, strict=True):
            back = np.linalg.inv(at)
            moved = back @ j @ back.T
            # A point mass stays one: readers refuse moments that rounding leaves below 0.
            rounding = ROUNDING * float(np.trace(j[:3, :3]) + np.trace(moved[:3, :3]))
            if j.any():
                found[frame.name] = LinkMass(*central_of(moved, rounding))
        return found


def _place(frame: TreeFrame) -> Array:
    """Return the pose of a frame in its body's frame, (4, 4)."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = frame.rotation, frame.translation
    return out


def _own(body: Body) -> Array:
    """Return the pseudo-inertia (4, 4) of a link in its frame."""
    com, inertia = (np.array(part, dtype=float) for part in (body.com, body.inertia))
    return pseudo_inertia_of(float(body.mass), com, inertia)
