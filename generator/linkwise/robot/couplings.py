"""Couplings of joints as constraints on coordinates; joints that are locked or follow others are put in."""

from collections.abc import Collection, Iterable, Mapping

from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.coordinates import AxisRule
from linkwise.robot.description import JointCoupling
from linkwise.robot.notes import UNCOUPLED, Note
from linkwise.robot.robot import Coupling, unusable

CLOSE = 1e-9
"""Tolerance in rad and m: joints that stand still may miss a coupling by this much."""


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
