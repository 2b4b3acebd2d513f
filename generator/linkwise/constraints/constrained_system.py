"""The coordinates of a robot that move all others under its constraints: as asked for, or by pivoting."""

import shlex
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from linkwise_runtime.constraints.independent_joints import chosen_independent, rank_of, redundant_names
from linkwise_runtime.rule.joint_tree import TreeTie

from linkwise.arrays import Array
from linkwise.constraints.loop_closing import ClosedLoops, closed_constraints, closed_loops
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.notes import BESIDE, LEAST, Note
from linkwise.robot.robot import Coupling, Robot
from linkwise.symbolic.definition import exact_text, joint_tree
from linkwise.symbolic.system import EnergySystem, System


def constrained_system(system: System) -> System:
    """Return the system with its independent coordinates found, if it has constraints; else as it is.

    Raises LinkwiseError for constraints that never close, that hold nothing or all that moves, and for
    requested coordinates that the others do not follow.
    """
    if isinstance(system, EnergySystem):
        return _constrained_energies(system) if system.constraints and not system.independent else system
    if system.robot.independent:
        return system
    robot = system.robot
    if not (robot.ties or robot.couplings):
        return system
    tree = joint_tree(system)
    assert tree is not None  # rigid links always have one
    loops = closed_loops(tree, len(robot.coordinates))
    names = [coordinate.name for coordinate in robot.coordinates]
    requested = [names.index(name) for name in robot.requested_independent]
    chosen = _independent(loops, names, _proposed(robot, loops.rows), requested)
    position = loops.position(chosen)
    held = replace(
        robot, independent=chosen, closed_position=position, notes=(*robot.notes, *_notes(system, loops))
    )
    return replace(system, robot=held)


def _constrained_energies(system: EnergySystem) -> EnergySystem:
    names = [coordinate.name for coordinate in system.coordinates]
    loops = closed_constraints(system)
    slides = [(float(coordinate.unit == "m"),) for coordinate in system.coordinates]
    proposed = chosen_independent(loops.rows, (), slides)
    chosen = _independent(loops, names, proposed, system.requested_independent, "independent=")
    position = loops.position(chosen)
    return replace(
        system, independent=chosen, closed_position=position, notes=(*system.notes, *_notes(system, loops))
    )


def _notes(system: System, loops: ClosedLoops) -> list[Note]:
    return [
        *(Note("constraint", name, about, BESIDE) for name, about in constraints_of(system)),
        *(Note("redundant", name, "", LEAST) for name in redundant_names(loops.rows, loops.owners)),
    ]


def constraints_of(system: System) -> Iterator[tuple[str, str]]:
    """Yield the name of each constraint of the joints, and what it holds, in words; none of an open tree."""
    if isinstance(system, EnergySystem):
        yield from ((one.name, f"{exact_text(one.expression)} = 0") for one in system.constraints)
        return
    robot = system.robot
    yield from ((tie.name, _about_tie(tie, robot)) for tie in robot.ties)
    yield from ((coupling.name, _about_coupling(coupling, robot)) for coupling in robot.couplings)


def _independent(
    loops: ClosedLoops,
    names: Sequence[str],
    proposed: Sequence[int],
    requested: Sequence[int],
    option: str = "--independent",
) -> tuple[int, ...]:
    """Return the independent coordinates: those asked for, or those proposed.

    Raises LinkwiseError for constraints that hold nothing or all that moves, and for coordinates asked for
    that are too many or too few, or that the others do not follow.
    """
    rows = loops.rows
    rank = rank_of(rows)
    free = len(names) - rank
    constraints = listed(map(repr, dict.fromkeys(loops.owners)))
    if not rank:
        raise LinkwiseError(
            f"the constraints {constraints} hold however the joints move, or where these are at a dead point "
            "alone, so nothing follows from them; remove them, or give them lengths that let the robot move"
        )
    if not free:
        raise LinkwiseError(
            f"the constraints {constraints} leave nothing to move, so the robot stands still; remove one, or "
            "let it tie less"
        )
    if not requested:
        return tuple(proposed)
    chosen = sorted(requested)
    others = [names[k] for k in proposed]
    told = f"{option}{others!r}" if option.endswith("=") else _asked(others)
    if len(chosen) != free:
        raise LinkwiseError(
            f"{_count(len(chosen))} given as independent, and the constraints leave {free} to choose; "
            f"choose {told}, say"
        )
    rest = [k for k in range(len(names)) if k not in chosen]
    if rank_of(rows[:, rest]) < rank:
        raise LinkwiseError(
            f"{listed(names[k] for k in chosen)} cannot be independent, for the other joints do not "
            f"follow from them; choose {told}, say"
        )
    return tuple(chosen)


def _proposed(robot: Robot, rows: Array) -> tuple[int, ...]:
    """Return the independent coordinates that pivoting leaves.

    Dependent are first joints that the file has follow others, from which they follow everywhere, unless
    actuators drive them; then rather joints that nothing drives, that follow, that slide, that no spring
    holds, those farthest from the ground, and the last.
    """
    followers = {coupling.follower for coupling in robot.couplings}
    sprung = {axis.coordinate for axis in robot.passive if axis.stiffness}
    free = range(len(robot.coordinates))
    depths = [min(_depths(robot, k), default=0) for k in free]
    slides = [coordinate.unit == "m" for coordinate in robot.coordinates]
    preference = [
        (k not in robot.driven, k in followers, slides[k], k not in sprung, depths[k]) for k in free
    ]
    first = [k for k in free if k in followers and k not in robot.driven]
    return chosen_independent(rows, first, preference)


def _depths(robot: Robot, coordinate: int) -> list[int]:
    """Return the length of the chain to each joint of a coordinate, itself included."""
    own = (at for at, link in enumerate(robot.links) if link.joint.coordinate == coordinate)
    return [len(robot.chain(at)) for at in own]


def _asked(names: Iterable[str]) -> str:
    """Return the options that ask for joints; one whose name has a comma has an option of its own."""
    plain, apart = list[str](), list[str]()
    for name in names:
        (apart if "," in name else plain).append(name)
    lists = [*([",".join(plain)] if plain else []), *apart]
    return " ".join(f"--independent {shlex.quote(text)}" for text in lists)


def _count(number: int) -> str:
    return f"{number} joint{' is' if number == 1 else 's are'}"


def _about_tie(tie: TreeTie, robot: Robot) -> str:
    """Return what a tie holds, in words."""
    first, second = (robot.named_frames[frame].name for frame in (tie.first, tie.second))
    length = f" of {tie.length:g} m" if tie.kind == "distance" else ""
    return f"{tie.kind}{length}, {first} and {second}"


def _about_coupling(coupling: Coupling, robot: Robot) -> str:
    return f"coupling, {' and '.join(robot.coordinates[k].name for k, _ in coupling.terms)}"
