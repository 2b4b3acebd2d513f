"""Constraints beside the tree of a robot: ties of frames, couplings of joints, and what moves them."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import sympy as sp
from linkwise_runtime.chosen_names import nearest_first
from linkwise_runtime.rule.joint_tree import TreeTie

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.coordinates import Movement
from linkwise.robot.couplings import check_joints, coordinate_couplings
from linkwise.robot.description import Description
from linkwise.robot.joint_types import expand
from linkwise.robot.notes import Note
from linkwise.robot.robot import Coupling, Frame
from linkwise.robot.size import check_constraint_count
from linkwise.robot.ties import Ends, check_ties, frame_ties


@dataclass(frozen=True)
class Constrained:
    """Constraints of a robot.

    `requested_independent` are the names of the joints asked for as independent, `driven` the coordinates
    that actuators drive.
    """

    ties: tuple[TreeTie, ...]
    couplings: tuple[Coupling, ...]
    requested_independent: tuple[str, ...]
    driven: tuple[int, ...]
    notes: tuple[Note, ...]


def check_constraints(description: Description) -> None:
    """Raise LinkwiseError for a constraint whose name is empty or repeated, or on unknown links or joints."""
    names = Counter([tie.name for tie in description.ties] + [c.name for c in description.couplings])
    for name, count in names.items():
        if not name.strip():
            raise LinkwiseError("a constraint has an empty name; name it")
        if count > 1:
            raise LinkwiseError(f"{count} constraints are named {name!r}; rename all but one")
    check_ties(description.ties, description.bodies, description.sites)
    if description.couplings:
        check_joints(
            description.couplings, {axis.name for c in description.connections for axis in expand(c)}
        )


def remaining_constraints(
    description: Description,
    ends: Ends,
    frames: Sequence[Frame],
    movement: Movement,
    lock: Collection[str],
    free_mimic: bool,
    independent: tuple[str, ...],
) -> Constrained:
    """Return the constraints among the frames and coordinates that are left.

    independent: names from the command line, which take precedence over the file's. Raises LinkwiseError for
    a constraint of which a part was cut away, for far too many constraints, for `independent` without any,
    and for names that are not of coordinates or are given twice.
    """
    values = {sp.Symbol(name, real=True): value for name, value in description.parameters}
    ties, lost = frame_ties(description.ties, ends, frames, values)
    couplings, uncoupled = coordinate_couplings(description.couplings, movement.motion, lock, free_mimic)
    check_constraint_count(len(ties) + len(couplings), len(movement.coordinates))
    wanted = independent or description.independent
    if not (ties or couplings):
        if independent:
            raise LinkwiseError("--independent is for constraints, and here are none; leave it out")
        wanted = ()
    known = {coordinate.name: k for k, coordinate in enumerate(movement.coordinates)}
    wanted = tuple(name for item in wanted for name in (_names(item, known) if independent else [item]))
    for name, count in Counter(wanted).items():
        if name not in known:
            told = f"the joints are {listed(nearest_first(name, known))}"
            raise LinkwiseError(
                f"--independent {name!r} is not a moving joint; {told}"
                if independent
                else f"independent has {name!r}, which is not a moving joint; {told}"
            )
        if count > 1:
            raise LinkwiseError(f"the independent joint {name!r} is given {count} times; give it once")
    rules = (movement.motion[name].coordinate for name in description.driven if name in movement.motion)
    driven = sorted({k for k in rules if k is not None})
    return Constrained(ties, couplings, wanted, tuple(driven), (*lost, *uncoupled))


def _names(item: str, known: Collection[str]) -> list[str]:
    """Return the names in a list A,B of the command line; a joint's own name may have commas."""
    return [item] if item in known else [name.strip() for name in item.split(",")]
