"""Frames of an OpenSim model: on which body each is, and where."""

from dataclasses import dataclass
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import IDENTITY, ZERO3
from linkwise.robot.readers.osim_elements import name_of, numbers_of, text_of
from linkwise.robot.robot import Rotation

GROUND = "ground"
OFFSET = "PhysicalOffsetFrame"


@dataclass(frozen=True)
class Placed:
    """A frame: the body that has it, and where it is in that one's frame."""

    body: str
    rotation: Rotation = IDENTITY
    translation: tuple[float, float, float] = ZERO3

    def behind(self, rotation: Rotation, translation: tuple[float, ...]) -> "Placed":
        """A frame that is so placed in this one."""
        moved = transforms.add(self.translation, transforms.rotate(self.rotation, translation))
        return Placed(self.body, transforms.compose(self.rotation, rotation), moved)


def offset_of(
    element: Element, place: str, translation: str, orientation: str
) -> tuple[Rotation, tuple[float, ...]]:
    """Rotation and translation of elements by these names; angles are about the frame's own x, y, then z."""
    x, y, z = numbers_of(element, orientation, "0 0 0", place, 3)
    # Rx Ry Rz is the transpose of Rz' Ry' Rx', which turn back.
    turn = transforms.snap([list(row) for row in zip(*transforms.from_rpy(-x, -y, -z), strict=True)])
    return turn, numbers_of(element, translation, "0 0 0", place, 3)


class Frames:
    """The frames of a model by name: ground, bodies, and offset frames wherever they stand."""

    def __init__(self, model: Element, bodies: set[str]) -> None:
        self._bodies = bodies
        self._offsets: dict[str, list[Element]] = {}
        for frame in model.iter(OFFSET):
            self._offsets.setdefault(name_of(frame), []).append(frame)

    def found(self, path: str, owner: Element, passed: tuple[str, ...] = ()) -> Placed:
        """The frame at the end of a path, first among those of its owner; raises LinkwiseError for none."""
        name = path.rstrip("/").rpartition("/")[2]
        own = [frame for frame in owner.iter(OFFSET) if name_of(frame) == name]
        if not own and name == GROUND:
            return Placed(GROUND)
        if not own and name in self._bodies:
            return Placed(name)
        frames = own or self._offsets.get(name, [])
        if len(frames) != 1 or name in passed:
            raise LinkwiseError(
                f"{owner.tag} {name_of(owner)!r} stands in the frame {path!r}, of which there are "
                f"{len(frames)}; name a body, ground or an offset frame of one"
            )
        carrier = self.found(text_of(frames[0], "socket_parent"), owner, (*passed, name))
        return carrier.behind(*offset_of(frames[0], f"frame {name!r}", "translation", "orientation"))
