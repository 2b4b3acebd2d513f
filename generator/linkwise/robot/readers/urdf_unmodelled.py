"""What a URDF file says beyond the dynamics of rigid bodies and what `urdf_passive` reads."""

from collections import Counter
from collections.abc import Collection, Iterator
from xml.etree.ElementTree import Element

from linkwise.robot.joint_types import SINGLE
from linkwise.robot.notes import Note, Omission
from linkwise.robot.readers.urdf_passive import given_numbers
from linkwise.robot.readers.xml_file import numbers

USED = {
    "robot": {"link", "joint"},
    "link": {"inertial"},
    "joint": {"parent", "child", "origin", "axis", "mimic", "dynamics"},
}
"""What is read of each element, beside limits; every other kind of child is noted as ignored."""

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

WEIGHTLESS = {"turnGravityOff": ("true", "1"), "gravity": ("false", "0")}
"""Gazebo's ways to take a link's weight away."""


def ignored(elements: list[Element]) -> tuple[Note, ...]:
    """Return a note for each kind of child that loads no joint, with how often.

    So it does for numbers of <dynamics> that the format does not have: who wrote them knows what they mean.
    """
    counts = Counter(
        str(child.tag) for element in elements for child in element if child.tag not in _used(element)
    )
    counts.update(
        f"{key} of <dynamics>"
        for element in elements
        for dynamics in element.findall("dynamics")
        for key in dynamics.attrib
        if key not in LOSSES
    )
    return tuple(Note("ignored", what, f"{count} ×") for what, count in sorted(counts.items()))


def _used(element: Element) -> set[str]:
    """What is read of an element; limits are those of a joint of one axis."""
    return USED[element.tag] | ({"limit"} if element.get("type") in SINGLE else set())


def omissions(robot: Element) -> Iterator[Omission]:
    """Return each force and inertia that the torques leave out."""
    links = {link.get("name", "") for link in robot.findall("link")}
    for joint in robot.findall("joint"):
        name = joint.get("name", "")
        for losses in joint.findall("dynamics") if joint.get("type") not in SINGLE else ():
            for what in LOSSES:
                (number,) = numbers(losses, what, "0", 1, f"joint {name!r}")
                if number:
                    yield Omission(what, name, f"{number!r} on {joint.get('type')}", joints=(name,))
    read = {id(given.element) for given in given_numbers(robot)}
    for part in robot:
        if part.tag == "gazebo":
            owners = [part.get("reference", "")]
        elif part.tag == "transmission":
            owners = [joint.get("name", "") for joint in part.findall("joint")]
        else:
            owners = [part.get("name", "")] if part.tag == "joint" else []
        named = ", ".join(owners) or str(part.tag)
        bodies = tuple(owner for owner in owners if owner in links)
        joints = tuple(owner for owner in owners if owner and owner not in links)
        for what, detail in _acting(part, read):
            yield Omission(what, named, detail, joints, bodies)


def _acting(part: Element, read: Collection[int]) -> Iterator[tuple[str, str]]:
    """Return what of an extension loads joints, with its value, but for elements that were `read`, by id."""
    for element in part.iter():
        if id(element) in read:
            continue
        tag = str(element.tag).rpartition("}")[2].rpartition(":")[2]
        text = (element.get("value") or element.text or "").strip()
        if tag in ACTING and _number(text):
            yield ACTING[tag], text
        elif text.lower() in WEIGHTLESS.get(tag, ()):
            yield "Gazebo's switch for gravity", ""


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
