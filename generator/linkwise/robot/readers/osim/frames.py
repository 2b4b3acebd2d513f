"""Frames of an OpenSim model: the body that carries each, and its pose there."""

import posixpath
from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot import transforms
from linkwise.robot.description import IDENTITY, ZERO3
from linkwise.robot.readers.osim.document import name_of, numbers_of, text_of
from linkwise.robot.robot import Rotation

GROUND = "ground"
BODY, OFFSET, BY_STATIONS = "Body", "PhysicalOffsetFrame", "StationDefinedFrame"
STATION = "Station"
AXES = ("+x", "+y", "+z", "-x", "-y", "-z")


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
        self._stations: dict[str, Element] = {}
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
            if part.tag in (BODY, OFFSET, BY_STATIONS):
                self._frames[own] = part
            elif part.tag == STATION:
                self._stations[own] = part
            self._enter(part, own)

    def found(self, path: str, owner: Element, passed: tuple[str, ...] = ()) -> Placed:
        """Return the frame at a path from its owner on, or the only one of its name.

        Raises LinkwiseError where there is none, or several of the name.
        """
        whole = self._whole(path, owner)
        name = posixpath.basename(whole)
        if whole == f"/{GROUND}" or (name == GROUND and not _alike(self._frames, whole)):
            return Placed(GROUND)
        at = _only(self._frames, whole, owner, path, "frame", "a body, ground or a frame of one")
        if at in passed:
            raise LinkwiseError(f"frame {name!r} stands on itself; let it stand on a body")
        frame = self._frames[at]
        if frame.tag == BODY:
            return Placed(name_of(frame))
        if frame.tag == BY_STATIONS:
            return self._by_stations(frame, (*passed, at))
        carrier = self.found(text_of(frame, "socket_parent"), frame, (*passed, at))
        return carrier.behind(*offset_of(frame, f"frame {name!r}", "translation", "orientation"))

    def _whole(self, path: str, owner: Element) -> str:
        return posixpath.normpath(posixpath.join(self._paths.get(id(owner), "/"), path))

    def _by_stations(self, frame: Element, passed: tuple[str, ...]) -> Placed:
        """Return the frame through four stations of one body, as OpenSim's documentation defines it.

        From station a to b goes the axis `ab_axis`; a cross product with the way from a to c gives
        `ab_x_ac_axis`; the third axis makes the two right-handed. The origin is a station of its own.
        """
        place = f"frame {name_of(frame)!r}"
        names = ("point_a", "point_b", "point_c", "origin_point")
        stations = [self._station(text_of(frame, f"socket_{name}"), frame, passed) for name in names]
        if len({one.body for one in stations}) > 1:
            raise LinkwiseError(f"{place}: its stations are on several bodies; give it stations of one")
        a, b, c, origin = (np.array(one.translation) for one in stations)
        first, second = _axis(frame, "ab_axis", "+x"), _axis(frame, "ab_x_ac_axis", "+y")
        if first[0] == second[0]:
            raise LinkwiseError(f"{place}: ab_axis and ab_x_ac_axis are one axis; give two")
        rows, across = np.zeros((3, 3)), np.cross(b - a, c - a)
        for (at, sign), along in ((first, b - a), (second, across)):
            if not (size := float(np.linalg.norm(along))):
                raise LinkwiseError(f"{place}: its stations a, b, c are on one line; move one")
            rows[at] = sign * along / size
        third = 3 - first[0] - second[0]
        rows[third] = np.cross(rows[(third + 1) % 3], rows[(third + 2) % 3])
        x, y, z = origin.tolist()
        return Placed(stations[0].body, transforms.snap(rows.T.tolist()), (x, y, z))

    def _station(self, path: str, owner: Element, passed: tuple[str, ...]) -> Placed:
        wanted = "a station"
        station = self._stations[
            _only(self._stations, self._whole(path, owner), owner, path, "station", wanted)
        ]
        carrier = self.found(text_of(station, "socket_parent_frame"), station, passed)
        place = numbers_of(station, "location", "0 0 0", f"station {name_of(station)!r}", 3)
        return carrier.behind(IDENTITY, place)


def _axis(frame: Element, tag: str, usual: str) -> tuple[int, float]:
    """Return the index and the direction of an axis such as -y; raises LinkwiseError for another text."""
    text = text_of(frame, tag, usual).lower()
    text = text if text[:1] in "+-" else f"+{text}"
    if text not in AXES:
        raise LinkwiseError(f"frame {name_of(frame)!r}: <{tag}>{text}</{tag}> needs one of {listed(AXES)}")
    return "xyz".index(text[1]), 1.0 if text[0] == "+" else -1.0


def _alike(places: Iterable[str], whole: str) -> list[str]:
    """Return the places of the last name of a path; the path itself alone where it is one."""
    name = posixpath.basename(whole)
    return [whole] if whole in places else [at for at in places if posixpath.basename(at) == name]


def _only(places: Iterable[str], whole: str, owner: Element, path: str, what: str, wanted: str) -> str:
    """Return the one place of a path, or of its name; raises LinkwiseError where there is none, or more."""
    found = _alike(places, whole)
    if len(found) != 1:
        raise LinkwiseError(
            f"{owner.tag} {name_of(owner)!r} stands in the {what} {path!r}, of which there are"
            f" {len(found)}; name {wanted}"
        )
    return found[0]
