"""Terms of an expanded torque by the motion they contain, and those of them that a query keeps."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from linkwise_runtime.chosen_names import known_as, nearest_first

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.report.expand import Variables
from linkwise.report.laurent import DIGIT, Laurent, add, exponents, lifted

ORDERS = ("gravity", "velocity", "acceleration")


@dataclass(frozen=True)
class TermQuery:
    """One bucket of some torques τ_ij; the default is the paper's. Index from 0; None means all.

    joint: i            link: j            coordinate: k, the joint whose motion is followed
    order: 2 keeps terms that contain q̈_k, 1 those that contain q̇_k, 0 gravity
    """

    joint: int | None = 0
    link: int | None = None
    coordinate: int = 0
    order: int = 2

    def __str__(self) -> str:
        motion = f" of joint {self.coordinate + 1}" if self.order else ""
        return f"{ORDERS[self.order]}{motion}"

    def joints(self, n: int) -> tuple[int, ...]:
        """Return the joints, of n, whose torques are requested."""
        return tuple(range(n)) if self.joint is None else (self.joint,)


def position(text: str, names: Sequence[str], option: str) -> int:
    """Return the index of a name, or of a number from 1; raise LinkwiseError that names the choices."""
    if (name := known_as(text, names)) is not None:
        return names.index(name)
    if text.isascii() and text.isdigit() and len(text) < 10 and 1 <= int(text) <= len(names):
        return int(text) - 1
    near = listed(nearest_first(text, names))
    raise LinkwiseError(f"{option} {text!r} is not there; choose 1..{len(names)} or {near}")


@dataclass(frozen=True)
class TermPair:
    """Terms of Σ_j τ_1j of the first links, and those of them that contain q̈_1."""

    total: int
    kept: int

    @property
    def reduction(self) -> float:
        """Share of terms that need not be computed."""
        return 1.0 - self.kept / self.total

    @property
    def redundant_per_kept(self) -> float:
        """Number of terms computed in vain for each kept one."""
        return (self.total - self.kept) / self.kept


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

    def kept(self, query: TermQuery) -> int:
        """Return the number of terms in the bucket of `query`."""
        k = query.coordinate
        return (self.gravity, self.velocity[k], self.acceleration[k])[query.order]

    @classmethod
    def none(cls, n: int) -> "TermCount":
        """Return a count of no terms: the torque on joint i of a link that it does not move."""
        return cls(0, (0,) * n, (0,) * n, 0)


def count_terms(p: Laurent, x: Variables) -> TermCount:
    """Count the sines and cosines behind the exponentials of `p`.

    c cos(a·q) + s sin(a·q) has one entry c/2 at each of ±a for the cosine and one ∓i s/2 for the
    sine; a term without an angle is one entry. So a term is half of two entries, or its only one.
    """
    offset, n = lifted(x.digits), x.n
    angle_mask = (1 << (DIGIT * n)) - 1
    no_angle = (offset >> DIGIT) & angle_mask
    motion_mask = (1 << (2 * DIGIT * n)) - 1
    halves: Counter[int] = Counter()
    for key in p.terms:
        raised = (key + offset) >> DIGIT
        halves[(raised >> (DIGIT * n)) & motion_mask] += 2 if raised & angle_mask == no_angle else 1
    return _by_motion(halves, n)


def _by_motion(halves: Counter[int], n: int) -> TermCount:
    """Sort term halves, counted by their packed q̇ and q̈ exponents, into buckets."""
    total, gravity = 0, 0
    velocity, acceleration = [0] * n, [0] * n
    for motion, count in halves.items():
        moving = exponents(motion - lifted(2 * n), 2 * n)
        total += count
        gravity += 0 if any(moving) else count
        for k in range(n):
            velocity[k] += count if moving[k] else 0
            acceleration[k] += count if moving[n + k] else 0
    half = tuple(v // 2 for v in velocity), tuple(a // 2 for a in acceleration)
    return TermCount(total // 2, half[1], half[0], gravity // 2)


class RunningCount:
    """Terms of Σ_j τ_ij while links are added; like terms of different links are collected."""

    def __init__(self, n: int) -> None:
        self.count = TermCount.none(n)
        self._parts: list[Laurent] = []
        self._keys: set[int] = set()

    def add(self, torque: Laurent, variables: Variables) -> TermCount:
        """Add one link's torque; return its own count."""
        own = count_terms(torque, variables)
        if self._keys.isdisjoint(torque.terms):
            self._parts.append(torque)
            self.count += own
        else:
            self._parts = [add([*self._parts, torque])]
            self.count = count_terms(self._parts[0], variables)
        self._keys.update(torque.terms)
        return own
