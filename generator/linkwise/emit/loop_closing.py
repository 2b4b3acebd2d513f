"""Where the loops of a robot close at its own numbers: found once, before anything is generated.

Newton's method with least steps of all joints, q <- q - A^+ phi, from a few starts about q = 0, where itself
loops are often stretched and A loses rank.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from linkwise.errors import LinkwiseError
from linkwise.package.entries import RigidTree
from linkwise.runtime.constraints.held_frames import held_by
from linkwise.runtime.constraints.independent_joints import RANK, rank_of
from linkwise.runtime.constraints.singular_positions import open_by
from linkwise.runtime.constraints.tie_arrays import ends, tie_jacobian, violation
from linkwise.runtime.constraints.tie_tables import tie_tables
from linkwise.runtime.rule.joint_tree import (
    JointTree,
    TreeCoupling,
    TreeFrame,
    TreeJoint,
    TreeLink,
    TreeTie,
)
from linkwise.runtime.rule.tree_arrays import own_numbers

WIDTHS = (0.1, 0.3, 1.0, 2.0)
"""How far around zero starts are, in rad and m."""
TRIES = 6
"""Starts of each width."""
ENOUGH = 4
"""Closed positions to choose among: one of them may be singular."""
STEPS = 60
LONGEST = 0.5
"""Of a step, in rad and m."""
SHORTEST = 1e-10
CLOSED = 1e-6
"""In m and rad, what may be left where no step leads on: numbers of files are rounded."""

Array = NDArray[np.float64]


class ClosedLoops(NamedTuple):
    """A position q (n,) in which constraints hold, their Jacobian A (C, n), and the name of each row's."""

    q: Array
    rows: Array
    owners: tuple[str, ...]


def closed_loops(tree: RigidTree, joints: int) -> ClosedLoops:
    """Return one where A has its largest rank; raises LinkwiseError, which names what stays open."""
    equations = _Equations(tree, joints)
    found: list[tuple[Array, Array]] = []
    best: Array | None = None
    for start in _starts(joints):
        q, left, rows = equations.closed_from(start)
        if np.abs(left).max() < CLOSED:
            found.append((q, rows))
            if len(found) == ENOUGH:
                break
        elif best is None or np.abs(left).max() < np.abs(best).max():
            best = left
    if found:
        q, rows = max(found, key=lambda closed: rank_of(closed[1]))
        return ClosedLoops(q, rows, equations.owners)
    assert best is not None  # there are starts
    raise LinkwiseError(equations.told(best))


def _starts(joints: int) -> Iterator[Array]:
    random = np.random.default_rng(0)
    yield from (width * random.uniform(-1.0, 1.0, joints) for width in WIDTHS for _ in range(TRIES))


class _Equations:
    """phi(q) = 0 of a tree's ties and couplings, in its own numbers."""

    def __init__(self, tree: RigidTree, joints: int) -> None:
        moved = joint_tree(tree)
        held = held_by(moved, [link.name for link in moved.links], ())
        self._tables, self._numbers = tie_tables(moved, joints, held), own_numbers(moved)
        couplings = [coupling.name for coupling in tree.couplings]
        self.owners = (*(one.name for one in held for _ in one.row_names), *couplings)
        self._row_names = [*(row for one in held for row in one.row_names), *couplings]

    def closed_from(self, start: Array) -> tuple[Array, Array, Array]:
        """Return where the steps from a start end, phi and A there."""
        q = start[:, None]
        for _ in range(STEPS):
            placed = ends(np, self._tables, self._numbers, q)
            phi = violation(np, self._tables, q, placed, None)[:, 0]
            rows: Array = tie_jacobian(np, self._tables, q, placed)[..., 0]
            step = np.linalg.lstsq(rows, -phi, rcond=RANK)[0]
            size = np.abs(step).max()
            if size < SHORTEST:
                break
            q = q + (step * min(1.0, LONGEST / size))[:, None]
        return q[:, 0], phi, rows

    def told(self, left: Array) -> str:
        """What stays open, by how much."""
        worst = int(np.abs(left).argmax())
        size = open_by(abs(left[worst]), self._row_names[worst])
        return (
            f"constraint {self.owners[worst]!r} never closes: from {TRIES * len(WIDTHS)} positions that were "
            f"tried, {size} are left at best; correct its places, or what it ties"
        )


def joint_tree(tree: RigidTree) -> JointTree:
    """Return what tree.py has, without the formulas of run-time parameters."""
    return JointTree(
        tree.gravity,
        tuple(
            TreeJoint(b.parent, b.kind, b.coordinate, b.ratio, b.rotation, b.translation) for b in tree.bodies
        ),
        tuple(TreeLink(b.link, at, b.mass, b.com, b.inertia) for at, b in enumerate(tree.bodies)),
        tuple(TreeFrame(f.name, f.body, f.rotation, f.translation) for f in tree.frames),
        {},
        tuple(TreeTie(t.name, t.kind, t.first, t.second, t.length) for t in tree.ties),
        tuple(TreeCoupling(c.name, c.terms) for c in tree.couplings),
        tree.independent,
    )
