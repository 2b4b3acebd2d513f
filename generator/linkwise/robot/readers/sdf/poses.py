"""Poses of the links, joints and frames of an SDFormat model, in the model's axes, and its own in the world.

From version 1.7 on, poses are relative to any named frame, and frames are attached to one another; before,
links stand in the model and joints in their child.
"""

import math
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot import transforms
from linkwise.robot.description import IDENTITY, ZERO3
from linkwise.robot.robot import Rotation, Vec3

MODEL, WORLD = "__model__", "world"
PLACED = ("link", "joint", "frame")
TURNS = {"euler_rpy": 6, "quat_xyzw": 7}
"""Formats of a pose's rotation, with the count of numbers that the pose then has."""


@dataclass(frozen=True)
class Pose:
    """Rotation and position of a frame in another: x there is rotation x + translation."""

    rotation: Rotation = IDENTITY
    translation: Vec3 = ZERO3

    def times(self, inner: "Pose") -> "Pose":
        """Return a pose that is given in this frame as seen from outside."""
        shift = transforms.rotate(self.rotation, inner.translation)
        turn = transforms.compose(self.rotation, inner.rotation)
        return Pose(turn, transforms.add(self.translation, shift))

    def inverse(self) -> "Pose":
        """Return the inverse pose."""
        back = transforms.transpose(self.rotation)
        return Pose(back, transforms.minus(transforms.rotate(back, self.translation)))


class ModelPoses:
    """Poses of the frames of a model, by name."""

    def __init__(self, model: Element, version: tuple[int, int]) -> None:
        """Collect the frames; raises LinkwiseError for two of one name, and for a missing canonical link."""
        self._model, self._named, self._whole = version >= (1, 7), dict[str, Element](), model
        # Kept, as links and frames stand in chains, and each is asked for many times.
        self._poses, self._carriers = dict[int, Pose](), {WORLD: WORLD}
        for tag in PLACED:
            for element in model.findall(tag):
                name = element.get("name", "")
                if name in self._named and (self._model or self._named[name].tag == tag):
                    raise LinkwiseError(f"two of the links, joints and frames are named {name!r}; rename one")
                # Before frames had names of their own, a joint could be called like a link.
                self._named.setdefault(name if self._model or tag != "joint" else f"joint {name}", element)
        self._roots = {MODEL} if self._model else {MODEL, ""}
        self._canonical = self._canonical_link()

    def of_model(self) -> Pose:
        """Return the pose of the model in the world.

        <pose> places a frame of the model, by default its own. Raises LinkwiseError for a pose relative to
        anything else in the world.
        """
        place = place_of(self._whole)
        relative = relative_to(self._whole)
        if relative not in ("", WORLD):
            raise LinkwiseError(
                f"the pose of {place} is relative to {relative!r}; write it in the axes of the world"
            )
        placed = self._found(self._whole.get("placement_frame") or MODEL, place)
        at = pose_in(self._whole, place)
        return at if placed is None else at.times(self.of(placed).inverse())

    def of(self, element: Element) -> Pose:
        """Return the pose of a link, joint or frame in the model.

        Raises LinkwiseError for poses in a circle.
        """
        way = dict[int, Element]()
        at: Element | None = element
        while at is not None and id(at) not in self._poses:
            if id(at) in way:
                raise LinkwiseError(f"the pose of {place_of(element)} is relative to itself, in a circle")
            way[id(at)] = at
            at = self._before(at)
        found = Pose() if at is None else self._poses[id(at)]
        for key, inner in reversed(way.items()):
            found = self._poses[key] = found.times(pose_in(inner, place_of(inner)))
        return found

    def named(self, name: str, asked_by: str) -> Pose:
        """Return the pose of a frame, or of the world, by name; raises LinkwiseError where there is none."""
        if name == WORLD:
            return self.of_model().inverse()
        found = self._found(name, asked_by)
        return Pose() if found is None else self.of(found)

    def link_of(self, name: str, asked_by: str) -> str:
        """Return the link that carries a frame, the world's name for the world.

        Raises LinkwiseError where there is none.
        """
        way = set[str]()
        while (carrier := self._carriers.get(name)) is None:
            if name in way:
                raise LinkwiseError(f"{asked_by}: frame {name!r} is attached to itself, in a circle")
            way.add(name)
            element = self._found(name, asked_by)
            if element is None:
                carrier = self._canonical
            elif element.tag == "link":
                carrier = name
            else:
                is_joint = element.tag == "joint"
                name = text_of(element, "child") if is_joint else element.get("attached_to") or MODEL
                continue
            break
        self._carriers |= dict.fromkeys(way, carrier)
        return carrier

    def _before(self, element: Element) -> Element | None:
        """Return the element that an element's pose is relative to; None for the model."""
        relative, place = relative_to(element), place_of(element)
        if relative and not self._model:
            raise LinkwiseError(
                f"{place}: <pose relative_to={relative!r}> is not read in a file older than version 1.7; "
                "raise its version, or write the pose without it"
            )
        if not relative and element.tag == "joint":
            relative = text_of(element, "child")
        if not relative and element.tag == "frame":
            relative = element.get("attached_to", "")
        return self._found(relative, place) if relative else None

    def _found(self, name: str, asked_by: str) -> Element | None:
        if name in self._roots:
            return None
        if name not in self._named:
            hint = "; write nested models out" if "::" in name else ""
            near = listed(nearest_first(name, self._named))
            raise LinkwiseError(
                f"{asked_by} names {name!r}, which is no link, joint or frame here{hint}; there are {near}"
            )
        return self._named[name]

    def _canonical_link(self) -> str:
        """Return the link that the model's own frame is attached to: the first, unless the model names one.

        It is never a link that is called as the world, which no model carries.
        """
        links = [name for name, element in self._named.items() if element.tag == "link" and name != WORLD]
        named = self._whole.get("canonical_link")
        if named and named not in links:
            near = listed(nearest_first(named, links))
            raise LinkwiseError(
                f"{place_of(self._whole)} has the canonical_link {named!r}, which is not a link; "
                f"there are {near}"
            )
        return named or links[0]


def pose_in(element: Element, place: str) -> Pose:
    """Return the pose that <pose> of an element gives; raises LinkwiseError for other than its numbers."""
    pose = element.find("pose")
    if pose is None:
        return Pose()
    if pose.get("frame", ""):
        raise LinkwiseError(f"{place}: <pose frame={pose.get('frame')!r}> is obsolete; write relative_to")
    way = pose.get("rotation_format", "euler_rpy")
    if way not in TURNS:
        raise LinkwiseError(
            f"{place}: <pose rotation_format={way!r}> is not read; give the turn as {' or '.join(TURNS)}"
        )
    degrees = is_true(pose.get("degrees", ""), "<pose degrees>", place)
    x, y, z, *turn = numbers_of(pose, TURNS[way], place)
    if way == "euler_rpy":
        roll, pitch, yaw = (math.radians(e) if degrees else e for e in turn)
        return Pose(transforms.snap(transforms.from_rpy(roll, pitch, yaw)), (x, y, z))
    if degrees:
        raise LinkwiseError(
            f"{place}: <pose> has a quaternion in degrees; remove degrees, or write euler_rpy"
        )
    b, c, d, a = turn
    length = sum(e * e for e in turn) ** 0.5
    if not length:
        raise LinkwiseError(f"{place}: <pose> has a quaternion of zeros; give 0 0 0 1 for no turn")
    rotation = transforms.from_quaternion(a / length, b / length, c / length, d / length)
    return Pose(transforms.snap(rotation), (x, y, z))


def relative_to(element: Element) -> str:
    """Return the frame that <pose> of an element names; empty where it names none."""
    pose = element.find("pose")
    return "" if pose is None else pose.get("relative_to", "")


def numbers_of(element: Element, count: int, place: str) -> tuple[float, ...]:
    """Return the numbers in an element's text, zeros for an empty pose.

    Raises LinkwiseError naming the place unless they are `count`.
    """
    words = (element.text or "").split() or ["0"] * (count if element.tag == "pose" else 0)
    try:
        values = tuple(float(word) for word in words)
    except ValueError:
        values = ()
    if len(values) != count:
        raise LinkwiseError(
            f"{place}: <{element.tag}> is {(element.text or '').strip()!r}; it needs {count}"
            f" number{'s' * (count > 1)}"
        )
    return values


def numbers_in(element: Element, path: str, default: float, place: str) -> float:
    """Return the number of a child, or the default where there is none."""
    found = element.find(path)
    return default if found is None else numbers_of(found, 1, place)[0]


def text_of(element: Element, tag: str) -> str:
    """Return the text of a child, empty without it."""
    return (element.findtext(tag) or "").strip()


def is_true(text: str, what: str, place: str) -> bool:
    """Return whether a switch is on; an empty one is off, and capitals are accepted, as in SDFormat.

    Raises LinkwiseError for what switches nothing on or off.
    """
    value = text.strip().lower()
    if value not in ("", "true", "1", "false", "0"):
        raise LinkwiseError(f"{place}: {what} is {text.strip()!r}; write true or false")
    return value in ("true", "1")


def place_of(element: Element) -> str:
    """Return the element in words."""
    return f"{element.tag} {element.get('name', '')!r}"
