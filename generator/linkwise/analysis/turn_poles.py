"""How near a log comes to where three turns about one place leave only two: the pole of a base or a ball."""

from collections.abc import Iterator, Sequence

import numpy as np

from linkwise.analysis.samples import Samples
from linkwise.package.load import Array
from linkwise.package.manifest import BodyEntry

NEAR = 10.0
"""So many times as much, beside a pole, the outer turns magnify what is wrong with the angles of a log."""
AT_ONCE = 1 << 16


def pole_warnings(
    bodies: Sequence[BodyEntry] | None, joints: Sequence[str], samples: Samples
) -> Iterator[str]:
    """Warnings of three successive turns about one place that a log brings near their pole.

    With z1, z2, z3 their axes, |z1 . z2 x z3| is largest a right angle of the middle turn away from the pole.
    Nearer, what is wrong with an orientation is wrong with the outer angles by its inverse.
    """
    for first, middle, last in _triples(bodies or ()):
        angles = samples.q[:, middle.coordinate]
        places = range(0, len(angles), AT_ONCE)
        sizes = [_apart(middle, last, np.asarray(angles[at : at + AT_ONCE])) for at in places]
        least = [(float(part.min()), at + int(part.argmin())) for at, part in zip(places, sizes, strict=True)]
        size, row = min(least, default=(1.0, 0))
        if size * NEAR < 1.0:
            turns = [repr(joints[body.coordinate]) for body in (first, middle, last)]
            yield _near(turns, size, float(samples.time[row]))


def _near(turns: Sequence[str], size: float, time: float) -> str:
    first, middle, last = turns
    return (
        f"{middle} is {np.degrees(np.arcsin(size)):.2g} degrees from where {first} and {last} turn about one "
        f"axis, at {time:.6g} s: what is wrong with the orientation there is wrong with these two by "
        f"{1.0 / max(size, 1e-16):.3g} times as much, and with their rates and accelerations by more; do not "
        "rest on them there, or write the turns in another order"
    )


def _triples(bodies: Sequence[BodyEntry]) -> Iterator[tuple[BodyEntry, BodyEntry, BodyEntry]]:
    """Turns that follow each other at one place, with no mass between."""
    for last in bodies:
        middle = None if last.parent is None else bodies[last.parent]
        if middle is None or middle.parent is None:
            continue
        first = bodies[middle.parent]
        alike = all(body.kind == "revolute" and body.curve is None for body in (first, middle, last))
        together = not any((*middle.translation, *last.translation, first.mass, middle.mass))
        if alike and together:
            yield first, middle, last


def _apart(middle: BodyEntry, last: BodyEntry, angles: Array) -> Array:
    """|z1 . z2 x z3| at angles (S,) of the middle turn, in the first one's axes, beside the largest."""
    z2 = np.array(middle.rotation)[:, 2]
    x, y, z = np.array(last.rotation)[:, 2]
    cosine, sine = np.cos(middle.ratio * angles), np.sin(middle.ratio * angles)
    turned = np.stack([cosine * x - sine * y, sine * x + cosine * y, np.full_like(cosine, z)])
    z3 = np.array(middle.rotation) @ turned
    largest = np.hypot(z2[0], z2[1]) * np.hypot(x, y)
    if largest == 0.0:
        return np.ones_like(angles)  # two of the axes are one at every angle, which no angle mends
    found: Array = np.abs(z2[0] * z3[1] - z2[1] * z3[0]) / largest
    return found
