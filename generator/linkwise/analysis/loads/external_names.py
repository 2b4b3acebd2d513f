"""Names in OpenSim's ExternalLoads: a misspelt one would silently move or remove a force."""

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
"""Names read in each element; no force here depends on the model's kinematics, which are the log's."""


def unread_names(root: Element) -> tuple[str, ...]:
    """Return notes on what is not read of a file; raise LinkwiseError for a name close to a known one."""
    return effects(ignored([root], lambda element: OF_TAG.get(str(element.tag)), "OpenSim's ExternalLoads"))
