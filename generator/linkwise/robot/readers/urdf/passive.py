"""Springs, damping, friction and rotors that a URDF file gives its joints, with simulators' extensions.

- <dynamics damping friction> of a joint,
- Gazebo's <springStiffness> and <springReference> of <gazebo reference="JOINT">,
- Drake's <drake:rotor_inertia> and <drake:gear_ratio> of a transmission's one actuator on its one joint:
  behind a gear of ratio N a rotor's inertia counts N² times.
"""

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree.ElementTree import Element

from linkwise.robot.joint_types import SINGLE
from linkwise.robot.readers.xml_file import numbers
from linkwise.robot.robot import Passive

GAZEBO = {"springStiffness": "stiffness", "springReference": "rest"}
DRAKE = "{http://drake.mit.edu}"


class Given(NamedTuple):
    """A number of `Passive` for a joint, and the element that it was read from."""

    joint: str
    what: str
    number: float
    element: Element


def passives(robot: Element) -> dict[str, Passive]:
    """Return the passive properties of the joints of one axis, by the joints' names."""
    found: dict[str, dict[str, float]] = {}
    for given in given_numbers(robot):
        found.setdefault(given.joint, {})[given.what] = given.number
    return {joint: Passive(**numbers) for joint, numbers in found.items()}


def given_numbers(robot: Element) -> Iterator[Given]:
    """Yield every passive number that is given for joints of one axis; the number that counts comes last."""
    joints = {joint.get("name", ""): joint for joint in robot.findall("joint") if joint.get("type") in SINGLE}
    for name, joint in joints.items():
        for dynamics in joint.findall("dynamics"):
            for what in ("damping", "friction"):
                (number,) = numbers(dynamics, what, "0", 1, f"joint {name!r}")
                yield Given(name, what, number, dynamics)
    for part in robot.findall("gazebo"):
        name = part.get("reference", "")
        for element in part if name in joints else ():
            tag = str(element.tag)
            if tag in GAZEBO and (said := _number(element)) is not None:
                yield Given(name, GAZEBO[tag], said, element)
    for part in robot.findall("transmission"):
        owners, actuators = part.findall("joint"), part.findall("actuator")
        if len(owners) == len(actuators) == 1 and (name := owners[0].get("name", "")) in joints:
            yield from _rotor(name, actuators[0])


def _rotor(joint: str, actuator: Element) -> Iterator[Given]:
    rotor, gear = (actuator.find(f"{DRAKE}{tag}") for tag in ("rotor_inertia", "gear_ratio"))
    if rotor is not None:
        place = f"the transmission of joint {joint!r}"
        (inertia,) = numbers(rotor, "value", "", 1, place)
        (ratio,) = numbers(gear, "value", "", 1, place) if gear is not None else (1.0,)
        yield Given(joint, "armature", ratio * ratio * inertia, rotor)


def _number(element: Element) -> float | None:
    """Return the element's number, in its text or as an attribute; None where there is none."""
    try:
        return float((element.get("value") or element.text or "").strip())
    except ValueError:
        return None
