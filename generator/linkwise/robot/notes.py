"""What became of things that a file says, and what of that touches the torques."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from linkwise.escape import listed

LEFT_OUT = "left out of the torques"
UNCOUPLED = "moving by themselves, their coupling left out of the torques"
IMPOSSIBLE = "accepted though physically impossible"
TURNS = "singular at a pitch of ±90°"
FLOATS = f"six coordinates without any contact forces, {TURNS}"

SHOWN = 5
"""Most subjects that one line of effects names."""


@dataclass(frozen=True)
class Note:
    """Something that was done with the description: what happened to whom.

    `effect` says what that means for the torques, in words that fit one subject or several; it is empty where
    the torques are those of the description.
    """

    kind: Literal[
        "merged",
        "locked",
        "massless",
        "ignored",
        "snapped",
        "mimic",
        "cut",
        "expanded",
        "unphysical",
        "freed",
        "damping",
        "friction",
        "promoted",
    ]
    subject: str
    detail: str = ""
    effect: str = ""


def effects(notes: Iterable[Note]) -> tuple[str, ...]:
    """One line for each effect on the torques, naming its first subjects and counting the others."""
    subjects: dict[str, list[str]] = {}
    for note in notes:
        if note.effect:
            detail = f" ({note.detail})" if note.detail else ""
            subjects.setdefault(note.effect, []).append(f"{note.subject}{detail}")
    return tuple(f"{effect}: {listed(found, SHOWN)}" for effect, found in subjects.items())
