"""What joints have of their own, beside the links that they carry: springs, damping, friction, rotors."""

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
"""By what it is called, the number that says whether it is there, and its units about an axis and along."""

NEVER_NEGATIVE = ("damping", "friction", "armature")
"""A spring may push away from its rest; none of these can give energy without end."""


def checked_passive(connections: Iterable[Connection], allow_unphysical: bool) -> None:
    """Raise LinkwiseError, which names the joint, for a number that none has."""
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
    """Return those of the moving joints of one axis that have something of their own, by coordinate.

    A joint at ratio · q + offset has its rest counted from the offset.
    """
    found = []
    for c in connections:
        rule = motion.get(c.name)
        if c.passive != NOTHING and c.type in SINGLE and rule and rule.coordinate is not None:
            own = replace(c.passive, rest=c.passive.rest - rule.offset if c.passive.stiffness else 0.0)
            found.append(PassiveAxis(c.name, rule.coordinate, rule.ratio, own))
    return tuple(found)


def passive_notes(connections: Iterable[Connection], axes: Iterable[PassiveAxis]) -> Iterator[Note]:
    """Say what the joints have, kind by kind, with the file's numbers."""
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
