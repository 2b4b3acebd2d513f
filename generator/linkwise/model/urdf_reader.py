"""The dynamics of a URDF file; what it says beyond them is noted as ignored. Meshes are never opened."""

from collections import Counter
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from linkwise.errors import LinkwiseError
from linkwise.model import geometry as geo
from linkwise.model.description import Body, Connection, Description, Mimic
from linkwise.model.robot import Note, Rotation

UNUSED = (
    "limit",
    "dynamics",
    "safety_controller",
    "calibration",
    "visual",
    "collision",
    "transmission",
    "gazebo",
)


def read_urdf(path: Path) -> Description:
    """Read a robot; raises LinkwiseError naming the element and the mend."""
    try:
        robot = fromstring(path.read_bytes())
    except (ParseError, DefusedXmlException, UnicodeDecodeError, ValueError) as error:
        raise LinkwiseError(f"malformed XML: {error}") from None
    if robot.tag != "robot":
        raise LinkwiseError(f"the root element is <{robot.tag}>; a URDF file has <robot>")
    notes: list[Note] = []
    bodies = tuple(_body(element) for element in robot.findall("link"))
    connections = tuple(_connection(element, notes) for element in robot.findall("joint"))
    counts = Counter(element.tag for element in robot.iter() if element.tag in UNUSED)
    notes += [Note("ignored", tag, f"{count} ×") for tag, count in sorted(counts.items())]
    return Description(robot.get("name") or path.stem, bodies, connections, notes=tuple(notes))


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
    return geo.from_rpy(roll, pitch, yaw), (x, y, z)


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
    turned = geo.rotate_inertia(geo.snap(rotation), tensor)
    return Body(name, _numbers(mass, "value", "", 1, place)[0], com, turned)


def _connection(element: Element, notes: list[Note]) -> Connection:
    name = element.get("name", "")
    place = f"joint {name!r}"
    ends = []
    for role in ("parent", "child"):
        end = element.find(role)
        if end is None or not end.get("link"):
            raise LinkwiseError(f"{place} has no <{role} link=…>; name the link")
        ends.append(end.get("link", ""))
    raw, translation = _origin(element, place)
    rotation: Rotation = geo.snap(raw)
    if rotation != tuple(map(tuple, raw)):
        notes.append(Note("snapped", name, "rotation entries within 1e-12 of -1, 0, 1"))
    axis = element.find("axis")
    x, y, z = _numbers(axis, "xyz", "1 0 0", 3, place) if axis is not None else (1.0, 0.0, 0.0)
    return Connection(
        name,
        element.get("type", ""),
        *ends,
        rotation,
        translation,
        (x, y, z),
        _mimic(element, place),
    )


def _mimic(element: Element, place: str) -> Mimic | None:
    mimic = element.find("mimic")
    if mimic is None:
        return None
    return Mimic(
        mimic.get("joint", ""),
        _numbers(mimic, "multiplier", "1", 1, place)[0],
        _numbers(mimic, "offset", "0", 1, place)[0],
    )
