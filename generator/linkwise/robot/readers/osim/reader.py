"""Reader of OpenSim models (.osim): bodies, joints and couplings of coordinates; other content is noted.

OpenSim 4 writes a JointSet, and frames for the ends of joints; before it each body held its joint.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import ZERO33, Body, Description
from linkwise.robot.notes import Note, Omission
from linkwise.robot.readers.osim.constraints import coordinate_rules, ties, unmodelled, with_idle_held
from linkwise.robot.readers.osim.document import (
    members,
    name_of,
    numbers_of,
    read_document,
    text_of,
    yes,
)
from linkwise.robot.readers.osim.frames import GROUND, Frames, Placed, offset_of
from linkwise.robot.readers.osim.joints import OsimJoint, from_ground
from linkwise.robot.readers.osim.parted_bodies import with_parted_bodies
from linkwise.robot.readers.osim.point_on_line import sliders
from linkwise.robot.readers.xml_names import Known, ignored, names
from linkwise.robot.robot import Mat3, Vec3

EARTH = "0 -9.80665 0"
ENTRIES = ("xx", "yy", "zz", "xy", "xz", "yz")
ACTING = {
    "BushingForce": "bushing",
    "FunctionBasedBushingForce": "bushing",
    "ExpressionBasedBushingForce": "bushing",
    "CoordinateLimitForce": "spring at the ends of its range",
    "SpringGeneralizedForce": "spring",
    "ExpressionBasedCoordinateForce": "spring",
    "PointToPointSpring": "spring",
    "PathSpring": "spring",
    "ExpressionBasedPointToPointForce": "spring",
    "HuntCrossleyForce": "contact",
    "ElasticFoundationForce": "contact",
    "SmoothSphereHalfSpaceForce": "contact",
    "Ligament": "ligament",
    "Blankevoort1991Ligament": "ligament",
    "PrescribedForce": "force that a function of time gives",
}
"""Forces that load joints by themselves, in words."""

BODY = Known(
    once=names("mass mass_center inertia Joint") | names(" ".join(f"inertia_{entry}" for entry in ENTRIES)),
    attributes=names("name"),
    idle=names("components FrameGeometry attached_geometry WrapObjectSet VisibleObject"),
)
"""Names that are read of a body, and those that are known beside them."""


def read_osim(path: Path) -> Description:
    """Return the description of a model; raises LinkwiseError naming the element and the remedy."""
    document = read_document(path)
    model = document.model
    elements = [body for body in members(model, "BodySet") if name_of(body) != GROUND]
    if not elements:
        raise LinkwiseError(f"the model {name_of(model)!r} has no <Body>; give one that has some")
    others, frames = ignored(elements, _known, "OpenSim's Body"), Frames(model)
    written = _joints_in_bodies(elements) if document.has_joints_in_bodies else _joints(model, frames)
    parted = with_parted_bodies(from_ground(written), {name_of(body) for body in elements})
    joints = parted.joints
    rules, notes = coordinate_rules((c for joint in joints for c in joint.coordinates), model)
    sliding = tuple(sliders(model, frames))
    rules, held = with_idle_held(rules, (one for joint in joints for one in joint.idle()))
    return Description(
        name_of(model) or path.stem,
        (Body(GROUND), *parted.bodies(_bodies(elements, joints)), *(one.body for one in sliding)),
        (*(joint.connection(rules) for joint in joints), *(one.joint for one in sliding)),
        _vector(numbers_of(model, "gravity", EARTH, "the model", 3)),
        notes=(
            *document.notes,
            *notes,
            *held,
            *parted.notes(),
            *(note for joint in joints for note in joint.notes(rules)),
            *_ignored(model),
            *others,
        ),
        loops=tuple(unmodelled(model)),
        ties=(*ties(model, frames), *parted.welds(), *(one.tie for one in sliding)),
        omissions=tuple(_forces(model)),
        ground=GROUND,
        takes_impossible=True,
        massless=tuple(one.joint.name for one in sliding),
    )


def _joints(model: Element, frames: Frames) -> Iterator[OsimJoint]:
    for joint in members(model, "JointSet"):
        parent, child = (
            frames.found(text_of(joint, f"socket_{end}_frame"), joint) for end in ("parent", "child")
        )
        coordinates = joint.find("coordinates")
        yield OsimJoint(joint, parent, child, tuple(coordinates) if coordinates is not None else ())


def _joints_in_bodies(bodies: list[Element]) -> Iterator[OsimJoint]:
    """Yield the joints as before OpenSim 4: a body's own one leads to it from its <parent_body>."""
    for body in bodies:
        holder = body.find("Joint")
        for joint in holder if holder is not None else ():
            place = f"joint {name_of(joint)!r}"
            parent = Placed(text_of(joint, "parent_body"))
            child = Placed(name_of(body))
            yield OsimJoint(
                joint,
                parent.behind(*offset_of(joint, place, "location_in_parent", "orientation_in_parent")),
                child.behind(*offset_of(joint, place, "location", "orientation")),
                tuple(joint.iterfind("CoordinateSet/objects/Coordinate")),
                yes(joint, "reverse"),
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
        inertia = _inertia(element, place) if mass else ZERO33  # as OpenSim takes it
        yield Body(name, mass, com, inertia, origin=transforms.minus(places[name]))


def _inertia(element: Element, place: str) -> Mat3:
    """Return the inertia about the centre of mass: six numbers in one element, or each in one of its own."""
    if element.find("inertia") is not None:
        xx, yy, zz, xy, xz, yz = numbers_of(element, "inertia", "0 0 0 0 0 0", place, 6)
    else:
        tags = (f"inertia_{entry}" for entry in ENTRIES)
        xx, yy, zz, xy, xz, yz = (numbers_of(element, tag, "0", place, 1)[0] for tag in tags)
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def _vector(values: tuple[float, ...]) -> Vec3:
    x, y, z = values
    return x, y, z


def _forces(model: Element) -> Iterator[Omission]:
    """Yield the forces that act by themselves, which the torques leave out."""
    for force in members(model, "ForceSet"):
        if _acts(force) and not gives_torque(force):
            coordinate = text_of(force, "coordinate")
            yield Omission(
                ACTING.get(force.tag, force.tag), name_of(force), coordinate and f"on {coordinate}"
            )


def _acts(force: Element) -> bool:
    return yes(force, "appliesForce", True) and not yes(force, "isDisabled")


def gives_torque(force: Element) -> bool:
    """Return whether a force is a muscle or an actuator, which give the joints' torques."""
    return "Muscle" in force.tag or force.tag.endswith("Actuator")


def _known(element: Element) -> Known | None:
    return BODY if element.tag == "Body" else None


def _ignored(model: Element) -> tuple[Note, ...]:
    """Return notes on parts of the model that do not enter its dynamics, or that give the torques."""
    counts = Counter(force.tag for force in members(model, "ForceSet") if gives_torque(force))
    counts.update(part.tag for part in members(model, "ContactGeometrySet"))
    counts.update(part.tag for part in members(model, "MarkerSet"))
    off = (force for force in members(model, "ForceSet") if not _acts(force))
    weightless = (body for body in members(model, "BodySet") if _has_inertia_alone(body))
    return (
        *(Note("ignored", what, f"{count} ×") for what, count in sorted(counts.items())),
        *(Note("ignored", name_of(force), f"a {force.tag} that the model does not apply") for force in off),
        *(Note("ignored", name_of(body), "its inertia, as its mass is 0") for body in weightless),
    )


def _has_inertia_alone(body: Element) -> bool:
    place = f"body {name_of(body)!r}"
    (mass,) = numbers_of(body, "mass", "0", place, 1)
    return mass == 0.0 and _inertia(body, place) != ZERO33
