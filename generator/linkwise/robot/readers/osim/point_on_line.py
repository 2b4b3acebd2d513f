"""PointOnLineConstraint: a point of one body stays on a line of another.

Between the bodies stands a slider without mass, which a joint lets slide along the line, and to which the
point is tied. That leaves the point what the line leaves it: the slider's coordinate follows the others, and
no force acts along the line, as the slider has nothing to bear there.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import IDENTITY, Anchor, AnchoredTie, Body, Connection
from linkwise.robot.readers.osim.constraints import POINT_ON_LINE, is_enforced
from linkwise.robot.readers.osim.document import members, name_of, numbers_of, text_of
from linkwise.robot.readers.osim.frames import Frames

ENDING = "slide"


@dataclass(frozen=True)
class Slider:
    """A slider: its body, the joint by which it slides on its line, and the tie that holds the point."""

    body: Body
    joint: Connection
    tie: AnchoredTie


def sliders(model: Element, frames: Frames) -> Iterator[Slider]:
    """Yield a slider for each PointOnLineConstraint that holds.

    Raises LinkwiseError for a line without a direction.
    """
    for constraint in members(model, "ConstraintSet"):
        if constraint.tag == POINT_ON_LINE and is_enforced(constraint):
            yield _slider(constraint, frames)


def _slider(constraint: Element, frames: Frames) -> Slider:
    name = name_of(constraint)
    place = f"constraint {name!r}"
    line, follower = (
        frames.found(text_of(constraint, f"socket_{end}") or text_of(constraint, end), constraint)
        for end in ("line_body", "follower_body")
    )
    axis = transforms.unit(numbers_of(constraint, "line_direction_vec", "0 0 0", place, 3))
    if axis is None:
        raise LinkwiseError(f"{place}: its <line_direction_vec> has no direction; give one")
    on_line, on_follower = (
        placed.behind(IDENTITY, numbers_of(constraint, f"point_on_{end}", "0 0 0", place, 3))
        for placed, end in ((line, "line"), (follower, "follower"))
    )
    body = Body(f"{name}_{ENDING}")
    joint = Connection(
        body.name, "prismatic", on_line.body, body.name, on_line.rotation, on_line.translation, axis
    )
    ends = Anchor(body.name), Anchor(on_follower.body, on_follower.rotation, on_follower.translation)
    return Slider(body, joint, AnchoredTie(name, "point", *ends))
