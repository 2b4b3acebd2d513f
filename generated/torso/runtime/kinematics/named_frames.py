"""Frames of a robot by their names, and those of links also by number."""

from collections.abc import Sequence
from typing import Any

from ..chosen_names import choice, known_as, short, whole_number


def frame_index(given: Any, frames: Sequence[str], links: Sequence[str]) -> int:
    """Index among `frames` of one by its name, or of link `given` by number from 0.

    Raises ValueError for one that is not there, TypeError for what is neither a name nor a number.
    """
    if isinstance(given, str):
        if (name := known_as(given, frames)) is not None:
            return frames.index(name)
        known = choice(given, frames, "kinematics.frames")
        raise ValueError(f"frame is {short(given)}, which is not there; choose {known}")
    number = whole_number(given)
    if number is None:
        raise TypeError(f"frame is {short(given)}; give the name of a frame, or the number of a link")
    if not 0 <= number < len(links):
        raise ValueError(
            f"frame is {number}, but links are numbered 0..{len(links) - 1}; or give a frame's name"
        )
    return frames.index(links[number])
