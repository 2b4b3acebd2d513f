"""Constraints of an OpenSim model: coordinates locked or coupled to another one, and bodies tied together."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.robot.curve import Curve
from linkwise.robot.description import Anchor, AnchoredTie, Loop
from linkwise.robot.notes import Note
from linkwise.robot.readers.osim.document import members, name_of, numbers_of, text_of, yes
from linkwise.robot.readers.osim.frames import Frames, Placed, offset_of
from linkwise.robot.readers.osim.functions import IDENTITY, function_of
from linkwise.robot.robot import UNLIMITED, Limits, TieKind

COUPLER, POINT_ON_LINE = "CoordinateCouplerConstraint", "PointOnLineConstraint"

KINDS: dict[str, TieKind] = {
    "PointConstraint": "point",
    "WeldConstraint": "frame",
    "ConstantDistanceConstraint": "distance",
}


@dataclass(frozen=True)
class Rule:
    """Rule of a coordinate: a curve of one that is free or, where `free` is empty, a number."""

    free: str
    curve: Curve

    def of(self, outer: Curve) -> "Rule":
        """Return the rule of a function of the coordinate."""
        return Rule(self.free, outer.after(self.curve))


def coordinate_rules(
    coordinates: Iterable[Element], model: Element
) -> tuple[dict[str, Rule], tuple[Note, ...]]:
    """Return the rule of each coordinate, by name, and notes on those that are not free.

    Raises LinkwiseError for two coordinates of one name, and for couplings that are not modelled.
    """
    own: dict[str, Rule] = {}
    notes: list[Note] = []
    for coordinate in coordinates:
        name = name_of(coordinate)
        place = f"coordinate {name!r}"
        if name in own:
            raise LinkwiseError(f"2 coordinates are named {name!r}; rename one")
        (value,) = numbers_of(coordinate, "default_value", "0", place, 1)
        own[name] = Rule(name, IDENTITY)
        if yes(coordinate, "locked"):
            own[name] = Rule("", Curve.straight(value))
            notes.append(Note("locked", name, f"at {value:g}, as the file says"))
        if yes(coordinate, "prescribed"):
            notes.append(Note("ignored", name, "that its motion is prescribed: it moves as a log says"))
    for coupler in members(model, "ConstraintSet"):
        if coupler.tag == COUPLER and is_enforced(coupler):
            dependent, rule = _coupled(coupler, own)
            notes.append(Note("mimic", dependent, f"a function of {rule.free}" if rule.free else "held"))
            own[dependent] = rule
    return {name: _resolved(name, own) for name in own}, tuple(notes)


def with_idle_held(
    rules: Mapping[str, Rule], idle: Iterable[Element]
) -> tuple[dict[str, Rule], tuple[Note, ...]]:
    """Return the rules where coordinates that move nothing stay at their default values, and notes on them.

    idle: coordinates that move no axis of their joint; one that others follow moves those, and stays free
    """
    leading = {rule.free for name, rule in rules.items() if rule.free != name}
    held, notes = dict(rules), []
    for coordinate in idle:
        name = name_of(coordinate)
        if held[name].free == name and name not in leading:
            (value,) = numbers_of(coordinate, "default_value", "0", f"coordinate {name!r}", 1)
            held[name] = Rule("", Curve.straight(value))
            notes.append(Note("locked", name, f"at {value:g}, as it moves no axis"))
    return held, tuple(notes)


def is_enforced(constraint: Element) -> bool:
    """Return whether a constraint holds, that is, is switched on."""
    return yes(constraint, "isEnforced", True) and not yes(constraint, "isDisabled")


def _coupled(coupler: Element, known: Mapping[str, Rule]) -> tuple[str, Rule]:
    place = f"constraint {name_of(coupler)!r}"
    others = text_of(coupler, "independent_coordinate_names").split()
    dependent = text_of(coupler, "dependent_coordinate_name")
    if len(others) != 1:
        raise LinkwiseError(
            f"{place} couples {dependent!r} to {len(others)} coordinates; only functions of one are modelled"
        )
    for name in (*others, dependent):
        if name not in known:
            raise LinkwiseError(f"{place} names {name!r}, which is not a coordinate; correct it")
    curve = function_of(coupler, "coupled_coordinates_function", place)
    if curve is None:
        raise LinkwiseError(f"{place} has no <coupled_coordinates_function>; give it one")
    return dependent, Rule(others[0], curve.scaled(*numbers_of(coupler, "scale_factor", "1", place, 1)))


def _resolved(name: str, rules: Mapping[str, Rule]) -> Rule:
    """Return the rule in terms of a coordinate that is free itself; raises LinkwiseError for a circle."""
    rule, passed = rules[name], {name}
    while rule.free and rules[rule.free] != Rule(rule.free, IDENTITY):
        if rule.free in passed:
            raise LinkwiseError(f"the coupling of coordinate {name!r} leads back to itself; let one go free")
        passed.add(rule.free)
        rule = rules[rule.free].of(rule.curve)
    return rule


def limits_of(coordinate: Element) -> Limits:
    """Return the range of a coordinate; unlimited where it is not clamped."""
    if not yes(coordinate, "clamped"):
        return UNLIMITED
    lower, upper = numbers_of(coordinate, "range", "-inf inf", f"coordinate {name_of(coordinate)!r}", 2)
    return Limits(lower, upper)


def ties(model: Element, frames: Frames) -> Iterator[AnchoredTie]:
    """Yield the constraints between two bodies."""
    for constraint in members(model, "ConstraintSet"):
        if constraint.tag in KINDS and is_enforced(constraint):
            first, second = (anchor_of(constraint, number, frames) for number in (1, 2))
            place = f"constraint {name_of(constraint)!r}"
            (length,) = numbers_of(constraint, "constant_distance", "0", place, 1)
            yield AnchoredTie(name_of(constraint), KINDS[constraint.tag], first, second, length)


def unmodelled(model: Element) -> Iterator[Loop]:
    """Yield the constraints of other kinds, which are not modelled."""
    for constraint in members(model, "ConstraintSet"):
        if constraint.tag not in (COUPLER, POINT_ON_LINE, *KINDS) and is_enforced(constraint):
            yield Loop(
                f"the model has the {constraint.tag} {name_of(constraint)!r}",
                "remove it, or switch it off there",
            )


def anchor_of(constraint: Element, number: int, frames: Frames) -> Anchor:
    """Return an end of a constraint: a frame, or a place on a body."""
    frame = text_of(constraint, f"socket_frame{number}")
    body = text_of(constraint, f"socket_body_{number}") or text_of(constraint, f"body_{number}")
    found: Placed = frames.found(frame or body, constraint)
    if not frame:
        place = f"constraint {name_of(constraint)!r}"
        parts = f"location_body_{number}", f"orientation_body_{number}"
        found = found.behind(*offset_of(constraint, place, *parts))
    return Anchor(found.body, found.rotation, found.translation)
