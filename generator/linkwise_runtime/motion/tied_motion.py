"""Closed places along a motion under constraints, and the independent joints that change on its way."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..answers.packed import TiedFunctions
from ..arrays.backend import ArrayBackend
from ..chosen_names import sample_of
from ..constraints.closed_places import ClosedPlace, factor_dependent
from ..constraints.independent_joints import (
    JointColumns,
    chosen_independent,
    joint_columns,
    least_left,
    left_free,
)
from ..constraints.tied_joints import TiedJoints, without_gradient
from ..interface import Numbers, array_of, is_traced

DEAD = 1e-3
"""Part of what was left of columns of A_d where joints were chosen; where less is left, they tell nothing."""
WEAK = 0.5
"""Part below which other independent joints are looked for: the error of a step grows as it gets less."""
FAR = 0.1
"""Way of dependent joints, in rad and m, from where they follow in a straight line."""
LEAP = 0.5
"""Longest way from one place to the next, in rad and m: joints that go farther have left the motion."""


class TiesLost(ValueError):
    """Error for a state beside which ties do not close, or from which there is more than one way."""


class TiedMotion:
    """Closed places along a motion.

    Where independent joints come to tell little of the others, as at a crank's dead point, each sample goes
    on with others, which pivoting finds: the motion itself does not depend on the choice.
    """

    def __init__(self, ties: TiedJoints, backend: ArrayBackend, q: Numbers) -> None:
        """Begin at positions (..., n), where contacts also take hold.

        Raises ValueError where they cannot be closed, or constraints take fewer freedoms than elsewhere.
        """
        self._ties, self._backend = ties, backend
        self.start = self._settled = self._first(q)
        """Closed place of the start."""
        self._held_at = self.start.q
        self._last: tuple[Numbers, ClosedPlace] = self.start.q, self.start
        self._chosen = None if is_traced(q) else Followed.at(self.start, self.start.found.columns)

    @property
    def functions(self) -> TiedFunctions | None:
        """Functions of the back end for these constraints; None without any."""
        return self._ties.functions(self._backend)

    def go_on_from(self, q: Numbers) -> None:
        """Go on from a closed place (..., n) of the motion, to which other functions have led it.

        Contacts stay where they took hold. Raises ValueError where ties do not close.
        """
        found = self._closed(q, self._chosen)[0]
        if found is None or (self._chosen is not None and self._chosen.lost(found).any()):
            columns = self._pivoted(self._ties.scaled_rows(self._backend, q))
            found = self._ties.closed_place(self._backend, q, self._held_at, columns)
            self._chosen = Followed.at(found, columns)
        self._settled, self._last = found, (found.q, found)

    def place(self, t: float, q: Numbers) -> ClosedPlace:
        """Return the closed place beside q (..., n), whose dependent joints are closed first.

        Raises TiesLost, with the time, where they cannot be closed, or do not follow.
        """
        asked, place = self._last
        if asked is q:
            return place
        found, error = self._closed(self._near(q), self._chosen)
        if self._chosen is not None and (found is None or self._chosen.lost(found).any()):
            where = np.asarray(True) if found is None else self._chosen.lost(found)
            other = self._exchanged(self._chosen, self._settled, where)
            again = self._closed(self._near(q), other)[0]
            if again is not None:
                found, self._chosen = again, other
        if found is None:
            with without_gradient(q):
                raise TiesLost(f"at t = {t:g} s {self._leap(q) or error}")
        lost = None if self._chosen is None else _first_of(self._chosen.lost(found))
        if lost is not None:
            raise TiesLost(f"at t = {t:g} s {self._singular(found, lost)}")
        self._last = q, found
        return found

    def settled(self, t: float, q: Numbers) -> ClosedPlace:
        """Return the closed place beside q (..., n), from whose positions the next step begins.

        Here other independent joints are chosen in time: within a step they would cost its order, for its
        stages are less exact than its end. Raises TiesLost as `place` does, and for a step across a place
        where constraints take fewer freedoms.
        """
        place, chosen = self.place(t, q), self._chosen
        if chosen is not None:
            crossed = _first_of(rank_lost_between(self._settled, place))
            if crossed is not None:
                raise TiesLost(f"at t = {t:g} s {self._singular(place, crossed)}")
            part = chosen.parts_left(place)
            weak = part < chosen.weak
            if weak.any():
                other = self._exchanged(chosen, place, weak)
                again = self._closed(place.q, other)[0]
                if again is None:
                    self._chosen = replace(chosen, weak=np.where(weak, part / 2.0, chosen.weak))
                else:
                    place, self._chosen = again, other
        self._last, self._settled = (place.q, place), place
        return place

    def acceleration(self, t: float, q: Numbers, qd: Numbers, tau: Numbers, passive: bool) -> Numbers:
        """Return the accelerations of all joints, (..., n)."""
        place = self.place(t, q)
        return self._ties.acceleration(self._backend, place, qd, tau, passive)

    def _first(self, q: Numbers) -> ClosedPlace:
        """Return the closed place of the start, by other independent joints where the chosen tell nothing."""
        try:
            return self._ties.closed_place(self._backend, q, q)
        except ValueError as error:
            if is_traced(q):
                raise
            rows = self._ties.scaled_rows(self._backend, q)
            try:
                return self._ties.closed_place(self._backend, q, q, self._pivoted(rows))
            except ValueError:
                raise error from None

    def _closed(self, q: Numbers, chosen: "Followed | None") -> tuple[ClosedPlace | None, str]:
        """Return the closed place beside q, or None and why there is none."""
        columns = None if chosen is None else chosen.columns
        try:
            return self._ties.closed_place(self._backend, q, self._held_at, columns), ""
        except ValueError as error:
            return None, str(error)

    def _near(self, q: Numbers) -> Numbers:
        """Return q (..., n), its dependent joints not far from where they follow from the last step.

        Implicit methods ask for slopes by dependent coordinates, and go as far as these change anything.
        """
        last = self._settled
        if is_traced(q) or not self._ties.chosen.of_positions:
            return q
        led = last.q + last.velocity(last.own(q - last.q))
        return led if bool((abs(q - led) > FAR).any()) else q

    def _exchanged(self, chosen: "Followed", place: ClosedPlace, where: NDArray[np.bool_]) -> "Followed":
        """Return other independent joints, chosen at a place, for samples (...,), and the same for others."""
        found, at = Followed.at(place, self._pivoted(place.rows)), where[..., None]
        columns = (
            np.where(at, array_of(new), array_of(own))
            for new, own in zip(found.columns, chosen.columns, strict=True)
        )
        kept = JointColumns(*(self._backend.index(a, place.rows) for a in columns))
        left = np.where(where, found.left, chosen.left)
        return Followed(kept, left, np.where(where, found.weak, chosen.weak))

    def _pivoted(self, rows: Numbers) -> JointColumns:
        """Return the independent joints of each sample, by pivoting in rows A (..., C, n)."""
        n = rows.shape[-1]
        flat = array_of(rows).astype(float).reshape(-1, *rows.shape[-2:])
        tables = [joint_columns(chosen_independent(own, rank=len(self._ties.dependent)), n) for own in flat]
        columns = (np.stack([array_of(a) for a in of]) for of in zip(*tables, strict=True))
        kept = (a.reshape(*rows.shape[:-2], a.shape[-1]) for a in columns)
        return JointColumns(*(self._backend.index(a, rows) for a in kept))

    def _leap(self, q: Numbers) -> str | None:
        """Return a message if independent joints leap away from where they were, else None."""
        place = self._settled
        if is_traced(q):
            return None
        far = np.abs(array_of(place.own(q - place.q)))
        if not far.max(initial=0.0) > LEAP:
            return None
        sample = np.unravel_index(far.argmax(), far.shape)
        own = place.found.columns.of([int(k) for k in sample[:-1]]).independent.tolist()
        joint = self._backend.structure.joint_names[own[int(sample[-1])]]
        return (
            f"{joint} leaps by {far.max():.3g}: take smaller steps, or look at the torques; next to a "
            "singular mass matrix, as of a base pitched by 90 degrees, accelerations have no bound"
        )

    def _singular(self, place: ClosedPlace, sample: Sequence[int]) -> str:
        """Return where the motion leads, with the joints that are free there."""
        rows, columns = array_of(place.rows)[tuple(sample)], place.found.columns.of(sample)
        free = left_free(rows, columns, self._backend.structure.joint_names, "")
        return (
            f"the motion comes to a singular position{sample_of(sample)}, from which it can go on in more "
            f"than one way, or its steps are too long to tell: {free}"
        )


@dataclass(frozen=True)
class Followed:
    """Independent joints of a motion, and how well others followed them where they were chosen."""

    columns: JointColumns
    left: NDArray[np.floating]
    """Least part of a column of A_d that was left there, (...,)."""
    weak: float | NDArray[np.floating] = WEAK
    """Part of this below which others are looked for, (...,)."""

    @classmethod
    def at(cls, place: ClosedPlace, columns: JointColumns) -> "Followed":
        """Return how well others follow these at a place."""
        return cls(columns, least_left(factor_dependent(place.rows, columns)[1], place.unit_rows))

    def parts_left(self, place: ClosedPlace) -> NDArray[np.floating]:
        """Return the least part that is left at a place of what there was, (...,)."""
        return np.asarray(least_left(place.factors[1], place.unit_rows) / self.left)

    def lost(self, place: ClosedPlace) -> NDArray[np.bool_]:
        """Return where independent joints tell the others no more, (...,)."""
        return np.asarray(least_left(place.factors[1], place.unit_rows) < DEAD * self.left)


def rank_lost_between(before: ClosedPlace, after: ClosedPlace) -> NDArray[np.bool_]:
    """Return where A lost rank between two places, or turned by more than a right angle, (...,).

    There all minors of A, which are those of d rows and d columns, pass zero. With Q of A_d = Q R before,
    det (Q^T A) (Q^T A_after)^T is the sum of the products of minors before and after: below zero then.
    """
    basis = array_of(before.factors[0]).mT
    own, other = (basis @ array_of(place.rows) for place in (before, after))
    return np.asarray(np.linalg.slogdet(own @ other.mT)[0] < 0.0)


def _first_of(found: NDArray[np.bool_]) -> tuple[int, ...] | None:
    return tuple(int(k) for k in np.argwhere(found)[0]) if found.any() else None
