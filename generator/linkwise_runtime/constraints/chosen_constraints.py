"""Choice of a robot's constraints and independent joints, made once at a position where the loops close.

Where no such position is known, one is searched for at the robot's own numbers, on NumPy arrays: by Newton's
method with least-norm steps of all joints, q <- q - A^+ phi, from a few starts around zero, but not from zero
itself, where loops are often stretched and A loses rank.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..arguments import as_array, check_numbers, kept_numbers
from ..chosen_names import listed, short
from ..interface import NUMPY, array_of
from ..rule.joint_tree import JointTree
from ..rule.tree_arrays import own_numbers
from ..structure import Structure
from .held_frames import ROWS, TURNS, Held, all_names, held_by, tie_tables
from .independent_joints import RANK, chosen_independent, loose_base, rank_of, redundant_names
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
APART = 1e6
"""Largest ratio of weights of forces."""
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


class ClosingEquations:
    """Equations phi(q) = 0 with rows A, and steps of least norm to where they hold."""

    def at(self, q: Floats) -> Closing:
        """Return phi and A at q (n,)."""
        raise NotImplementedError

    def closed_from(self, start: Floats) -> Closing:
        """Return the end of the steps from q (n,)."""
        raise NotImplementedError


class TieEquations(ClosingEquations):
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
        """Return the end of Newton's steps from q (n,), each no longer than `LONGEST`."""
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


def best_closing(
    equations: ClosingEquations, starts: Iterable[Floats]
) -> tuple[Closing, tuple[Closing, ...]]:
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


class ChosenConstraints:
    """Constraints of a robot and its independent joints."""

    names: tuple[str, ...]
    """Names of the constraints."""
    rows: tuple[str, ...]
    """Name of each row, which says what it holds."""
    row_units: tuple[str, ...]
    """Unit in which each row is open; empty where its author's coefficients set it."""
    row_names: tuple[str, ...]
    """Name of the constraint that each row belongs to."""
    independent: tuple[int, ...]
    of_positions: bool
    """True if positions of the independent joints tell those of the others; rolling is of velocities."""
    _structure: Structure
    _own: tuple[int, ...]
    """Independent joints of the package; empty where it has none."""
    _own_position: tuple[float, ...]
    """Closed position of the package."""

    force_weight: NDArray[np.float64] | None = None
    """Weights of the squares of the forces of redundant rows, (C,); None where all weigh alike."""

    def weigh(self, given: object) -> None:
        """Read the weights of forces, by row or by name; raises ValueError for what are none."""
        if given is None:
            return
        weight = self._by_name(given) if isinstance(given, Mapping) else kept_numbers("force_weight", given)
        if weight is None or weight.shape != (len(self.rows),) or not (weight > 0.0).all():
            raise ValueError(
                f"force_weight is {short(given)}; give a number above 0 for each of the {len(self.rows)} "
                f"rows, or by name for some of {listed(list(dict.fromkeys(self.row_names)))}"
            )
        if not weight.max() <= APART * weight.min():
            raise ValueError(
                f"force_weight is {short(given)}, of which some are more than {APART:g} times others; "
                "digits of forces would be lost"
            )
        self.force_weight = weight

    def _by_name(self, given: Mapping[str, object]) -> NDArray[np.float64] | None:
        """Return weights by row of those by name; None where a name or a number is none."""
        weights = dict.fromkeys(self.row_names, 1.0)
        for name, value in given.items():
            weight = kept_numbers(f"force_weight[{name!r}]", value)
            if name not in weights or weight is None or weight.ndim:
                return None
            weights[name] = float(weight)
        return np.array([weights[name] for name in self.row_names])

    def _choose(self, independent: object, at: object, loose: Sequence[int], contacts: bool = False) -> None:
        """Choose the independent joints; loose: those that rather follow others, as nothing drives them."""
        self._at = None if at is None else self._position(at)
        self._is_own = independent is None and not contacts and bool(self._own)
        self.independent = self._independent(independent, loose)

    def _closed(self) -> Closing:
        """Return a position near `at`, or any without it, where constraints hold, at its own numbers."""
        raise NotImplementedError

    def _best(self, equations: ClosingEquations) -> Closing:
        """Return the best end of steps from `at`, or of a few starts; raises ValueError where it is open."""
        starts = random_starts(self._structure.n) if self._at is None else [self._at]
        found, _ = best_closing(equations, starts)
        if not found.is_closed:
            told = "from any position that was tried; give `at`" if self._at is None else "beside `at`"
            raise ValueError(f"{listed(self.names)} did not close {told}")
        return found

    @cached_property
    def redundant(self) -> tuple[str, ...]:
        """Names of the constraints some of whose rows follow from other rows."""
        return redundant_names(self._closing.comparable, self.row_names)

    @cached_property
    def closed_position(self) -> NDArray[np.float64]:
        """Position (n,) where constraints hold: the package's, or that at which other joints were chosen."""
        if self._is_own and self._at is None:
            return np.array(self._own_position)
        return self._closing.q

    @cached_property
    def _closing(self) -> Closing:
        return self._closed()

    def _independent(self, given: object, loose: Sequence[int]) -> tuple[int, ...]:
        if self._is_own:
            return self._own
        matrix = self._closing.comparable
        n, names = self._structure.n, self._structure.joint_names
        free = n - rank_of(matrix)
        if not free:
            raise ValueError(f"{listed(self.names)} leave nothing to move: the robot is over-constrained")
        # Joints that follow by the package's constraints alone stay dependent when contacts are added.
        following = [k for k in range(n) if self._own and k not in self._own]
        proposed = chosen_independent(matrix, tuple(dict.fromkeys((*loose, *following))))
        if given is None:
            return proposed
        chosen = self._listed(given)
        told = f"such as {[names[k] for k in proposed]}"
        if len(chosen) != free:
            count = f"{len(chosen)} joint{'s' if len(chosen) != 1 else ''}"
            raise ValueError(f"independent has {count}, but the constraints leave {free} to choose, {told}")
        rest = [k for k in range(n) if k not in chosen]
        if rank_of(matrix[:, rest]) < n - free:
            mine = listed([names[k] for k in chosen])
            raise ValueError(
                f"the other joints do not follow {mine}, of which some follow others; choose others, {told}"
            )
        return chosen

    def _listed(self, given: object) -> tuple[int, ...]:
        if isinstance(given, str) or not isinstance(given, list | tuple):
            raise TypeError(f"independent is {short(given)}; give a list of joints by number or by name")
        chosen = sorted(self._structure.joint_index(joint, "independent") for joint in given)
        if len(set(chosen)) < len(chosen):
            raise ValueError(f"independent is {short(given)}, which names a joint twice")
        return tuple(chosen)

    def _position(self, at: object) -> NDArray[np.float64]:
        found = as_array("at", at)
        if found.shape != (self._structure.n,) or found.dtype.kind not in "fiu":
            raise ValueError(f"at has shape {found.shape}; give one position of shape ({self._structure.n},)")
        check_numbers({"at": found}, self._structure.joint_names)
        position: NDArray[np.float64] = found.astype(float)
        return position


class TreeConstraints(ChosenConstraints):
    """Ties, couplings and contacts of a tree, and independent joints."""

    def __init__(
        self, structure: Structure, tree: JointTree, independent: object, contacts: object, at: object
    ) -> None:
        """Choose constraints and independent joints; raises as `Dynamics.constrained` does."""
        self._structure, self.tree = structure, tree
        self._own, self._own_position = tree.independent, tree.closed_position
        self.held: Sequence[Held] = held_by(tree, contacts)
        if not self.held and not tree.couplings:
            raise ValueError(
                f"{structure.name} has no ties; robot.constrained(contacts=[Contact(frame)]) makes some that "
                "hold frames of it where they are"
            )
        self.tables = tie_tables(tree, structure.n, self.held)
        self.names = all_names(self.held, tree)
        self.couplings = len(tree.couplings)
        """Number of couplings, whose rows are the last ones."""
        self.rows = (
            *(row for one in self.held for row in one.row_names),
            *(coupling.name for coupling in tree.couplings),
        )
        self.row_units = (
            *(unit for one in self.held for unit in one.row_units),
            *("" for _ in tree.couplings),  # whose coefficients set the unit of their sum
        )
        self.row_names = tuple(
            [one.name for one in self.held for _ in one.row_names] + [c.name for c in tree.couplings]
        )
        self.of_positions = not any(any(one.arm) for one in self.held)
        self._choose(independent, at, loose_base(tree) if contacts else (), bool(contacts))

    @property
    def has_contacts(self) -> bool:
        """True if the ground holds frames, beside the ties of the tree."""
        return any(one.second is None for one in self.held)

    def _closed(self) -> Closing:
        tree, n = self.tree, self._structure.n
        if tree.tied:
            q = self._best(TieEquations(tree, n, [one for one in self.held if one.second is not None])).q
        else:
            q = random_starts(n)[0] if self._at is None else self._at
        return TieEquations(tree, n, self.held).at(q)
