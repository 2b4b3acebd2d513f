"""Frames of a robot by their names, or by their numbers."""

from collections.abc import Sequence
from typing import Any

from ..chosen_names import choice, known_as, short, whole_number


def frame_index(given: Any, frames: Sequence[str]) -> int:
    """Index among `frames` of one by its name, or by that index itself: the number that C has for it too.

    Raises ValueError for one that is not there, TypeError for what is neither a name nor a number.
    """
    if isinstance(given, str):
        if (name := known_as(given, frames)) is not None:
            return frames.index(name)
        known = choice(given, frames, "kinematics.frames")
        raise ValueError(f"frame is {short(given)}, which is not there; choose {known}")
    number = whole_number(given)
    if number is None:
        raise TypeError(
            f"frame is {short(given)}; give the name of a frame, or its number in kinematics.frames"
        )
    if not 0 <= number < len(frames):
        raise ValueError(
            f"frame is {number}, but frames are numbered 0..{len(frames) - 1}, in the order of "
            "kinematics.frames; or give a frame's name"
        )
    return number
