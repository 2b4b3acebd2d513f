"""The coordinates of a robot that move all others under its constraints: as asked for, or by pivoting."""

from dataclasses import replace

import numpy as np

from linkwise.emit.definition import rigid_tree
from linkwise.emit.loop_closing import Array, closed_loops
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.notes import BESIDE, LEAST, Note
from linkwise.robot.robot import Coupling, Robot, Tie
from linkwise.runtime.constraints.independent_joints import rank_of, redundant_rows
from linkwise.symbolic.system import RigidSystem, System

SHARE = 0.05
"""Columns smaller than this part of the largest are not pivots, whatever joints they are of."""


def constrained_system(system: System) -> System:
    """Return the system with its independent coordinates found, if it has constraints; else as it is.

    Raises LinkwiseError for constraints that never close, that hold nothing or all that moves, and for
    coordinates asked for that others do not follow.
    """
    if not isinstance(system, RigidSystem) or system.robot.independent:
        return system
    robot = system.robot
    if not (robot.ties or robot.couplings):
        return system
    tree = rigid_tree(system)
    assert tree is not None  # of rigid links there is one
    loops = closed_loops(tree, len(robot.coordinates))
    chosen = _independent(robot, loops.rows)
    shared = [owner for owner, is_so in zip(loops.owners, redundant_rows(loops.rows), strict=True) if is_so]
    notes = [Note("constraint", tie.name, _about_tie(tie, robot), BESIDE) for tie in robot.ties]
    notes += [Note("constraint", c.name, _about_coupling(c, robot), BESIDE) for c in robot.couplings]
    notes += [Note("redundant", name, "", LEAST) for name in dict.fromkeys(shared)]
    return replace(system, robot=replace(robot, independent=chosen, notes=(*robot.notes, *notes)))


def _independent(robot: Robot, rows: Array) -> tuple[int, ...]:
    """Return those asked for if they do, else those that pivoting leaves, rather driven ones."""
    names = [coordinate.name for coordinate in robot.coordinates]
    rank = rank_of(rows)
    free = len(names) - rank
    constraints = listed([*(repr(tie.name) for tie in robot.ties), *(repr(c.name) for c in robot.couplings)])
    if not rank:
        raise LinkwiseError(
            f"the constraints {constraints} hold however the joints move, so nothing follows from them; "
            "remove them"
        )
    if not free:
        raise LinkwiseError(
            f"the constraints {constraints} leave nothing to move, so the robot stands still; remove one, or "
            "let it tie less"
        )
    proposed = _proposed(robot, rows, rank)
    if not robot.wanted:
        return proposed
    chosen = sorted(names.index(name) for name in robot.wanted)
    others = listed(names[k] for k in proposed)
    if len(chosen) != free:
        raise LinkwiseError(
            f"{_count(len(chosen))} given as independent, and the constraints leave {free} to choose; "
            f"choose {others}, say"
        )
    rest = [k for k in range(len(names)) if k not in chosen]
    if rank_of(rows[:, rest]) < rank:
        raise LinkwiseError(
            f"{listed(robot.wanted)} cannot be independent, for the other joints do not follow from them; "
            f"choose {others}, say"
        )
    return tuple(chosen)


def _proposed(robot: Robot, rows: Array, rank: int) -> tuple[int, ...]:
    """Return those that pivoting leaves: columns of A are taken one by one, as of dependent ones.

    Of the columns that are not small beside the largest, as far as they stand across those taken, it is
    that of a joint that nothing drives and no spring holds, then of the one farthest from the ground, then of
    the last.
    """
    names = [coordinate.name for coordinate in robot.coordinates]
    depths = [min(_depths(robot, k), default=0) for k in range(len(names))]
    sprung = {axis.coordinate for axis in robot.passive if axis.own.stiffness}
    left, free = rows, set(range(len(names)))
    for _ in range(rank):
        sizes = np.linalg.norm(left, axis=0)
        most = max(sizes[k] for k in free)
        able = [k for k in free if sizes[k] >= SHARE * most]
        pivot = max(able, key=lambda k: (k not in robot.driven, k not in sprung, depths[k], k))
        free.remove(pivot)
        axis = left[:, pivot] / sizes[pivot]
        for _ in range(2):  # once more for what rounding leaves
            left = left - np.outer(axis, axis @ left)
    return tuple(sorted(free))


def _depths(robot: Robot, coordinate: int) -> list[int]:
    """Return how many joints are before those of a coordinate."""
    own = (at for at, link in enumerate(robot.links) if link.joint.coordinate == coordinate)
    return [len(robot.chain(at)) for at in own]


def _count(number: int) -> str:
    return f"{number} joint{' is' if number == 1 else 's are'}"


def _about_tie(tie: Tie, robot: Robot) -> str:
    """What it holds, in words."""
    first, second = (robot.named_frames[frame].name for frame in (tie.first, tie.second))
    length = f" of {tie.length:g} m" if tie.kind == "distance" else ""
    return f"{tie.kind}{length}, {first} and {second}"


def _about_coupling(coupling: Coupling, robot: Robot) -> str:
    return f"coupling, {' and '.join(robot.coordinates[k].name for k, _ in coupling.terms)}"
