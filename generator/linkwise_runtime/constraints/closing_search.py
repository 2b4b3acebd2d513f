"""Search for positions where a robot's loops close, at its own numbers, when none is known: on NumPy arrays.

Newton's method with least-norm steps of all joints, q <- q - A^+ phi, from a few starts around zero, but not
from zero itself, where loops are often stretched and A loses rank.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..answers.namespace import NUMPY, array_of
from ..rule.joint_tree import JointTree
from ..rule.tree_arrays import own_numbers
from .held_frames import ROWS, TURNS, Held, tie_tables
from .independent_joints import RANK, rank_of
from .tie_arrays import pairs, tie_jacobian, violation

WIDTHS = (0.1, 0.3, 1.0, 2.0)
"""Largest distance of starts from zero for each group of starts, in rad and m."""
TRIES = 6
"""Number of starts for each width."""
ENOUGH = 4
"""Number of closed positions to choose among: one of them may be singular."""
STEPS = 60
LONGEST = 0.5
"""Largest step of a joint, in rad and m."""
SHORTEST = 1e-10
OPEN = 1e-4
"""Largest violation, in m and rad, that may stay where nothing closes it: files round their numbers."""
Floats = NDArray[np.float64]


class Closing(NamedTuple):
    """End of the steps from one start."""

    q: Floats
    """(n,)"""
    left: Floats
    """phi, (C,), scaled as `row_sizes` says."""
    rows: Floats
    """A, (C, n), scaled likewise."""
    slopes: Floats
    """Largest slope of each coupling, in the units of its file."""
    comparable: Floats
    """A without units, so that rows and columns can be compared: lengths, of ties and of sliding joints, are
    in units of the robot's size, and couplings are divided by their largest entry."""

    @property
    def is_closed(self) -> bool:
        """True if no row is left open."""
        return self.open_by <= OPEN

    @property
    def open_by(self) -> float:
        """Violation of the row that is open most."""
        return float(np.abs(self.left).max(initial=0.0))


class TieEquations:
    """Equations phi(q) = 0 of what is held in a tree, its couplings included."""

    def __init__(self, tree: JointTree, n: int, held: Sequence[Held]) -> None:
        self._tables, self._numbers = tie_tables(tree, n, held), own_numbers(tree)
        numbers = cast("tuple[Floats, ...]", (self._numbers.translations, self._numbers.offsets))
        size = max(np.abs(a).max(initial=0.0) for a in numbers) or 1.0
        turns = [row in TURNS for one in held for row in ROWS[one.kind]]
        self._sizes = np.where(turns, 1.0, size)[:, None]
        slides = [joint.coordinate for joint in tree.joints if joint.kind == "prismatic"]
        self._slides = np.where(np.isin(np.arange(n), slides), size, 1.0)

    def at(self, q: Floats) -> Closing:
        """Return phi, in which contacts have no violation, and A at q (n,)."""
        column = q[:, None]
        placed = pairs(NUMPY, self._tables, self._numbers, column)
        phi, rows = (
            array_of(made(NUMPY, self._tables, column, placed))[..., 0] for made in (violation, tie_jacobian)
        )
        ties, couplings = np.split(rows * self._slides, [len(self._sizes)])
        slopes = np.abs(rows[len(ties) :]).max(-1, initial=0.0)
        ones, most = np.ones(len(ties)), np.abs(couplings).max(-1, keepdims=True)
        sizes = np.concatenate([ones, np.maximum(slopes, 1.0)])
        comparable = np.concatenate([ties / self._sizes, couplings / np.where(most > 0.0, most, 1.0)])
        return Closing(q, phi / sizes, rows / sizes[:, None], slopes, comparable)

    def closed_from(self, start: Floats) -> Closing:
        """Return the end of the steps from q (n,)."""
        at = self.at(start)
        for _ in range(STEPS):
            step = np.linalg.lstsq(at.rows, -at.left, rcond=RANK)[0]
            size = np.abs(step).max()
            if size < SHORTEST:
                break
            at = self.at(at.q + step * min(1.0, LONGEST / size))
        return at


def random_starts(n: int) -> list[Floats]:
    """Return starting positions (n,), the same ones at every call."""
    random = np.random.default_rng(0)
    return [width * random.uniform(-1.0, 1.0, n) for width in WIDTHS for _ in range(TRIES)]


def best_closing(equations: TieEquations, starts: Iterable[Floats]) -> tuple[Closing, tuple[Closing, ...]]:
    """Return the closed position with the largest rank of A, and all that were found.

    Where none closes, return the position that is open least.
    """
    ended = []
    for start in starts:
        ended.append(equations.closed_from(start))
        closed = [at for at in ended if at.is_closed]
        if len(closed) == ENOUGH:
            break
    best = (
        max(closed, key=lambda at: rank_of(at.comparable))
        if closed
        else min(ended, key=lambda at: at.open_by)
    )
    return best, tuple(closed)
