"""OpenSim documents: the repair of their XML, their version, components, and values of these.

Names that are read of a component are listed, so that a misspelt one is not passed over: OpenSim silently
takes the default for what it does not find. Under <axes> an axis would be another.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from linkwise.bounded_file import MIB
from linkwise.errors import LinkwiseError, within
from linkwise.escape import short
from linkwise.robot.notes import Note
from linkwise.robot.readers.osim.conversion import converted
from linkwise.robot.readers.osim.own_names import give_own_names
from linkwise.robot.readers.xml_file import parse, parse_text
from linkwise.robot.readers.xml_names import Names, names, refuse_misspelt

LARGEST = 64 * MIB
"""Largest size of a file, in bytes: models of a whole spine have hundreds of muscles."""
COMMENT = re.compile(rb"<!--.*?(?:-->|\Z)", re.DOTALL)
"""A comment; one without an end runs to the file's end, as a new try from each start would take for ever."""
BLACK = re.compile(rb"[^\n]")
CLASS_OF_CLASS = re.compile(rb"(</?\w+)::")
"""A tag such as <HuntCrossleyForce::ContactParametersSet>, which OpenSim writes and XML forbids."""

OLDEST, JOINTS_BY_THEMSELVES, SOCKETS = 20000, 30500, 30517
"""Versions: the first one read, with joints in bodies; the first with a JointSet; the first with sockets.

Versions before the first, of OpenSim 1, and between the last two, of previews of OpenSim 4 that changed the
layout many times, are read as OpenSim itself brings them to its latest.
"""
METRES = ("meters", "m", "unassigned")
"""Units of length that are metres; OpenSim writes the last where nobody has said one, and takes metres."""
CONVERTED = "brought to OpenSim's latest version by OpenSim itself"
ASSUMED_METRES = "lengths in metres, as OpenSim takes them where no unit is said"
ENDS = {
    "BodySet": ("Body",),
    "JointSet": ("Joint",),
    "ConstraintSet": ("Constraint",),
    "ForceSet": ("Force", "Spring", "Ligament", "Muscle", "_Deprecated", "Actuator"),
    "ContactGeometrySet": (),
    "MarkerSet": ("Marker",),
}
"""Ends of the tags of a set's components, for some stand among the components of others."""

BOOLEANS = {"true": True, "1": True, "false": False, "0": False}

CURVE = names("x y")
OF_TIE = names(
    "body_1 body_2 socket_body_1 socket_body_2 socket_frame1 socket_frame2 socket_frame_1 socket_frame_2 "
    "location_body_1 location_body_2 orientation_body_1 orientation_body_2 frames isEnforced isDisabled"
)
OF_TAG = {
    "Model": names("gravity length_units BodySet JointSet ConstraintSet ForceSet"),
    "Coordinate": names("default_value range clamped locked prescribed prescribed_function motion_type"),
    "PhysicalOffsetFrame": names("translation orientation socket_parent"),
    "StationDefinedFrame": names(
        "socket_point_a socket_point_b socket_point_c socket_origin_point ab_axis ab_x_ac_axis"
    ),
    "Station": names("socket_parent_frame location"),
    "SpatialTransform": names("TransformAxis"),
    "TransformAxis": names("axis coordinates function"),
    "LinearFunction": names("coefficients"),
    "PolynomialFunction": names("coefficients"),
    "Constant": names("value"),
    "MultiplierFunction": names("function scale"),
    "PiecewiseLinearFunction": CURVE,
    "CMC_Joint": names(""),
    "SMC_Joint": names(""),
    "SimmSpline": CURVE,
    "NaturalCubicSpline": CURVE,
}
"""Children that are read, and others of OpenSim's that are near one of them, by the component's tag.

Tasks of controllers are called joints, too, and have nothing that is read.
"""
OF_END = {
    "Joint": names(
        "socket_parent_frame socket_child_frame frames coordinates CoordinateSet SpatialTransform reverse "
        "parent_body location_in_parent orientation_in_parent location orientation"
    ),
    "Constraint": OF_TIE
    | names(
        "independent_coordinate_names dependent_coordinate_name scale_factor coupled_coordinates_function "
        "constant_distance line_body follower_body socket_line_body socket_follower_body line_direction_vec "
        "point_on_line point_on_follower"
    ),
}
"""Children that are read, and others near one of them, by the end of the component's tag."""


@dataclass(frozen=True)
class OsimDocument:
    """A model: its element, whether its joints are in its bodies, and notes on what was read otherwise."""

    model: Element
    has_joints_in_bodies: bool
    notes: tuple[Note, ...] = ()


def read_document(path: Path) -> OsimDocument:
    """Return the model of a file, its components with names; raises LinkwiseError naming the remedy."""
    notes: list[Note] = []
    model, version = _model(parse(path, LARGEST, as_xml))
    if _number(version) < OLDEST or JOINTS_BY_THEMSELVES <= _number(version) < SOCKETS:
        with within(f"Version {short(version)!r}"):
            model, newer = _model(parse_text(converted(path), as_xml))
        notes.append(Note("warned", name_of(model), f"Version {version}", CONVERTED))
        version = newer
    units = text_of(model, "length_units", METRES[0])
    if units.lower() not in METRES:
        raise LinkwiseError(f"the model's lengths are in {units}; give them in meters")
    if units.lower() == METRES[-1]:
        notes.append(Note("warned", name_of(model), f"length_units {units}", ASSUMED_METRES))
    refuse_misspelt_names(model)
    for components in _named_apart(model):
        notes += give_own_names(components)
    return OsimDocument(model, _number(version) < JOINTS_BY_THEMSELVES, tuple(notes))


def _model(root: Element) -> tuple[Element, str]:
    """Return the model in a document, and the document's version."""
    model = root.find("Model") if root.tag == "OpenSimDocument" else None
    if model is None:
        raise LinkwiseError(
            f"the root element is <{root.tag}>; an OpenSim model has <OpenSimDocument><Model>"
        )
    return model, root.get("Version", "")


def _number(version: str) -> int:
    """Return the number of a version, 0 for what is none."""
    return int(version) if version.isdecimal() and len(version) < 10 else 0


def _named_apart(model: Element) -> Iterator[list[Element]]:
    """Yield the bodies, the joints, the coordinates and the constraints of a model."""
    bodies = list(members(model, "BodySet"))
    in_bodies = (joint for body in bodies for holder in body.iterfind("Joint") for joint in holder)
    joints = [*members(model, "JointSet"), *in_bodies]
    yield bodies
    yield joints
    yield [one for joint in joints for one in joint.iter("Coordinate")]
    yield list(members(model, "ConstraintSet"))


def as_xml(data: bytes) -> bytes:
    """Return as XML what OpenSim reads although it is none: hyphens in comments, colons in tags, encodings.

    A repair does not change the length, so that every element keeps its place, except for another encoding.
    """
    repaired = CLASS_OF_CLASS.sub(rb"\1..", COMMENT.sub(lambda found: BLACK.sub(b" ", found[0]), data))
    try:
        repaired.decode("utf-8")
    except UnicodeDecodeError:
        if b"encoding=" not in repaired[:100] or b"UTF-8" in repaired[:100].upper():
            return repaired.decode("latin-1").encode("utf-8")
    return repaired


def members(model: Element, tag: str) -> Iterator[Element]:
    """Yield the components of a set, such as BodySet, and those of its kind among components of others."""
    found = model.find(f"{tag}/objects")
    yield from found if found is not None else ()
    for holder in model.iter("components"):
        yield from (part for part in holder if part.tag.endswith(ENDS[tag]))


def text_of(element: Element, tag: str, default: str = "") -> str:
    """Return the text of a child, or the default where it is empty or not there."""
    return (element.findtext(tag) or "").strip() or default


def numbers_of(element: Element, tag: str, default: str, place: str, count: int = 0) -> tuple[float, ...]:
    """Return the numbers of a child, or of the default where it is empty or not there.

    Raises LinkwiseError naming the place unless they are `count`; 0 allows any number of them.
    """
    text = text_of(element, tag, default)
    try:
        values = tuple(map(float, text.split()))
    except ValueError:
        values = ()
    if not values or (count and len(values) != count):
        wanted = f"{count} numbers" if count > 1 else "a number" if count else "numbers"
        raise LinkwiseError(f"{place}: <{tag}>{text}</{tag}> needs {wanted}")
    return values


def yes(element: Element, tag: str, default: bool = False) -> bool:
    """Return whether a child says true; raises LinkwiseError for neither true nor false."""
    text = text_of(element, tag, str(default))
    if text.lower() not in BOOLEANS:
        raise LinkwiseError(f"{element.tag} {name_of(element)!r}: <{tag}>{text}</{tag}> needs true or false")
    return BOOLEANS[text.lower()]


def name_of(element: Element) -> str:
    """Return the name of a component."""
    return element.get("name", "")


def refuse_misspelt_names(model: Element) -> None:
    """Raise LinkwiseError for a child whose name is near one that is read of its component."""
    for element in model.iter():
        read = _read(str(element.tag))
        for child in element if read else ():
            tag = str(child.tag)
            if tag not in read:
                refuse_misspelt(_place(element), f"<{tag}>", tag, {f"<{name}>": name for name in read})


def _read(tag: str) -> Names:
    ending = next((read for end, read in OF_END.items() if tag.endswith(end) and tag != end), names(""))
    return OF_TAG.get(tag, ending)


def _place(element: Element) -> str:
    return f"{element.tag} {name_of(element)!r}" if name_of(element) else f"<{element.tag}>"
