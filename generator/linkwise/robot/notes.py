"""Notes on what was done with the content of a robot's file, and what of it affects the torques."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
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
WINDING = "angles that look like degrees, taken as radians"
FREE = "free to fall, as no joint of the file holds it to the world (--base fixed holds it)"
FLOATS = f"six coordinates without any contact forces, {TURNS}"

TURN = 6.3
"""A full turn in rad, and some rounding."""
LEAST_DEGREES, MOST_DEGREES = 30.0, 720.0
SHOWN = 5
"""Most subjects that one line of effects names."""
LONGEST_ITEM = 150
"""Most characters of a subject and its reason."""


@dataclass(frozen=True)
class Note:
    """A note on something that was done with the description, and to which subject.

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
        "doubtful",
    ]
    subject: str
    detail: str = ""
    effect: str = ""


@dataclass(frozen=True)
class Omission:
    """A force or inertia of a file that the torques leave out: `what` it is, and its `subject`.

    It acts while one of its joints or bodies moves, or always where it names none, and only while all bodies
    that it `needs` are carried along.
    """

    what: str
    subject: str
    detail: str = ""
    joints: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()

    def acts(self, joints: Collection[str], bodies: Collection[str]) -> bool:
        """Return whether it loads a joint, given the joints and bodies that move."""
        if any(body not in bodies for body in self.needs):
            return False
        anywhere = not (self.joints or self.bodies)
        return anywhere or any(j in joints for j in self.joints) or any(b in bodies for b in self.bodies)

    def note(self) -> Note:
        """Return the omission as a note."""
        return Note("left out", self.subject, self.detail, f"{self.what} {LEFT_OUT}")


def effects(notes: Iterable[Note], every: bool = False) -> tuple[str, ...]:
    """Return lines on what affects the torques: one for each effect or, with `every`, one for each such note.

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


def winding(turns: Mapping[str, Sequence[float]], ends: Mapping[str, Sequence[float]]) -> tuple[Note, ...]:
    """Return a note for each place in a file whose angles, which are radians there, look like degrees.

    turns: angles of poses, none of which needs more than a full turn; ends: ranges of hinges, of which 30 to
    720 in steps of 15 are told: a winch turns as far, but seldom by just so much
    """
    places = [place for place, angles in turns.items() if max(map(abs, angles)) > TURN]
    places += [
        place
        for place, angles in ends.items()
        if any(LEAST_DEGREES <= abs(angle) <= MOST_DEGREES and angle % 15 == 0 for angle in angles)
    ]
    return tuple(Note("doubtful", place, effect=WINDING) for place in places)


def left_out(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Return one note, with a count, for each kind of thing that was left out, not one for each joint."""
    return _counted("left out", LEFT_OUT, notes)


def kept_apart(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Return one note, with a count, for each kind of passive force or inertia of the joints."""
    return _counted("passive", APART, notes)


def _counted(kind: Literal["left out", "passive"], effect: str, notes: Iterable[Note]) -> tuple[Note, ...]:
    counts = Counter(note.effect for note in notes if note.kind == kind)
    return tuple(
        Note(kind, what.removesuffix(f" {effect}"), f"{count} ×", effect) for what, count in counts.items()
    )
