"""Where loops of a robot close, at its own numbers, when no such position is known: on NumPy arrays.

Newton's method with least steps of all joints, q <- q - A^+ phi, from a few starts about q = 0, where itself
loops are often stretched and A loses rank.
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
"""How far around zero starts are, in rad and m."""
TRIES = 6
"""Starts of each width."""
ENOUGH = 4
"""Closed positions to choose among: one of them may be singular."""
STEPS = 60
LONGEST = 0.5
"""Of a step, in rad and m."""
SHORTEST = 1e-10
OPEN = 1e-4
"""In m and rad of the joints, what may be left open that nothing closes: files round their numbers."""
Floats = NDArray[np.float64]


class Closing(NamedTuple):
    """Where the steps from a start ended."""

    q: Floats
    """(n,)"""
    left: Floats
    """phi, (C,), measured as `row_sizes` has it."""
    rows: Floats
    """A, (C, n), measured likewise."""
    slopes: Floats
    """The largest of each coupling, as its file counts."""
    comparable: Floats
    """A without units, so that rows and columns may stand beside each other: metres, of ties and of slides,
    in the robot's size, and couplings by their largest."""

    @property
    def is_closed(self) -> bool:
        """Whether nothing is left open."""
        return self.open_by <= OPEN

    @property
    def open_by(self) -> float:
        """What is left of the row that is open most."""
        return float(np.abs(self.left).max(initial=0.0))


class TieEquations:
    """phi(q) = 0 of what is held in a tree, its couplings too."""

    def __init__(self, tree: JointTree, n: int, held: Sequence[Held]) -> None:
        self._tables, self._numbers = tie_tables(tree, n, held), own_numbers(tree)
        numbers = cast("tuple[Floats, ...]", (self._numbers.translations, self._numbers.offsets))
        size = max(np.abs(a).max(initial=0.0) for a in numbers) or 1.0
        turns = [row in TURNS for one in held for row in ROWS[one.kind]]
        self._sizes = np.where(turns, 1.0, size)[:, None]
        slides = [joint.coordinate for joint in tree.joints if joint.kind == "prismatic"]
        self._slides = np.where(np.isin(np.arange(n), slides), size, 1.0)

    def at(self, q: Floats) -> Closing:
        """phi, without what contacts have, and A at q (n,)."""
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
        """Where the steps from q (n,) end."""
        at = self.at(start)
        for _ in range(STEPS):
            step = np.linalg.lstsq(at.rows, -at.left, rcond=RANK)[0]
            size = np.abs(step).max()
            if size < SHORTEST:
                break
            at = self.at(at.q + step * min(1.0, LONGEST / size))
        return at


def random_starts(n: int) -> list[Floats]:
    """Positions (n,), the same at every call."""
    random = np.random.default_rng(0)
    return [width * random.uniform(-1.0, 1.0, n) for width in WIDTHS for _ in range(TRIES)]


def best_closing(equations: TieEquations, starts: Iterable[Floats]) -> tuple[Closing, tuple[Closing, ...]]:
    """A closed position where A has its largest rank, and all that were found; else what is open least."""
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
