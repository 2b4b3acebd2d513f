"""OpenSim documents: the repair of their XML, their version, components, and values of these.

Names that are read of a component are listed, so that a misspelt one is not passed over: OpenSim silently
takes the default for what it does not find. Under <axes> an axis would be another.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

from linkwise.bounded_file import MIB
from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.robot.readers.xml_file import parse
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

Versions between the last two were written by previews of OpenSim 4, which changed the layout many times.
"""
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
        "constant_distance"
    ),
}
"""Children that are read, and others near one of them, by the end of the component's tag."""


def read_document(path: Path) -> tuple[Element, bool]:
    """Return the model, and whether its joints are in its bodies; raises LinkwiseError naming the remedy."""
    root = parse(path, LARGEST, as_xml)
    model = root.find("Model") if root.tag == "OpenSimDocument" else None
    if model is None:
        raise LinkwiseError(
            f"the root element is <{root.tag}>; an OpenSim model has <OpenSimDocument><Model>"
        )
    text = root.get("Version", "")
    version = int(text) if text.isdecimal() and len(text) < 10 else 0
    if version < OLDEST or JOINTS_BY_THEMSELVES <= version < SOCKETS:
        raise LinkwiseError(
            f"Version {short(text)!r} is not read, but {OLDEST} to {JOINTS_BY_THEMSELVES - 1} "
            f"(OpenSim 2 and 3) and from {SOCKETS} on (OpenSim 4); open the file in OpenSim 4 and save it"
        )
    units = text_of(model, "length_units", "meters")
    if units.lower() not in ("meters", "m"):
        raise LinkwiseError(f"the model's lengths are in {units}; give them in meters")
    return model, version < JOINTS_BY_THEMSELVES


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
