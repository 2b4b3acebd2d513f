"""Reader of URDF files; content beyond the dynamics is noted as ignored. Meshes are never opened."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, astuple
from pathlib import Path
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import Body, Connection, Description, Mimic
from linkwise.robot.joint_types import SINGLE
from linkwise.robot.notes import Note, winding
from linkwise.robot.readers.urdf.passive import passives
from linkwise.robot.readers.urdf.unmodelled import known, omissions
from linkwise.robot.readers.xml_file import numbers, parse
from linkwise.robot.readers.xml_names import ignored
from linkwise.robot.robot import NOTHING, UNLIMITED, Limits, Passive


def read_urdf(path: Path) -> Description:
    """Return the description of a robot; raises LinkwiseError naming the element and the remedy."""
    robot = parse(path)
    if robot.tag != "robot":
        raise LinkwiseError(f"the root element is <{robot.tag}>; a URDF file has <robot>")
    links, joints = robot.findall("link"), robot.findall("joint")
    if not links:
        raise LinkwiseError("<robot> is empty: the file has no <link>; give one that describes a robot")
    notes, passive = (*ignored([robot], known, "URDF"), *_winding(links, joints)), passives(robot)
    return Description(
        robot.get("name") or path.stem,
        tuple(_body(element) for element in links),
        tuple(_connection(element, passive) for element in joints),
        notes=notes,
        omissions=tuple(omissions(robot)),
        driven=_driven(robot),
    )


def root_tag(path: Path) -> str:
    """Return the root element's name; raises LinkwiseError for malformed XML."""
    return str(parse(path).tag)


def _driven(robot: Element) -> tuple[str, ...]:
    """Return the joints of transmissions, and those that ros2_control commands."""
    commanded = (
        joint for joint in robot.iterfind("ros2_control/joint") if joint.find("command_interface") is not None
    )
    return tuple(joint.get("name", "") for joint in (*robot.iterfind("transmission/joint"), *commanded))


def _origin(parent: Element, place: str) -> tuple[list[list[float]], tuple[float, float, float]]:
    origin = parent.find("origin")
    if origin is None:
        origin = Element("origin")
    if origin.get("quat_xyzw") is not None:
        raise LinkwiseError(f"{place}: <origin> has quat_xyzw=…, which is not read; write the turn as rpy")
    roll, pitch, yaw = numbers(origin, "rpy", "0 0 0", 3, place)
    x, y, z = numbers(origin, "xyz", "0 0 0", 3, place)
    return transforms.from_rpy(roll, pitch, yaw), (x, y, z)


def _winding(links: Sequence[Element], joints: Sequence[Element]) -> tuple[Note, ...]:
    """Return notes on angles of inertias, joints and ranges that look like degrees."""
    posed = {f"joint {joint.get('name')!r}": joint for joint in joints}
    posed |= {
        f"inertia of {link.get('name')!r}": inner for link in links for inner in link.findall("inertial")
    }
    turns = {
        place: numbers(origin, "rpy", "0 0 0", 3, place)
        for place, parent in posed.items()
        for origin in parent.findall("origin")
    }
    ranges = {f"range of {joint.get('name')!r}": joint for joint in joints if joint.get("type") == "revolute"}
    ends = {place: astuple(_limits(joint, place))[:2] for place, joint in ranges.items()}
    return winding(turns, ends)


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
            numbers(inertia, f"i{key}", "0", 1, place)[0] for key in ("xx", "yy", "zz", "xy", "xz", "yz")
        )
    tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    turned = transforms.rotate_inertia(transforms.snap(rotation), tensor)
    return Body(name, numbers(mass, "value", "", 1, place)[0], com, turned)


def _connection(element: Element, passive: Mapping[str, Passive]) -> Connection:
    name = element.get("name", "")
    place = f"joint {name!r}"
    raw, translation = _origin(element, place)
    rotation, snapped = transforms.snapped(raw)
    axis = element.find("axis")
    x, y, z = numbers(axis, "xyz", "1 0 0", 3, place) if axis is not None else (1.0, 0.0, 0.0)
    return Connection(
        name,
        element.get("type", ""),
        _end(element, "parent", place),
        _end(element, "child", place),
        rotation,
        translation,
        (x, y, z),
        _mimic(element, place),
        snapped,
        passive.get(name, NOTHING),
        _limits(element, place),
    )


def _limits(element: Element, place: str) -> Limits:
    """Return the limits that <limit> gives; a continuous joint has no ends, whatever stands there."""
    limit = element.find("limit")
    if limit is None or element.get("type") not in SINGLE:
        return UNLIMITED
    given = {
        what: numbers(limit, what, repr(usual), 1, place)[0] for what, usual in asdict(UNLIMITED).items()
    }
    if element.get("type") == "continuous":
        given |= {"lower": UNLIMITED.lower, "upper": UNLIMITED.upper}
    return Limits(**given)


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
        numbers(mimic, "multiplier", "1", 1, place)[0],
        numbers(mimic, "offset", "0", 1, place)[0],
    )
