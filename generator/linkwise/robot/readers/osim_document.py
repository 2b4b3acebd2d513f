"""OpenSim documents: the repair of their XML, their version, and the places of components."""

import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.robot.readers.bounded import MIB
from linkwise.robot.readers.osim_elements import text_of
from linkwise.robot.readers.xml_file import parse

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
    mended = CLASS_OF_CLASS.sub(rb"\1..", COMMENT.sub(lambda found: BLACK.sub(b" ", found[0]), data))
    try:
        mended.decode("utf-8")
    except UnicodeDecodeError:
        if b"encoding=" not in mended[:100] or b"UTF-8" in mended[:100].upper():
            return mended.decode("latin-1").encode("utf-8")
    return mended


def members(model: Element, tag: str) -> Iterator[Element]:
    """Yield the components of a set, such as BodySet, and those of its kind among components of others."""
    found = model.find(f"{tag}/objects")
    yield from found if found is not None else ()
    for holder in model.iter("components"):
        yield from (part for part in holder if part.tag.endswith(ENDS[tag]))
