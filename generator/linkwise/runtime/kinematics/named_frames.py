"""Frames of a robot by their names, and those of links also by number."""

import difflib
from collections.abc import Sequence
from operator import index
from typing import Any

MOST_NAMES = 8
"""Names that a message lists."""
LONGEST = 60
"""Characters of what was given that a message repeats."""


def frame_index(given: Any, frames: Sequence[str], links: Sequence[str]) -> int:
    """Index among `frames` of one by its name, or of link `given` by number from 0.

    Raises ValueError for one that is not there, TypeError for what is neither a name nor a number.
    """
    if isinstance(given, str):
        if given in frames:
            return frames.index(given)
        raise ValueError(f"frame is {_short(given)}, which is not there; {_choice(given, frames)}")
    try:
        number = index(given)
    except TypeError:
        number = None
    if number is None or isinstance(given, bool):
        raise TypeError(f"frame is {_short(given)}; give the name of a frame, or the number of a link")
    if not 0 <= number < len(links):
        raise ValueError(
            f"frame is {number}, but links are numbered 0..{len(links) - 1}; or give a frame's name"
        )
    return frames.index(links[number])


def _choice(given: str, frames: Sequence[str]) -> str:
    if len(frames) <= MOST_NAMES:
        return f"the frames are {', '.join(map(_short, frames))}"
    near = difflib.get_close_matches(given, frames, MOST_NAMES, 0.5) or frames[:MOST_NAMES]
    return f"near it are {', '.join(map(_short, near))}, and kinematics.frames has all {len(frames)}"


def _short(value: Any) -> str:
    text = repr(value).replace("\n", " ")
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
