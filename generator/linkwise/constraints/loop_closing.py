"""Search for where the loops of a robot close at its own numbers: done once, before anything is generated."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import sympy as sp
from linkwise_runtime.constraints.chosen_constraints import (
    TRIES,
    Closing,
    ClosingEquations,
    TieEquations,
    best_closing,
    random_starts,
)
from linkwise_runtime.constraints.closed_places import open_by
from linkwise_runtime.constraints.held_frames import held_by
from linkwise_runtime.constraints.written_rows import WrittenEquations
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.symbolic.system import EnergySystem

FAR = 0.3
"""Positions whose least singular value of A_d is below this part of the best one's count as next to
singular."""
FLAT = 1e-4
"""Slopes below this part of a coupling's factors count as zero: steps end where rows have all but lost
rank."""


class ClosedLoops(NamedTuple):
    """Positions in which constraints hold, A (C, n) at one, with comparable rows, and each row's owner."""

    closed: tuple[Closing, ...]
    """Positions, the one nearest to zero first."""
    rows: Array
    owners: tuple[str, ...]

    def position(self, independent: Sequence[int]) -> tuple[float, ...]:
        """Return the first closed position where the other joints follow well, or as well as any, to 1e-9."""
        dependent = [k for k in range(self.rows.shape[1]) if k not in independent]
        least = [_share(at.comparable, dependent) for at in self.closed]
        best = next(at for at, size in zip(self.closed, least, strict=True) if size >= FAR * max(least))
        return tuple(round(float(x), 9) + 0.0 for x in best.q)


def _share(rows: Array, dependent: Sequence[int]) -> float:
    """Return how well dependent joints follow beside how well any may; 0 where no joint moves the rows."""
    most = float(np.abs(rows).max())
    return float(np.linalg.svd(rows[:, dependent], compute_uv=False)[-1]) / most if most else 0.0


def closed_loops(tree: JointTree, joints: int) -> ClosedLoops:
    """Return closed positions of a tree, and A where it has its largest rank.

    Raises LinkwiseError, which names what stays open.
    """
    held = held_by(tree, ())
    couplings = [coupling.name for coupling in tree.couplings]
    owners = (*(one.name for one in held for _ in one.row_names), *couplings)
    rows = [*(row for one in held for row in one.row_names), *couplings]
    sizes = {
        coupling.name: min(max(map(abs, factors[1:])) for _, factors in coupling.terms)
        for coupling in tree.couplings
    }
    return _closed(TieEquations(tree, joints, held), joints, owners, rows, sizes)


def closed_constraints(system: EnergySystem) -> ClosedLoops:
    """Return positions in which constraints that a user wrote hold, as `closed_loops` does."""
    numbers = {symbol: sp.Float(value, 17) for symbol, value in system.parameters.items()}
    coordinates = system.coordinates
    matrix = [
        [one.expression if one.holonomic else sp.S.Zero, *one.row(coordinates)] for one in system.constraints
    ]
    made = sp.lambdify([[c.q for c in coordinates]], sp.Matrix(matrix).xreplace(numbers), "numpy", cse=True)

    def rows(q: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.asarray(made(q), np.float64)

    n, names = len(coordinates), tuple(one.name for one in system.constraints)
    slopes = np.array([np.abs(rows(start)[:, 1:]).max(-1) for start in random_starts(n)])
    sizes = {
        one.name: float(np.median(own[np.isfinite(own)]) if np.isfinite(own).any() else 0.0)
        for one, own in zip(system.constraints, slopes.T, strict=True)
        if one.holonomic
    }
    return _closed(WrittenEquations(rows), n, names, list(names), sizes)


def _closed(
    equations: ClosingEquations,
    joints: int,
    owners: tuple[str, ...],
    rows: Sequence[str],
    sizes: Mapping[str, float],
) -> ClosedLoops:
    """Return closed positions.

    rows, owners: names of rows, and of the constraint of each; sizes: usual slopes of those whose rows come
    last, each with one row
    """
    starts = random_starts(joints)
    found, closed = best_closing(equations, starts)
    if not found.is_closed:
        raise LinkwiseError(_left_open(found, owners, rows, len(starts)))
    slopes = dict(zip(owners[len(owners) - len(found.slopes) :], found.slopes, strict=True))
    _check_slopes(slopes, sizes)
    upright, *wider = (equations.closed_from(start) for start in (np.zeros(joints), *starts[TRIES::TRIES]))
    there = tuple(at for at in (upright, *closed, *wider) if at.is_closed)
    return ClosedLoops(there, found.comparable, owners)


def _check_slopes(slopes: Mapping[str, float], sizes: Mapping[str, float]) -> None:
    """Raise LinkwiseError for a constraint that has no slope where it is zero, as a sum of squares."""
    for name, size in sizes.items():
        if slopes[name] <= FLAT * size:
            raise LinkwiseError(
                f"constraint {name!r} closes only where it is singular: no motion of its joints "
                "changes its sum there, so that none follows from others; write a sum that changes its sign"
            )


def _left_open(found: Closing, owners: tuple[str, ...], rows: Sequence[str], tries: int) -> str:
    """Return what stays open, and by how much, in words."""
    worst = int(np.abs(found.left).argmax())
    return (
        f"constraint {owners[worst]!r} never closes: from {tries} positions that were tried, "
        f"{open_by(found.open_by, rows[worst])} are left at best; correct its places, or what it ties"
    )
