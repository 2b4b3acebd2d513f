"""Bodies of a robot's file by name, for what is put on them: loads and payloads."""

from collections import Counter
from collections.abc import Sequence

from linkwise_runtime.chosen_names import known_as, nearest_first

from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.package.manifest import FrameEntry


def body_frame(what: str, body: str, robot: LoadedRobot) -> FrameEntry:
    """The frame of a body of the file; raises LinkwiseError, names near it first, where there is none."""
    tree = robot.package.manifest.tree
    frames = {} if tree is None else {frame.name: frame for frame in tree.frames}
    name = known_as(body, frames)
    if name is None:
        near = listed(nearest_first(body, frames))
        raise LinkwiseError(f"{what} {body!r}: {robot.name} has no such body; its bodies are {near}")
    return frames[name]


def named_body(text: str, robot: LoadedRobot) -> tuple[str, str]:
    """Name and body of NAME:BODY, no name of BODY alone; a body whose own name has a colon is found too."""
    tree = robot.package.manifest.tree
    name, colon, body = text.partition(":")
    if not colon or (tree is not None and any(frame.name == text for frame in tree.frames)):
        return "", text
    return name, body


def told_apart(
    what: str, names: Sequence[str], others: Sequence[str], mend: str = "tell them apart as NAME:BODY"
) -> None:
    """Raise LinkwiseError for a name that stands twice, or that another thing has."""
    twice = [name for name, count in Counter(names).items() if count > 1 or name in others]
    if twice:
        raise LinkwiseError(f"{what} {listed(map(repr, twice))}: another has that name; {mend}")
