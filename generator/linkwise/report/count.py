"""Terms of an expanded torque, by the motion they contain."""

from collections import Counter
from dataclasses import dataclass

from linkwise.report import laurent
from linkwise.report.expand import Variables
from linkwise.report.laurent import DIGIT, Laurent

FORM = (
    "fully expanded; every product of sines and cosines written as one sine or cosine of an "
    "angle sum; like terms collected"
)
"""The canonical form that every count is taken in."""


@dataclass(frozen=True)
class TermCount:
    """Terms of one τ_ij, or of a sum of them whose links share no parameter.

    total: all terms
    acceleration, velocity: terms with q̈_k, with q̇_k, by k; one with q̇_a q̇_b is in both
    gravity: terms with neither velocity nor acceleration
    """

    total: int
    acceleration: tuple[int, ...]
    velocity: tuple[int, ...]
    gravity: int

    def __add__(self, other: "TermCount") -> "TermCount":
        return TermCount(
            self.total + other.total,
            tuple(a + b for a, b in zip(self.acceleration, other.acceleration, strict=True)),
            tuple(a + b for a, b in zip(self.velocity, other.velocity, strict=True)),
            self.gravity + other.gravity,
        )

    def kept(self, order: int, k: int) -> int:
        """Terms of one bucket: order 2 is the acceleration of k, 1 its velocity, 0 gravity."""
        return (self.gravity, self.velocity[k], self.acceleration[k])[order]

    @classmethod
    def none(cls, n: int) -> "TermCount":
        """No term at all, of a link that joint i does not move."""
        return cls(0, (0,) * n, (0,) * n, 0)


def count_terms(p: Laurent, x: Variables) -> TermCount:
    """Count the sines and cosines behind the exponentials of `p`.

    c cos(a·q) + s sin(a·q) is one entry c/2 at each of ±a for the cosine and one ∓i s/2 for the
    sine; a term without an angle is one entry. So a term is half of two entries, or its only one.
    """
    lifted, n = laurent.lifted(x.digits), x.n
    angle_mask = (1 << (DIGIT * n)) - 1
    no_angle = (lifted >> DIGIT) & angle_mask
    motion_mask = (1 << (2 * DIGIT * n)) - 1
    halves: Counter[int] = Counter()
    for key in p.terms:
        raised = (key + lifted) >> DIGIT
        halves[(raised >> (DIGIT * n)) & motion_mask] += 2 if raised & angle_mask == no_angle else 1
    return _by_motion(halves, n)


def _by_motion(halves: Counter[int], n: int) -> TermCount:
    """Sort term halves, counted by their packed q̇ and q̈ exponents, into buckets."""
    total, gravity = 0, 0
    velocity, acceleration = [0] * n, [0] * n
    for motion, count in halves.items():
        moving = laurent.exponents(motion - laurent.lifted(2 * n), 2 * n)
        total += count
        gravity += 0 if any(moving) else count
        for k in range(n):
            velocity[k] += count if moving[k] else 0
            acceleration[k] += count if moving[n + k] else 0
    half = tuple(v // 2 for v in velocity), tuple(a // 2 for a in acceleration)
    return TermCount(total // 2, half[1], half[0], gravity // 2)
