"""Bodies of the robot's file, which loads, payloads, contacts and points find by the names people give."""

from collections import Counter
from collections.abc import Sequence

from linkwise_runtime.chosen_names import known_as, nearest_first
from linkwise_runtime.rule.joint_tree import TreeFrame

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.errors import LinkwiseError
from linkwise.escape import listed


def body_frame(what: str, body: str, robot: OpenedRobot) -> TreeFrame:
    """Return the frame of a body of the robot's file.

    what: how the message begins

    Raises LinkwiseError, which lists the nearest names first, where there is no such body.
    """
    tree = robot.package.manifest.tree
    frames = {} if tree is None else {frame.name: frame for frame in tree.frames}
    name = known_as(body, frames)
    if name is None:
        near = listed(nearest_first(body, frames))
        raise LinkwiseError(f"{what} {body!r}: {robot.name} has no such body; its bodies are {near}")
    return frames[name]


def named_body(text: str, robot: OpenedRobot) -> tuple[str, str]:
    """Return the name and the body of NAME:BODY; the name is empty for BODY alone.

    A body whose own name contains a colon is found too.
    """
    tree = robot.package.manifest.tree
    name, colon, body = text.partition(":")
    if not colon or (tree is not None and any(frame.name == text for frame in tree.frames)):
        return "", text
    return name, body


def told_apart(
    what: str, names: Sequence[str], others: Sequence[str], mend: str = "tell them apart as NAME:BODY"
) -> None:
    """Raise LinkwiseError for a name that is given twice, or that another object has already."""
    twice = [name for name, count in Counter(names).items() if count > 1 or name in others]
    if twice:
        raise LinkwiseError(f"{what} {listed(map(repr, twice))}: another has that name; {mend}")
