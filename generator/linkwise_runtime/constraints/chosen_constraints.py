"""Choice of a robot's constraints and independent joints, made once at a position where the loops close."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arguments import as_array, check_numbers
from ..chosen_names import listed, short
from ..rule.joint_tree import JointTree
from ..structure import Structure
from .closing_search import Closing, TieEquations, best_closing, random_starts
from .held_frames import Held, all_names, held_by, tie_tables
from .independent_joints import chosen_independent, loose_base, rank_of, redundant_names


class ChosenConstraints:
    """Ties, couplings and contacts of a robot, and its independent joints."""

    def __init__(
        self, structure: Structure, tree: JointTree, independent: object, contacts: object, at: object
    ) -> None:
        """Choose constraints and independent joints; raises as `Dynamics.constrained` does."""
        self._structure, self._tree = structure, tree
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
        self._at = None if at is None else self._position(at)
        self._is_own = independent is None and not contacts and bool(tree.independent)
        self.independent = self._independent(independent, bool(contacts))

    @cached_property
    def redundant(self) -> tuple[str, ...]:
        """Names of the constraints some of whose rows follow from other rows."""
        return redundant_names(self._matrix, self.row_names)

    @cached_property
    def closed_position(self) -> NDArray[np.float64]:
        """Position (n,) where ties close: the tree's own, or the one at which other joints were chosen."""
        if self._is_own and self._at is None:
            return np.array(self._tree.closed_position)
        return self._closing.q

    @property
    def _matrix(self) -> NDArray[np.float64]:
        return self._closing.comparable

    @cached_property
    def _closing(self) -> Closing:
        """Position near `at`, or any without it, where loops close, with A, at the tree's own numbers."""
        tree, n = self._tree, self._structure.n
        starts = random_starts(n) if self._at is None else [self._at]
        q = starts[0]
        if tree.tied:
            ties = TieEquations(tree, n, [one for one in self.held if one.second is not None])
            found, _ = best_closing(ties, starts)
            if not found.is_closed:
                told = "from any position that was tried; give `at`" if self._at is None else "beside `at`"
                raise ValueError(f"{listed(self.names)} did not close {told}")
            q = found.q
        return TieEquations(tree, n, self.held).at(q)

    def _independent(self, given: object, has_contacts: bool) -> tuple[int, ...]:
        if self._is_own:
            return self._tree.independent
        n, names = self._structure.n, self._structure.joint_names
        free = n - rank_of(self._matrix)
        if not free:
            raise ValueError(f"{listed(self.names)} leave nothing to move: the robot is over-constrained")
        # Joints that follow by the ties alone stay dependent when contacts are added.
        following = [k for k in range(n) if self._tree.independent and k not in self._tree.independent]
        first = (*loose_base(self._tree), *following) if has_contacts else following
        proposed = chosen_independent(self._matrix, tuple(dict.fromkeys(first)))
        if given is None:
            return proposed
        chosen = self._listed(given)
        told = f"such as {[names[k] for k in proposed]}"
        if len(chosen) != free:
            count = f"{len(chosen)} joint{'s' if len(chosen) != 1 else ''}"
            raise ValueError(f"independent has {count}, but the constraints leave {free} to choose, {told}")
        rest = [k for k in range(n) if k not in chosen]
        if rank_of(self._matrix[:, rest]) < n - free:
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
