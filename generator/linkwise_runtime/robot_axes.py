"""Names along the axes of what a robot computes, and in what entries along them are measured."""

from collections.abc import Sequence
from typing import NamedTuple

PARAMETER_UNITS = {
    "m": "kg",
    "mc_x": "kg m",
    "mc_y": "kg m",
    "mc_z": "kg m",
    "I_xx": "kg m^2",
    "I_xy": "kg m^2",
    "I_yy": "kg m^2",
    "I_xz": "kg m^2",
    "I_yz": "kg m^2",
    "I_zz": "kg m^2",
}
"""Inertial parameters of a link, in the order of regressors."""
TURNS, MOVES = ("angular_x", "angular_y", "angular_z"), ("x", "y", "z")
"""Rows of a frame: turns about the world's axes, then its point along them."""
HOMOGENEOUS = ("m", "m", "m", "1")
"""Units of the coordinates that a pose takes and gives."""
LOSSES = ("spring", "damping", "friction")
"""What joints have of their own that accelerates, in the order of induced accelerations."""


class NamedAxis(NamedTuple):
    """An axis of an answer."""

    dimension: str
    """Its name there; axes of different lengths may share one, as all joints and the independent ones do."""
    names: tuple[str, ...]
    """Of its entries; none where they have none."""
    units: tuple[str, ...] = ()
    """Of what entries are places of, such as rad and m for joints; none where that means nothing."""


def axes_of(joints: Sequence[str], units: Sequence[str], links: Sequence[str]) -> dict[str, NamedAxis]:
    """Axes of a robot's answers, by the names that `Quantity` has for them."""
    along = tuple(joints), tuple(units)
    return {
        "joint": NamedAxis("joint", *along),
        "link": NamedAxis("link", tuple(links)),
        "cause": NamedAxis("cause", *along),
        "other_cause": NamedAxis("other_cause", *along),
        "parameter": NamedAxis("parameter", tuple(PARAMETER_UNITS), tuple(PARAMETER_UNITS.values())),
        "component": NamedAxis("component", (*TURNS, *MOVES), ("rad",) * 3 + ("m",) * 3),
        "axis": NamedAxis("axis", MOVES, ("m",) * 3),
        "world": NamedAxis("world", (*MOVES, "1"), HOMOGENEOUS),
        "own": NamedAxis("own", (*MOVES, "origin"), HOMOGENEOUS),
        "source": NamedAxis("source", LOSSES),
    }


def tied_axes(
    independent: Sequence[str], units: Sequence[str], rows: Sequence[str], row_units: Sequence[str]
) -> dict[str, NamedAxis]:
    """Axes that constraints add: those of the independent joints, which `units` are of, and of the rows."""
    along = tuple(independent), tuple(units)
    return {
        "independent": NamedAxis("joint", *along),
        "independent_cause": NamedAxis("cause", *along),
        "constraint": NamedAxis("constraint", tuple(rows), tuple(row_units)),
        "part": NamedAxis("part", ()),
    }
