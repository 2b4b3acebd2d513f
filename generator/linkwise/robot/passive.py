"""Passive properties of joints, beside the links that they carry: springs, damping, friction, rotors."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import astuple, replace

from linkwise.errors import LinkwiseError
from linkwise.robot.coordinates import AxisRule
from linkwise.robot.description import Connection
from linkwise.robot.joint_types import SINGLE
from linkwise.robot.notes import APART, Note
from linkwise.robot.robot import NOTHING, PassiveAxis, unusable

SHARES: dict[str, tuple[str, tuple[str, str]]] = {
    "spring": ("stiffness", ("N·m/rad", "N/m")),
    "damping": ("damping", ("N·m·s/rad", "N·s/m")),
    "friction": ("friction", ("N·m", "N")),
    "armature": ("armature", ("kg·m²", "kg")),
}
"""Properties by name: the field of `Passive` that shows one, and its units about an axis and along it."""

NEVER_NEGATIVE = ("damping", "friction", "armature")
"""Properties that may not be negative, as they would then give energy without end.

A spring may be: it then pushes away from its rest.
"""


def checked_passive(connections: Iterable[Connection], allow_unphysical: bool) -> None:
    """Raise LinkwiseError, which names the joint, for a passive value that no joint has."""
    for c in connections:
        if fault := unusable(*astuple(c.passive)):
            raise LinkwiseError(f"joint {c.name!r} has {fault} among its springs and losses; give numbers")
        for what in NEVER_NEGATIVE:
            if (number := getattr(c.passive, what)) < 0 and not allow_unphysical:
                raise LinkwiseError(
                    f"joint {c.name!r} has a {what} of {number:g}, below 0; correct it, or pass "
                    "--allow-unphysical"
                )


def passive_axes(
    connections: Iterable[Connection], motion: Mapping[str, AxisRule]
) -> tuple[PassiveAxis, ...]:
    """Return the moving joints of one axis that have passive properties, with their coordinates.

    The rest of a joint at ratio · q + offset is counted from the offset.
    """
    found = []
    for c in connections:
        rule = motion.get(c.name)
        if c.passive != NOTHING and c.type in SINGLE and rule and rule.coordinate is not None:
            own = replace(c.passive, rest=c.passive.rest - rule.offset if c.passive.stiffness else 0.0)
            found.append(PassiveAxis(c.name, rule.coordinate, rule.ratio, own))
    return tuple(found)


def passive_notes(connections: Iterable[Connection], axes: Iterable[PassiveAxis]) -> Iterator[Note]:
    """Yield a note on each passive property of each joint, kind by kind, with the file's numbers."""
    moving = {axis.joint for axis in axes}
    there = [c for c in connections if c.name in moving]
    for what, (name, units) in SHARES.items():
        for c in there:
            if number := getattr(c.passive, name):
                slides = SINGLE[c.type] == "prismatic"
                at = f", at rest at {c.passive.rest:g} {'m' if slides else 'rad'}"
                rest = at if what == "spring" and c.passive.rest else ""
                detail = f"{number:g} {units[slides]}{rest}"
                yield Note("passive", c.name, detail, f"{what} {APART}")
