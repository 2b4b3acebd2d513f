"""Frames of an OpenSim model: the body that carries each, and its pose there."""

import posixpath
from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import IDENTITY, ZERO3
from linkwise.robot.readers.osim.document import name_of, numbers_of, text_of
from linkwise.robot.robot import Rotation

GROUND = "ground"
BODY, OFFSET = "Body", "PhysicalOffsetFrame"


@dataclass(frozen=True)
class Placed:
    """A frame: the body that carries it, and its pose in that body's frame."""

    body: str
    rotation: Rotation = IDENTITY
    translation: tuple[float, float, float] = ZERO3

    def behind(self, rotation: Rotation, translation: tuple[float, ...]) -> "Placed":
        """Return the frame that has this pose in this frame."""
        moved = transforms.add(self.translation, transforms.rotate(self.rotation, translation))
        return Placed(self.body, transforms.compose(self.rotation, rotation), moved)


def offset_of(
    element: Element, place: str, translation: str, orientation: str
) -> tuple[Rotation, tuple[float, ...]]:
    """Return rotation and translation from elements of these names.

    The angles are about the frame's own x, y, then z.
    """
    x, y, z = numbers_of(element, orientation, "0 0 0", place, 3)
    # Rx Ry Rz is the transpose of Rz' Ry' Rx', which turn back.
    turn = transforms.snap([list(row) for row in zip(*transforms.from_rpy(-x, -y, -z), strict=True)])
    return turn, numbers_of(element, translation, "0 0 0", place, 3)


class Frames:
    """The bodies and offset frames of a model by their paths, such as /jointset/hip_r/pelvis_offset."""

    def __init__(self, model: Element) -> None:
        self._frames: dict[str, Element] = {}
        self._paths: dict[int, str] = {}
        self._enter(model, "")

    def _enter(self, owner: Element, path: str) -> None:
        for child in owner:
            objects = child.find("objects")
            if objects is not None:
                self._name(objects, f"{path}/{child.tag.lower()}")
            elif child.tag in ("components", "frames"):
                self._name(child, path)
            elif child.tag == "Ground":
                self._enter(child, f"/{GROUND}")

    def _name(self, parts: Iterable[Element], path: str) -> None:
        for part in parts:
            own = f"{path}/{name_of(part)}"
            self._paths[id(part)] = own
            if part.tag in (BODY, OFFSET):
                self._frames[own] = part
            self._enter(part, own)

    def found(self, path: str, owner: Element, passed: tuple[str, ...] = ()) -> Placed:
        """Return the frame at a path from its owner on, or the only one of its name.

        Raises LinkwiseError where there is none, or several of the name.
        """
        whole = posixpath.normpath(posixpath.join(self._paths.get(id(owner), "/"), path))
        name = posixpath.basename(whole)
        if whole == f"/{GROUND}":
            return Placed(GROUND)
        alike = [at for at in self._frames if posixpath.basename(at) == name]
        ways = [whole] if whole in self._frames else alike
        if not ways and name == GROUND:
            return Placed(GROUND)
        if len(ways) != 1 or ways[0] in passed:
            raise LinkwiseError(
                f"{owner.tag} {name_of(owner)!r} stands in the frame {path!r}, of which there are "
                f"{len(ways)}; name a body, ground or an offset frame of one"
            )
        frame = self._frames[ways[0]]
        if frame.tag == BODY:
            return Placed(name_of(frame))
        carrier = self.found(text_of(frame, "socket_parent"), frame, (*passed, *ways))
        return carrier.behind(*offset_of(frame, f"frame {name!r}", "translation", "orientation"))
