"""Closed positions for the independent joints alone: the others are led there from where ties are closed.

Steps along G from the closed position go straight to where the independent joints are wanted, all samples at
once, and are halved where others would leap: so ties that can close in several ways stay in the one of the
start.
"""

from collections.abc import Callable, Sequence
from typing import Any

from ..chosen_names import listed
from .closed_places import ClosedPlace
from .followers import JointColumns
from .newton_closing import DoesNotClose, with_independent

NEAR = 0.1
"""In rad and m: farther from its guess, a joint may have come to another way to close."""
SHORTEST = 1e-6
"""Part of a way that is not halved any more."""


def led(
    place_of: Callable[[Any], ClosedPlace],
    start: Any,
    wanted: Any,
    columns: JointColumns,
    names: Sequence[str],
) -> Any:
    """Closed positions (..., n), from the start (..., n) to independent joints at `wanted` (..., m).

    place_of: the closed place beside a position; names: of all joints
    Raises ValueError where the others cannot be led there.
    """
    at = place_of(start)
    first, done, step = at.own(at.q), 0.0, 1.0
    while done < 1.0:
        step = min(step, 1.0 - done)
        own = first + (done + step) * (wanted - first)
        guess = with_independent(at.q + at.velocity(own - at.own(at.q)), own, columns)
        try:
            found, told = place_of(guess), "they would have to leap"
        except ValueError as error:
            found, told = None, error.reason if isinstance(error, DoesNotClose) else str(error)
        # Written so, positions that are not numbers, of gaps in a batch, lead no other sample astray.
        if found is not None and not bool((abs(found.q - guess) > NEAR).any()):
            at, done, step = found, done + step, 2.0 * step
            continue
        step /= 2.0
        if step < SHORTEST:
            raise _not_led(done, told, columns, names)
    return at.q


def _not_led(done: float, told: str, columns: JointColumns, names: Sequence[str]) -> DoesNotClose:
    own = listed([names[k] for k in columns.independent.tolist()])
    return DoesNotClose(
        f"the joints that follow {own} cannot be led there, but {100.0 * done:.3g} % of the straight way "
        f"from a closed position ({told})",
        "give closed(q) all joints, those that follow near where ties close, if they do",
    )
