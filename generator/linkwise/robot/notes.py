"""What became of things that a file says, and what of that touches the torques."""

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Literal

from linkwise.escape import listed

LEFT_OUT = "left out of the torques"
APART = "apart from the links' torques, by passive_torque"
UNCOUPLED = "moving by themselves, their coupling left out of the torques"
BESIDE = "constraints, which robot.constraints holds, beside the torques of the open tree"
LEAST = "constraints that hold something twice, so that their forces are shared by least squares"
IMPOSSIBLE = "accepted though physically impossible"
WARNED = "MuJoCo warns"
TURNS = "singular at a pitch of ±90°"
FREE = "free to fall, as no joint of the file holds it to the world (--base fixed holds it)"
FLOATS = f"six coordinates without any contact forces, {TURNS}"

SHOWN = 5
"""Most subjects that one line of effects names."""
LONGEST_ITEM = 150
"""Characters of a subject and its reason."""


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
        "free",
        "expanded",
        "unphysical",
        "freed",
        "left out",
        "passive",
        "warned",
        "promoted",
        "constraint",
        "redundant",
    ]
    subject: str
    detail: str = ""
    effect: str = ""


@dataclass(frozen=True)
class Omission:
    """A force or inertia that a file has, and that no torque holds: `what` it is, of which `subject`.

    It acts while one of its joints or bodies moves, or always where it names none, and only while all that it
    `needs` is carried along.
    """

    what: str
    subject: str
    detail: str = ""
    joints: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()

    def acts(self, joints: Collection[str], bodies: Collection[str]) -> bool:
        """Whether it loads a joint, of the joints and bodies that move."""
        if any(body not in bodies for body in self.needs):
            return False
        anywhere = not (self.joints or self.bodies)
        return anywhere or any(j in joints for j in self.joints) or any(b in bodies for b in self.bodies)

    def note(self) -> Note:
        """Say it."""
        return Note("left out", self.subject, self.detail, f"{self.what} {LEFT_OUT}")


def effects(notes: Iterable[Note], every: bool = False) -> tuple[str, ...]:
    """Lines on what touches the torques: one for each effect, or one for `every` note that has one.

    A line for an effect names its first subjects and counts the others.
    """
    subjects: dict[str, list[str]] = {}
    for note in notes:
        if note.effect:
            detail = f" ({note.detail})" if note.detail else ""
            subjects.setdefault(note.effect, []).append(f"{note.subject}{detail}")
    if every:
        return tuple(f"{effect}: {item}" for effect, found in subjects.items() for item in found)
    return tuple(f"{effect}: {listed(found, SHOWN, LONGEST_ITEM)}" for effect, found in subjects.items())


def left_out(notes: Iterable[Note]) -> tuple[Note, ...]:
    """One note for each kind of thing that was left out, with how often, in place of one for each joint."""
    return _counted("left out", LEFT_OUT, notes)


def kept_apart(notes: Iterable[Note]) -> tuple[Note, ...]:
    """The same for what joints have of their own."""
    return _counted("passive", APART, notes)


def _counted(kind: Literal["left out", "passive"], effect: str, notes: Iterable[Note]) -> tuple[Note, ...]:
    counts = Counter(note.effect for note in notes if note.kind == kind)
    return tuple(
        Note(kind, what.removesuffix(f" {effect}"), f"{count} ×", effect) for what, count in counts.items()
    )
