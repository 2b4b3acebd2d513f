"""Constraints beside the tree of a robot: ties of frames, couplings of joints, and what moves them.

Joints that are locked or follow others are put into the couplings.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp
from linkwise_runtime.chosen_names import nearest_first
from linkwise_runtime.rule.joint_tree import TreeTie

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.coordinates import AxisRule, Movement, check_constraint_count
from linkwise.robot.description import Description, JointCoupling
from linkwise.robot.joint_types import expand
from linkwise.robot.notes import UNCOUPLED, Note
from linkwise.robot.robot import Coupling, Frame, unusable
from linkwise.robot.ties import Ends, check_ties, frame_ties

CLOSE = 1e-9
"""Tolerance in rad and m: joints that stand still may miss a coupling by this much."""


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


def coordinate_couplings(
    couplings: Iterable[JointCoupling],
    motion: Mapping[str, AxisRule],
    lock: Collection[str],
    free: bool,
) -> tuple[tuple[Coupling, ...], list[Note]]:
    """Return the couplings of the coordinates, and notes on couplings that constrain no coordinate.

    Locking the first joint of a coupling lets the others move by themselves, as with a mimic joint; locking
    the others holds the first. `free` drops MJCF's equalities, and couplings whose master was cut away.
    Raises LinkwiseError for a master that was cut away, and for joints that cannot keep a coupling.
    """
    found: list[Coupling] = []
    notes: list[Note] = []
    for coupling in couplings:
        follower, *masters = (joint for joint, _ in coupling.terms)
        lost = [joint for joint in masters if joint not in motion]
        by = "an equality" if coupling.equality else f"constraint {coupling.name!r}"
        if follower not in motion:
            notes.append(Note("cut", coupling.name, f"joint {follower!r} of that constraint is not there"))
        elif lost and not free:
            raise LinkwiseError(_orphan(coupling, follower, lost[0]))
        elif follower in lock:
            notes.append(Note("freed", follower, f"locked, though {coupling.rule} by {by}", UNCOUPLED))
        elif lost or (free and coupling.equality):
            notes.append(Note("freed", follower, f"{coupling.rule} by {by}", UNCOUPLED))
        elif terms := _terms(coupling, motion):
            found.append(Coupling(coupling.name, terms, _given_by_others(motion[follower], terms)))
        else:
            notes.append(Note("ignored", coupling.name, "a constraint on joints that keep it anyway"))
    return tuple(found), notes


def check_joints(couplings: Iterable[JointCoupling], axes: Collection[str]) -> None:
    """Raise LinkwiseError for a joint that the file does not have, and for unusable numbers."""
    for coupling in couplings:
        if fault := unusable(*(c for _, coefficients in coupling.terms for c in coefficients)):
            raise LinkwiseError(f"constraint {coupling.name!r} has {fault} in its terms; give numbers")
        for joint, _ in coupling.terms:
            if joint not in axes:
                raise LinkwiseError(
                    f"constraint {coupling.name!r} couples {joint!r}, which is not a joint that moves; "
                    f"correct it: the joints are {listed(nearest_first(joint, sorted(axes)))}"
                )


def _orphan(coupling: JointCoupling, follower: str, master: str) -> str:
    return (
        f"joint {follower!r} is coupled to {master!r} by constraint {coupling.name!r}, which is not a moving "
        f"joint here; hold it with --lock {follower}=0, or let such joints move by themselves with "
        "--free-mimic"
    )


def _terms(
    coupling: JointCoupling, motion: Mapping[str, AxisRule]
) -> tuple[tuple[int, tuple[float, ...]], ...]:
    """Return the terms by coordinate, all constants in the first; empty if no moving joint is constrained.

    Raises LinkwiseError if joints that stand still, or move as one, miss the coupling.
    """
    constant, by_coordinate = 0.0, dict[int, list[float]]()
    for joint, coefficients in coupling.terms:
        rule = motion[joint]
        moved = compose_polynomial(coefficients, rule.ratio, rule.offset)
        if rule.coordinate is None:
            constant += moved[0]
            continue
        total = by_coordinate.setdefault(rule.coordinate, [])
        total += [0.0] * (len(moved) - len(total))
        for power, coefficient in enumerate(moved):
            total[power] += coefficient
    constant += sum(total[0] for total in by_coordinate.values())
    kept = {k: total for k, total in sorted(by_coordinate.items()) if any(total[1:])}
    if not kept and abs(constant) > CLOSE:
        raise LinkwiseError(
            f"constraint {coupling.name!r} cannot hold: the joints that it couples stand still or move as "
            f"one, and miss it by {abs(constant):.3g}; correct it"
        )
    first = min(kept, default=None)
    return tuple((k, (constant if k == first else 0.0, *total[1:])) for k, total in kept.items())


def _given_by_others(rule: AxisRule, terms: tuple[tuple[int, tuple[float, ...]], ...]) -> int | None:
    """Return the coordinate of the first joint, if its term has one value for each sum of the others."""
    for coordinate, factors in terms:
        if coordinate == rule.coordinate and len(terms) > 1 and not any(factors[2:]):
            return coordinate
    return None


def compose_polynomial(coefficients: tuple[float, ...], ratio: float, offset: float) -> tuple[float, ...]:
    """Return the polynomial p(ratio q + offset) in q, by Horner's rule."""
    result = [0.0]
    for coefficient in reversed(coefficients):
        shifted = [offset * c for c in result] + [0.0]
        for power, c in enumerate(result):
            shifted[power + 1] += ratio * c
        shifted[0] += coefficient
        result = shifted
    return tuple(result[: len(coefficients)])
