"""Content of a URDF file beyond the dynamics of rigid bodies and what `passive` reads."""

from collections.abc import Collection, Iterator
from dataclasses import replace
from xml.etree.ElementTree import Element

from linkwise.robot.joint_types import SINGLE
from linkwise.robot.notes import Omission
from linkwise.robot.readers.urdf.passive import given_numbers
from linkwise.robot.readers.xml_file import numbers
from linkwise.robot.readers.xml_names import Known, local_name, names

LOSSES = ("damping", "friction")
"""Attributes of <dynamics>."""

ACTING = {
    "dampingFactor": "damping",  # Gazebo's, of a link's velocity
    "springStiffness": "spring",  # Gazebo's
    "motorInertia": "armature",  # of transmissions
    "rotorInertia": "armature",
    "rotor_inertia": "armature",  # Drake's
}
"""Extensions of simulators that load joints where their number is not zero."""

SWITCHES = {
    "turnGravityOff": (("true", "1"), "Gazebo's switch for gravity"),
    "gravity": (("false", "0"), "Gazebo's switch for gravity"),
    "kinematic": (("true", "1"), "Gazebo's switch for dynamics"),
    "enable_wind": (("true", "1"), "Gazebo's wind"),
}
"""Switches of Gazebo that take a link's weight away, hold the link, or push it."""

TIES = {
    "loop_joint": "joint that closes a loop",
    "linear_bushing_rpy": "bushing",  # Drake's, as those below
    "ball_constraint": "constraint",
    "distance_constraint": "constraint",
    "tendon_constraint": "constraint",
}
"""Extensions that tie links together."""

TOLD = frozenset((*ACTING, *SWITCHES, *TIES))

VOCABULARY = {
    "robot": Known(
        many=names("link joint"),
        idle=TOLD | names("material transmission gazebo sensor ros2_control frame name version"),
    ),
    "link": Known(
        once=names("inertial"),
        attributes=names("name"),
        idle=TOLD
        | names(
            "visual collision sensor contact surface collision_checking self_collision_checking self_filter "
            "type concave"
        ),
    ),
    "joint": Known(
        once=names("parent child origin axis mimic limit"),
        many=names("dynamics"),
        attributes=names("name type"),
        idle=TOLD | names("calibration safety_controller dont_collapse"),
    ),
    "inertial": Known(once=names("origin mass inertia")),
    "origin": Known(attributes=names("xyz rpy")),
    "mass": Known(attributes=names("value")),
    "inertia": Known(attributes=names("ixx iyy izz ixy ixz iyz")),
    "parent": Known(attributes=names("link")),
    "child": Known(attributes=names("link")),
    "axis": Known(attributes=names("xyz")),
    "mimic": Known(attributes=names("joint multiplier offset")),
    "dynamics": Known(attributes=names("damping friction")),
    "limit": Known(
        attributes=names("lower upper velocity effort"),
        idle=names("acceleration deceleration jerk power current command_effort gear_velocity"),
    ),
}
"""Names that are read of each element, and those known beside them."""
SEVERAL_AXES = replace(
    VOCABULARY["joint"],
    once=VOCABULARY["joint"].once - {"limit"},
    idle=VOCABULARY["joint"].idle | {"limit"},
)
"""Names of a joint that is not of one axis: its limits are not read."""


def known(element: Element) -> Known | None:
    """Return the names that URDF knows in an element; None for an unknown element."""
    several = element.tag == "joint" and element.get("type") not in SINGLE
    return SEVERAL_AXES if several else VOCABULARY.get(element.tag)


def omissions(robot: Element) -> Iterator[Omission]:
    """Yield each force and inertia that the torques leave out."""
    links = {link.get("name", "") for link in robot.findall("link")}
    for joint in robot.findall("joint"):
        name = joint.get("name", "")
        for losses in joint.findall("dynamics") if joint.get("type") not in SINGLE else ():
            for what in LOSSES:
                (number,) = numbers(losses, what, "0", 1, f"joint {name!r}")
                if number:
                    yield Omission(what, name, f"{number!r} on {joint.get('type')}", joints=(name,))
    yield from _ties(robot, links)
    read = {id(given.element) for given in given_numbers(robot)}
    for part in robot:
        if part.tag == "gazebo":
            owners = [part.get("reference", "")]
        elif part.tag == "transmission":
            owners = [joint.get("name", "") for joint in part.findall("joint")]
        else:
            owners = [part.get("name", "")] if part.tag in ("joint", "link") else []
        named = ", ".join(owners) or str(part.tag)
        bodies = tuple(owner for owner in owners if owner in links)
        joints = tuple(owner for owner in owners if owner and owner not in links)
        for what, detail in acting(part, read):
            yield Omission(what, named, detail, joints, bodies)


def _ties(robot: Element, links: Collection[str]) -> Iterator[Omission]:
    """Yield what ties links together beside the joints, with the joints and links in Gazebo's elements."""
    parts = [(part, TIES.get(local_name(part.tag))) for part in robot]
    parts += [
        (inner, f"Gazebo's {tag}")
        for part in robot.findall("gazebo")
        for tag in ("joint", "link")
        for inner in part.findall(tag)
    ]
    for part, what in parts:
        if what is not None:
            said = (text for inner in part.iter() for text in (*inner.attrib.values(), inner.text or ""))
            ends = tuple(dict.fromkeys(text.strip() for text in said if text.strip() in links))
            yield Omission(what, part.get("name") or local_name(part.tag), " to ".join(ends), bodies=ends)


def acting(part: Element, read: Collection[int] = ()) -> Iterator[tuple[str, str]]:
    """Yield what of an extension loads joints, with its value, but for elements that were `read`, by id."""
    for element in part.iter():
        if id(element) in read:
            continue
        tag = local_name(element.tag)
        text = (element.get("value") or element.text or "").strip()
        values, switched = SWITCHES.get(tag, ((), ""))
        if tag in ACTING and _number(text):
            yield ACTING[tag], text
        elif text.lower() in values:
            yield switched, ""


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
