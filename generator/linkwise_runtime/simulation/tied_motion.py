"""How joints follow along a motion, and what is said where it cannot go on."""

from contextlib import nullcontext
from typing import Any

import numpy as np

from ..chosen_names import listed, sample_of
from ..constraints.closed_places import ClosedPlace
from ..constraints.singular_positions import least_left, why_not_following
from ..sums.namespace import hidden, namespace

HALVES = 30
"""Of the way to a position that does not close, to find how far it goes."""
DEAD = 1e-3
"""Joints are at a dead point where no more is left of columns of A_d than this part of that at the start."""
LEAP = 0.5
"""rad and m: joints that go farther from one place to the next have left the motion."""
NEAR = 10.0
"""So many times as much is left where the last position beside a dead point closes."""


class TiedMotion:
    """Places along a motion; the last one is kept, for a step begins where the one before ended."""

    def __init__(self, answers: Any, start: ClosedPlace) -> None:
        """`start` is also where contacts took hold."""
        self._answers, self._held_at = answers, start.q
        self._last: tuple[Any, ClosedPlace] = start.q, start
        self._dead = 0.0 if hidden(start.q) else DEAD * float(least_left(start.triangle).min(initial=1.0))

    def place(self, t: float, q: Any) -> ClosedPlace:
        """The place beside q (..., n), whose dependent joints are closed first.

        Raises ValueError, with the time, where they cannot be closed, or independent joints go no further.
        """
        asked, place = self._last
        if asked is q:
            return place
        try:
            found: ClosedPlace = self._answers.closed_place(q, self._held_at)
        except ValueError as error:
            with _without_gradient(q):
                reason = self._leap(q) or self._dead_point(self._furthest(self._last[1], q), NEAR)
            raise ValueError(f"at t = {t:g} s {reason or error}") from None
        reason = self._dead_point(found)
        if reason is not None:
            raise ValueError(f"at t = {t:g} s {reason}")
        self._last = q, found
        return found

    def settled(self, t: float, q: Any) -> Any:
        """q with its dependent joints where the constraints want them."""
        place = self.place(t, q)
        self._last = place.q, place
        return place.q

    def accelerated(self, t: float, q: Any, qd: Any, tau: Any, passive: bool) -> Any:
        """Accelerations of the independent joints."""
        return self._answers.independent_acceleration(self.place(t, q), qd, tau, passive)

    def _leap(self, q: Any) -> str | None:
        """That independent joints leap away from where they were; None where they do not."""
        place = self._last[1]
        if hidden(q):
            return None
        far = place.own(abs(q - place.q))
        far = far if isinstance(far, np.ndarray) else far.detach().cpu().numpy()
        if not far.max(initial=0.0) > LEAP:
            return None
        joint = self._answers.independent[int(far.reshape(-1, far.shape[-1]).max(0).argmax())]
        return (
            f"{joint} leaps by {far.max():.3g}: take smaller steps, or look at the torques; next to a "
            "singular mass matrix, as of a base pitched by 90 degrees, accelerations have no bound"
        )

    def _furthest(self, place: ClosedPlace, q: Any) -> ClosedPlace:
        """The last place that closes on the straight way of the independent joints."""
        way, reached = q - place.q, 0.0
        for k in range(1, HALVES):
            tried = reached + 0.5**k
            # Others start from the last place that closed, not from far along the way.
            mover = place.velocity(place.own(way)) * (tried - reached)
            try:
                place = self._answers.closed_place(place.q + mover, self._held_at)
            except ValueError:
                continue
            reached = tried
        return place

    def _dead_point(self, place: ClosedPlace, near: float = 1.0) -> str | None:
        """Why independent joints go no further than a place; None where they do."""
        if hidden(place.q):
            return None
        left = least_left(place.triangle)
        if not left.min(initial=1.0) < near * self._dead:
            return None
        at = np.unravel_index(left.argmin(), left.shape)
        rows = place.rows.positions()[at][..., 1:]
        values = rows if isinstance(rows, np.ndarray) else rows.detach().cpu().numpy()
        own, names = self._answers.independent, self._answers.robot.joint_names
        told = why_not_following(values.astype(float), place.found.columns, NEAR * self._dead, names, "")
        go = "goes" if len(own) == 1 else "go"
        return f"{listed(own)} {go} no further{sample_of([int(k) for k in at])}: {told}"


def _without_gradient(like: Any) -> Any:
    return nullcontext() if isinstance(like, np.ndarray) else namespace(like).no_grad()
