"""The dynamics of a URDF file; what it says beyond them is noted as ignored. Meshes are never opened."""

from collections import Counter
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import Body, Connection, Description, Mimic
from linkwise.robot.notes import LEFT_OUT, Note

USED = {
    "robot": {"link", "joint"},
    "link": {"inertial"},
    "joint": {"parent", "child", "origin", "axis", "mimic", "dynamics"},
}
"""What the dynamics use of each element; every other kind of child is noted as ignored."""

LOSSES = ("damping", "friction")


def read_urdf(path: Path) -> Description:
    """Read a robot; raises LinkwiseError naming the element and the remedy."""
    robot = _parse(path)
    if robot.tag != "robot":
        raise LinkwiseError(f"the root element is <{robot.tag}>; a URDF file has <robot>")
    links, joints = robot.findall("link"), robot.findall("joint")
    if not links:
        raise LinkwiseError("<robot> is empty: the file has no <link>; give one that describes a robot")
    bodies = tuple(_body(element) for element in links)
    connections = tuple(_connection(element) for element in joints)
    notes = _ignored([robot, *links, *joints], connections)
    return Description(robot.get("name") or path.stem, bodies, connections, notes=notes)


def root_tag(path: Path) -> str:
    """Return the root element's name; raises LinkwiseError for malformed XML."""
    return str(_parse(path).tag)


def _parse(path: Path) -> Element:
    try:
        root: Element = fromstring(path.read_bytes())
    except DefusedXmlException:
        raise LinkwiseError(
            "malformed XML: it defines entities or refers to other files; write the text out"
        ) from None
    except (ParseError, UnicodeDecodeError, ValueError) as error:
        raise LinkwiseError(f"malformed XML: {error}") from None
    return root


def _ignored(elements: list[Element], connections: tuple[Connection, ...]) -> tuple[Note, ...]:
    counts = Counter(
        str(child.tag) for element in elements for child in element if child.tag not in USED[element.tag]
    )
    counts["damping"] = sum(c.damping != 0.0 for c in connections)
    counts["friction"] = sum(c.friction != 0.0 for c in connections)
    return tuple(
        Note("ignored", what, f"{count} ×", LEFT_OUT if what in LOSSES else "")
        for what, count in sorted(counts.items())
        if count
    )


def _numbers(element: Element, key: str, default: str, count: int, place: str) -> tuple[float, ...]:
    text = element.get(key, default)
    try:
        values = tuple(float(item) for item in text.split())
    except ValueError:
        values = ()
    if len(values) != count:
        raise LinkwiseError(
            f"{place}: <{element.tag} {key}={text!r}> needs {count} number{'s' * (count > 1)}"
        )
    return values


def _origin(parent: Element, place: str) -> tuple[list[list[float]], tuple[float, float, float]]:
    origin = parent.find("origin")
    if origin is None:
        origin = Element("origin")
    roll, pitch, yaw = _numbers(origin, "rpy", "0 0 0", 3, place)
    x, y, z = _numbers(origin, "xyz", "0 0 0", 3, place)
    return transforms.from_rpy(roll, pitch, yaw), (x, y, z)


def _body(element: Element) -> Body:
    name = element.get("name", "")
    place = f"link {name!r}"
    inertial = element.find("inertial")
    if inertial is None:
        return Body(name)
    mass = inertial.find("mass")
    inertia = inertial.find("inertia")
    if mass is None:
        raise LinkwiseError(f"{place}: <inertial> has no <mass>; add it, or remove <inertial>")
    rotation, com = _origin(inertial, place)
    xx = yy = zz = xy = xz = yz = 0.0
    if inertia is not None:
        xx, yy, zz, xy, xz, yz = (
            _numbers(inertia, f"i{key}", "0", 1, place)[0] for key in ("xx", "yy", "zz", "xy", "xz", "yz")
        )
    tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    turned = transforms.rotate_inertia(transforms.snap(rotation), tensor)
    return Body(name, _numbers(mass, "value", "", 1, place)[0], com, turned)


def _connection(element: Element) -> Connection:
    name = element.get("name", "")
    place = f"joint {name!r}"
    raw, translation = _origin(element, place)
    rotation, snapped = transforms.snapped(raw)
    axis = element.find("axis")
    x, y, z = _numbers(axis, "xyz", "1 0 0", 3, place) if axis is not None else (1.0, 0.0, 0.0)
    losses = element.find("dynamics")
    if losses is None:
        losses = Element("dynamics")
    return Connection(
        name,
        element.get("type", ""),
        _end(element, "parent", place),
        _end(element, "child", place),
        rotation,
        translation,
        (x, y, z),
        _mimic(element, place),
        _numbers(losses, "damping", "0", 1, place)[0],
        _numbers(losses, "friction", "0", 1, place)[0],
        snapped,
    )


def _end(element: Element, role: str, place: str) -> str:
    end = element.find(role)
    if end is None or not end.get("link"):
        raise LinkwiseError(f"{place} has no <{role} link=…>; name the link")
    return end.get("link", "")


def _mimic(element: Element, place: str) -> Mimic | None:
    mimic = element.find("mimic")
    if mimic is None:
        return None
    return Mimic(
        mimic.get("joint", ""),
        _numbers(mimic, "multiplier", "1", 1, place)[0],
        _numbers(mimic, "offset", "0", 1, place)[0],
    )
