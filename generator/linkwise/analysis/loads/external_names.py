"""The names of OpenSim's ExternalLoads: what is misspelt there would move or take away a force unsaid."""

from xml.etree.ElementTree import Element

from linkwise.robot.notes import effects
from linkwise.robot.readers.xml_names import Known, ignored, names

NAME = names("name")
OF_TAG = {
    "OpenSimDocument": Known(once=names("ExternalLoads"), attributes=names("Version")),
    "ExternalLoads": Known(
        once=names("objects datafile"),
        attributes=NAME,
        idle=names(
            "defaults groups data_source_name external_loads_model_kinematics_file_name "
            "lowpass_cutoff_frequency_for_load_kinematics"
        ),
    ),
    "objects": Known(many=names("ExternalForce")),
    "ExternalForce": Known(
        once=names(
            "applied_to_body force_expressed_in_body point_expressed_in_body force_identifier "
            "point_identifier torque_identifier data_source_name isDisabled appliesForce"
        ),
        attributes=NAME,
    ),
}
"""What is read of each element; no force here depends on the model's kinematics, which are the log's."""


def unread_names(root: Element) -> tuple[str, ...]:
    """What a file has beside what is read, in words; raises LinkwiseError for a name near one that is."""
    return effects(ignored([root], lambda element: OF_TAG.get(str(element.tag)), "OpenSim's ExternalLoads"))
