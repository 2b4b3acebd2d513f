"""Names that are read of an OpenSim model's components, so that a misspelt name is not passed over.

OpenSim silently takes the default for what it does not find: under <axes> an axis would be another.
"""

from xml.etree.ElementTree import Element

from linkwise.robot.readers.osim_elements import name_of
from linkwise.robot.readers.xml_names import Names, names, refuse_misspelt

CURVE = names("x y")
ENDS = names(
    "body_1 body_2 socket_body_1 socket_body_2 socket_frame1 socket_frame2 socket_frame_1 socket_frame_2 "
    "location_body_1 location_body_2 orientation_body_1 orientation_body_2 frames isEnforced isDisabled"
)
OF_TAG = {
    "Model": names("gravity length_units BodySet JointSet ConstraintSet ForceSet"),
    "Coordinate": names("default_value range clamped locked prescribed prescribed_function motion_type"),
    "PhysicalOffsetFrame": names("translation orientation socket_parent"),
    "SpatialTransform": names("TransformAxis"),
    "TransformAxis": names("axis coordinates function"),
    "LinearFunction": names("coefficients"),
    "PolynomialFunction": names("coefficients"),
    "Constant": names("value"),
    "MultiplierFunction": names("function scale"),
    "PiecewiseLinearFunction": CURVE,
    "CMC_Joint": names(""),
    "SMC_Joint": names(""),
    "SimmSpline": CURVE,
    "NaturalCubicSpline": CURVE,
}
"""Children that are read, and others of OpenSim's that are near one of them, by the component's tag.

Tasks of controllers are called joints, too, and have nothing that is read.
"""
OF_END = {
    "Joint": names(
        "socket_parent_frame socket_child_frame frames coordinates CoordinateSet SpatialTransform reverse "
        "parent_body location_in_parent orientation_in_parent location orientation"
    ),
    "Constraint": ENDS
    | names(
        "independent_coordinate_names dependent_coordinate_name scale_factor coupled_coordinates_function "
        "constant_distance"
    ),
}
"""Children that are read, and others near one of them, by the end of the component's tag."""


def refuse_misspelt_names(model: Element) -> None:
    """Raise LinkwiseError for a child whose name is near one that is read of its component."""
    for element in model.iter():
        read = _read(str(element.tag))
        for child in element if read else ():
            tag = str(child.tag)
            if tag not in read:
                refuse_misspelt(_place(element), f"<{tag}>", tag, {f"<{name}>": name for name in read})


def _read(tag: str) -> Names:
    ending = next((read for end, read in OF_END.items() if tag.endswith(end) and tag != end), names(""))
    return OF_TAG.get(tag, ending)


def _place(element: Element) -> str:
    return f"{element.tag} {name_of(element)!r}" if name_of(element) else f"<{element.tag}>"
