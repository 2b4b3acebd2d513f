"""An OpenSim model (.osim): bodies, joints and couplings of coordinates; what else it has is noted.

Format 4 has a JointSet, and frames for the ends of joints; in format 3 each body holds its joint.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import Body, Description
from linkwise.robot.notes import Note, Omission
from linkwise.robot.readers.osim_constraints import ties, unmodelled
from linkwise.robot.readers.osim_coordinates import coordinate_rules
from linkwise.robot.readers.osim_elements import members, name_of, numbers_of, text_of, yes
from linkwise.robot.readers.osim_frames import GROUND, Frames, Placed, offset_of
from linkwise.robot.readers.osim_joints import OsimJoint
from linkwise.robot.readers.xml_file import parse
from linkwise.robot.robot import Mat3, Vec3

EARTH = "0 -9.80665 0"
GIVING = ("Muscle", "Actuator")
"""What the tags of forces end in that give the joints' torques."""
ACTING = {
    "BushingForce": "bushing",
    "FunctionBasedBushingForce": "bushing",
    "ExpressionBasedBushingForce": "bushing",
    "CoordinateLimitForce": "spring at the ends of its range",
    "SpringGeneralizedForce": "spring",
    "ExpressionBasedCoordinateForce": "spring",
    "PointToPointSpring": "spring",
    "ExpressionBasedPointToPointForce": "spring",
    "HuntCrossleyForce": "contact",
    "ElasticFoundationForce": "contact",
    "SmoothSphereHalfSpaceForce": "contact",
    "Ligament": "ligament",
    "Blankevoort1991Ligament": "ligament",
    "PrescribedForce": "force that a function of time gives",
}
"""Forces that load joints by themselves, in words."""


def read_osim(path: Path) -> Description:
    """Read a model; raises LinkwiseError naming the element and the remedy."""
    root = parse(path)
    model = root.find("Model") if root.tag == "OpenSimDocument" else None
    if model is None:
        raise LinkwiseError(
            f"the root element is <{root.tag}>; an OpenSim model has <OpenSimDocument><Model>"
        )
    units = text_of(model, "length_units", "meters")
    if units.lower() not in ("meters", "m"):
        raise LinkwiseError(f"the model's lengths are in {units}; give them in meters")
    elements = [body for body in members(model, "BodySet") if name_of(body) != GROUND]
    if not elements:
        raise LinkwiseError(f"the model {name_of(model)!r} has no <Body>; give one that has some")
    frames = Frames(model, {name_of(body) for body in elements})
    joints = list(_joints(model, elements, frames))
    rules, notes = coordinate_rules((c for joint in joints for c in joint.coordinates), model)
    return Description(
        name_of(model) or path.stem,
        (Body(GROUND), *_bodies(elements, joints)),
        tuple(joint.connection(rules) for joint in joints),
        _vector(numbers_of(model, "gravity", EARTH, "the model", 3)),
        notes=(*notes, *(note for joint in joints for note in joint.notes(rules)), *_ignored(model)),
        loops=tuple(unmodelled(model)),
        ties=tuple(ties(model, frames)),
        omissions=tuple(_forces(model)),
        ground=GROUND,
    )


def _joints(model: Element, bodies: list[Element], frames: Frames) -> Iterator[OsimJoint]:
    if model.find("JointSet") is None:
        yield from _joints_in_bodies(bodies)
        return
    for joint in members(model, "JointSet"):
        parent, child = (
            frames.found(text_of(joint, f"socket_{end}_frame"), joint) for end in ("parent", "child")
        )
        coordinates = joint.find("coordinates")
        yield OsimJoint(joint, parent, child, tuple(coordinates) if coordinates is not None else ())


def _joints_in_bodies(bodies: list[Element]) -> Iterator[OsimJoint]:
    """Joints of format 3: a body's own one leads to it from its <parent_body>."""
    for body in bodies:
        holder = body.find("Joint")
        for joint in holder if holder is not None else ():
            place = f"joint {name_of(joint)!r}"
            if yes(joint, "reverse"):
                raise LinkwiseError(f"{place} is reversed, which is not modelled; exchange its bodies")
            parent = Placed(text_of(joint, "parent_body"))
            child = Placed(name_of(body))
            yield OsimJoint(
                joint,
                parent.behind(*offset_of(joint, place, "location_in_parent", "orientation_in_parent")),
                child.behind(*offset_of(joint, place, "location", "orientation")),
                tuple(joint.iterfind("CoordinateSet/objects/Coordinate")),
            )


def _bodies(elements: Iterable[Element], joints: Iterable[OsimJoint]) -> Iterator[Body]:
    places = {joint.child.body: joint.child.translation for joint in joints}
    for element in elements:
        name = name_of(element)
        if name not in places:
            raise LinkwiseError(f"body {name!r} hangs on no joint; give it one, a FreeJoint to ground say")
        place = f"body {name!r}"
        (mass,) = numbers_of(element, "mass", "0", place, 1)
        com = _vector(numbers_of(element, "mass_center", "0 0 0", place, 3))
        yield Body(name, mass, com, _inertia(element, place), origin=transforms.minus(places[name]))


def _inertia(element: Element, place: str) -> Mat3:
    """About the centre of mass: six numbers in one element, or each in one of its own."""
    if element.find("inertia") is not None:
        xx, yy, zz, xy, xz, yz = numbers_of(element, "inertia", "0 0 0 0 0 0", place, 6)
    else:
        names = (f"inertia_{entry}" for entry in ("xx", "yy", "zz", "xy", "xz", "yz"))
        xx, yy, zz, xy, xz, yz = (numbers_of(element, name, "0", place, 1)[0] for name in names)
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def _vector(values: tuple[float, ...]) -> Vec3:
    x, y, z = values
    return x, y, z


def _forces(model: Element) -> Iterator[Omission]:
    """Forces that act by themselves."""
    for force in members(model, "ForceSet"):
        acts = yes(force, "appliesForce", True) and not yes(force, "isDisabled")
        if acts and not force.tag.endswith(GIVING):
            coordinate = text_of(force, "coordinate")
            yield Omission(
                ACTING.get(force.tag, force.tag), name_of(force), coordinate and f"on {coordinate}"
            )


def _ignored(model: Element) -> tuple[Note, ...]:
    """What of the model has no part in its dynamics, or is what gives the torques."""
    counts = Counter(force.tag for force in members(model, "ForceSet") if force.tag.endswith(GIVING))
    counts.update(part.tag for part in members(model, "ContactGeometrySet"))
    counts.update(part.tag for part in members(model, "MarkerSet"))
    return tuple(Note("ignored", what, f"{count} ×") for what, count in sorted(counts.items()))
