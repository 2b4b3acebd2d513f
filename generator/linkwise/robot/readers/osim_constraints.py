"""Constraints of an OpenSim model that tie bodies together; `osim_coordinates` has those of coordinates."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from linkwise.robot.description import Anchor, AnchoredTie, Loop
from linkwise.robot.readers.osim_coordinates import COUPLER, is_enforced
from linkwise.robot.readers.osim_document import members
from linkwise.robot.readers.osim_elements import name_of, numbers_of, text_of
from linkwise.robot.readers.osim_frames import Frames, Placed, offset_of
from linkwise.robot.robot import TieKind

KINDS: dict[str, TieKind] = {
    "PointConstraint": "point",
    "WeldConstraint": "frame",
    "ConstantDistanceConstraint": "distance",
}


def ties(model: Element, frames: Frames) -> Iterator[AnchoredTie]:
    """Yield the constraints between two bodies."""
    for constraint in members(model, "ConstraintSet"):
        if constraint.tag in KINDS and is_enforced(constraint):
            first, second = (_end(constraint, number, frames) for number in (1, 2))
            place = f"constraint {name_of(constraint)!r}"
            (length,) = numbers_of(constraint, "constant_distance", "0", place, 1)
            yield AnchoredTie(name_of(constraint), KINDS[constraint.tag], first, second, length)


def unmodelled(model: Element) -> Iterator[Loop]:
    """Yield the constraints of other kinds, which are not modelled."""
    for constraint in members(model, "ConstraintSet"):
        if constraint.tag not in (COUPLER, *KINDS) and is_enforced(constraint):
            yield Loop(
                f"the model has the {constraint.tag} {name_of(constraint)!r}",
                "remove it, or switch it off there",
            )


def _end(constraint: Element, number: int, frames: Frames) -> Anchor:
    """Return an end of a constraint: a frame, or a place on a body."""
    frame = text_of(constraint, f"socket_frame{number}")
    body = text_of(constraint, f"socket_body_{number}") or text_of(constraint, f"body_{number}")
    found: Placed = frames.found(frame or body, constraint)
    if not frame:
        place = f"constraint {name_of(constraint)!r}"
        parts = f"location_body_{number}", f"orientation_body_{number}"
        found = found.behind(*offset_of(constraint, place, *parts))
    return Anchor(found.body, found.rotation, found.translation)
