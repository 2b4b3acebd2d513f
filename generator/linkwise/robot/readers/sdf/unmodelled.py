"""Content of an SDFormat file beyond the dynamics of rigid bodies, and the names read of each element."""

from collections.abc import Iterable, Iterator
from xml.etree.ElementTree import Element

from linkwise.robot.notes import Omission
from linkwise.robot.readers.sdf.poses import numbers_in, place_of
from linkwise.robot.readers.urdf.unmodelled import TOLD, acting
from linkwise.robot.readers.xml_names import Known, names

VOCABULARY = {
    "sdf": Known(many=names("model world"), attributes=names("version"), idle=names("light include actor")),
    "world": Known(
        many=names("model gravity physics"),
        attributes=names("name"),
        idle=names(
            "actor atmosphere audio frame gui include joint light magnetic_field plugin population road "
            "scene spherical_coordinates state wind"
        ),
    ),
    "model": Known(
        once=names("pose static"),
        many=names("link joint frame"),
        attributes=names("name canonical_link placement_frame"),
        idle=names("plugin gripper self_collide allow_auto_disable enable_wind"),
    ),
    "frame": Known(once=names("pose"), attributes=names("name attached_to")),
    "link": Known(
        once=names("inertial pose gravity velocity_decay enable_wind kinematic"),
        attributes=names("name"),
        idle=names(
            "visual collision sensor light projector particle_emitter battery audio_source audio_sink "
            "self_collide must_be_base_link"
        ),
    ),
    "joint": Known(
        once=names("parent child pose axis axis2"),
        attributes=names("name type"),
        idle=TOLD
        | names(
            "physics sensor gearbox_ratio gearbox_reference_body thread_pitch screw_thread_pitch gear_ratio"
        ),
    ),
    "inertial": Known(
        once=names("pose mass inertia fluid_added_mass"),
        attributes=names("auto"),
        idle=names("density auto_inertia_params frame"),
    ),
    "inertia": Known(once=names("ixx iyy izz ixy ixz iyz")),
    "pose": Known(attributes=names("relative_to degrees rotation_format frame")),
    "axis": Known(
        once=names("xyz limit dynamics use_parent_model_frame"),
        many=names("mimic"),
        idle=names("initial_position"),
    ),
    "xyz": Known(attributes=names("expressed_in")),
    "limit": Known(once=names("lower upper velocity effort"), idle=names("stiffness dissipation")),
    "dynamics": Known(once=names("damping friction spring_stiffness spring_reference")),
    "mimic": Known(once=names("multiplier offset reference"), attributes=names("joint axis")),
    "velocity_decay": Known(once=names("linear angular")),
} | dict.fromkeys(
    names(
        "gravity static mass ixx iyy izz ixy ixz iyz parent child lower upper velocity effort damping "
        "friction spring_stiffness spring_reference multiplier offset reference use_parent_model_frame "
        "linear angular"
    ),
    Known(),
)
"""Names that are read of each element, and those known beside them; the last ones hold text alone."""

DECAYS = ("linear", "angular")


def known(element: Element) -> Known | None:
    """Return the names that SDFormat knows in an element; None for an unknown element."""
    return VOCABULARY.get(element.tag)


def omissions(links: Iterable[Element], joints: Iterable[Element]) -> Iterator[Omission]:
    """Yield each force and inertia that the torques leave out, but for those of `SdfJoint.losses`."""
    for link in links:
        name = link.get("name", "")
        for what, detail in acting(link):
            yield Omission(what, name, detail, bodies=(name,))
        if link.find("inertial/fluid_added_mass") is not None:
            yield Omission("added mass of a fluid", name, bodies=(name,))
        decays = [numbers_in(link, f"velocity_decay/{decay}", 0.0, place_of(link)) for decay in DECAYS]
        if any(decays):
            yield Omission("damping of a link's velocity", name, f"{max(decays):g}", bodies=(name,))
    for joint in joints:
        name = joint.get("name", "")
        for what, detail in acting(joint):
            yield Omission(what, name, detail, joints=(name,))
