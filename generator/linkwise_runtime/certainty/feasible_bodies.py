"""All bodies that could exist with the same joint torques at every motion, and the ends of shares over them.

Parameters pi = pi0 + Z x, with Z what no torque shows (`torque_space`), and for every link j

    J(pi_j) >= 0,    least mass <= m_j <= greatest mass,    m_j / M + tr S_j / (M L^2) <= LARGEST

J the pseudo-inertia, S_j its second moments, M the mass of the robot's links together, L the longest reach of
one: the last only keeps bodies within bounds. The set is an intersection of cones with a plane, and its least
y . pi a semidefinite program, solved by Clarabel (P. Goulart, Y. Chen, arXiv:2405.12762).

Links differ in size by thousands. So the set is first seen from its analytic centre, where -log det of all
constraints is least (S. Boyd, L. Vandenberghe, Convex Optimization, 8.5): each cone is scaled such that the
centre is the identity, and x such that rows Q of the constraints are orthonormal,

    minimise c . u    over    s = (1, ..., 1) + Q u in the cones K            with Q^T (1, ..., 1) = 0

Whatever the solver returned, z in K with Q^T z = c proves that c . u >= -z . (1, ..., 1), for
z . s >= 0. So z is repaired until both hold: by Q times what Q^T z lacks, and by a multiple of (1, ..., 1).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .conic_program import conic_least
from .pseudo_inertia import Floats, link_sizes, pseudo_inertia, squared, triangle

LARGEST = 10.0
"""Bound of a link's mass and second moments together, in units of the whole robot's."""
NARROW = 1e-7
"""Least eigenvalue of the innermost body, in units of its size, below which links cannot but be flat: they
are then bodies that are off by this much at most."""
INSIDE = 1e-11
"""Part of the way to the centre by which bodies at ends stay inside, so that rounding keeps them there."""
ROUNDS = 200
"""Most steps of Newton's method to the centre."""
CENTRED, DAMPED = 1e-11, 0.25
"""Newton decrements: below the one the centre is found, above the other steps are damped."""
ROUNDING = 1e-9
"""Part of y that leans on what no torque shows, up to which it is rounding: all bodies have one value."""
PRESSED = 1e-6
"""Part of all multipliers from which on those of the bound of sizes hold an end back."""
ENDLESS = 1e-3
"""Least gain by a direction of the largest size that goes on for ever: a speck of J below zero, of rounding,
lets first moments in that are its root."""


class End(NamedTuple):
    """Least value of y . pi, as proved and as attained."""

    bound: float
    """Value below which no body goes: by the dual; minus infinity where they go without end."""
    attained: float
    """Value of the bodies that were found, which exist: the bound is not further off than this."""
    parameters: Floats
    """Parameters of these bodies, (N, 10)."""
    sized: bool = False
    """True where the bound of sizes holds the end back: with larger links it would lie further out."""


@dataclass(frozen=True, eq=False)
class FeasibleBodies:
    """Bodies with the torques of pi0, seen from their centre: s = 1 + Q u in cones, see above."""

    centre: Floats
    """Parameters of the bodies at the centre, (N, 10)."""
    sizes: Floats
    """Size of each parameter, (N, 10)."""
    basis: Floats
    """Orthonormal changes of parameters in units of their sizes that no torque shows, (10 N, d)."""
    steps: Floats
    """Changes of parameters by u, (10 N, d)."""
    rows: Floats
    """Q: for each link the triangle of its scaled pseudo-inertia, then the other rows, (10 N + R, d)."""
    sized: tuple[int, ...]
    """Rows, counted from that after the links', that only keep bodies within bounds."""

    def least(self, y: Floats, may_end: bool = True) -> End:
        """Return the least y . pi, for y (N, 10).

        may_end: False where bodies may grow without end in what y asks for. Shares on a joint whose torque is
        measured never do: what has no end has J >= 0 and changes no torque, so that each link's part of the
        joint's own inertia, none of them negative, is zero: then its mass is not moved by the joint at all.
        """
        at_centre = float((y * self.centre).sum())
        sized = (y * self.sizes).reshape(-1)
        if np.linalg.norm(self.basis.T @ sized) <= ROUNDING * np.linalg.norm(sized):
            return End(at_centre, at_centre, self.centre)
        c = self.steps.T @ y.reshape(-1)
        size = float(np.linalg.norm(c))
        u, z = self._solved(c / size, self.rows)
        u = self._inside(u)
        bound = self._proved(c / size, z)
        pi = self.centre + (self.steps @ u).reshape(self.centre.shape)
        pressing = z[10 * len(self.centre) :][list(self.sized)].sum()
        pressed = bool(pressing > PRESSED * np.abs(z).sum())
        endless = pressed and not may_end and self._is_endless(c / size)
        return End(-np.inf if endless else at_centre + size * bound, float((y * pi).sum()), pi, pressed)

    @cached_property
    def _ones(self) -> Floats:
        """The centre in scaled rows: identities, then ones."""
        links, others = len(self.centre), len(self.rows) - 10 * len(self.centre)
        return np.concatenate([np.tile(triangle(np.eye(4)), links), np.ones(others)])

    def _solved(self, c: Floats, rows: Floats, ones: Floats | None = None) -> tuple[Floats, Floats]:
        """Return the u of least c . u and the multipliers of its cones.

        ones: offsets of the rows, `_ones` unless given
        """
        return conic_least(c, rows, self._ones if ones is None else ones, len(self.centre))

    def _inside(self, u: Floats) -> Floats:
        """Return u, drawn to the centre as far as its bodies are outside of a cone."""
        change = self.rows @ u
        links = 10 * len(self.centre)
        eigenvalues = np.linalg.eigvalsh(squared(change[:links].reshape(-1, 10)))
        least = min(float(eigenvalues.min()), float(change[links:].min(initial=0.0)))
        most = max(-least, np.finfo(float).tiny)  # 1 - t most >= 0
        return u * min(1.0, (1.0 - INSIDE) / most)

    def _proved(self, c: Floats, z: Floats) -> float:
        """Return a value below which c . u does not go, by multipliers that are repaired."""
        links, ones = 10 * len(self.centre), self._ones
        z = z + self.rows @ (c - self.rows.T @ z)
        eigenvalues = np.linalg.eigvalsh(squared(z[:links].reshape(-1, 10)))
        lacks = max(0.0, -float(eigenvalues.min()), -float(z[links:].min(initial=0.0)))
        z = z + lacks * ones
        return -float(z @ ones)

    def _is_endless(self, c: Floats) -> bool:
        """Return whether bodies go on in one direction, which makes c . u smaller, without end.

        A direction d with J(d) >= 0, that masses allow, goes on for ever. The rows of sizes bound its length.
        """
        links = 10 * len(self.centre)
        ones = np.zeros(len(self.rows))
        ones[links + np.array(self.sized, dtype=np.intp)] = 1.0
        u, _ = self._solved(c, self.rows, ones)
        return bool(c @ u < -ENDLESS)


def feasible_bodies(own: Floats, hidden: Floats, limits: Floats, links: Sequence[str]) -> FeasibleBodies:
    """Return the bodies with the torques of `own` parameters (N, 10).

    hidden: changes of parameters that no torque shows, (10 N, d), in its columns
    limits: least and greatest mass of each link, (N, 2); infinite where there is none

    Raises ValueError where no body could exist, with the link's name.
    """
    fixed = np.flatnonzero(limits[:, 0] == limits[:, 1]).tolist()
    sizes = link_sizes(own)
    basis = np.linalg.qr(hidden / sizes.reshape(-1)[:, None])[0]
    basis, start = _held(basis, own / sizes, limits / sizes[:, :1], fixed)
    claimed, own = own, start * sizes
    cones = np.eye(4)[None] * _lengths(sizes)[:, None]
    cone_rows, offset = _scaled(basis, sizes, cones), _triangles(own, cones)
    massless = [j for j in fixed if limits[j, 0] == 0.0]
    offset.reshape(-1, 10)[massless, -1] += 1.0  # with m = 0 and h = 0 the rest is S >= 0
    others, bounds, sized = _other_rows(basis, sizes, own, limits, set(fixed))
    rows, ones = np.concatenate([cone_rows, others]), np.concatenate([offset, bounds])
    x, inner = _innermost(rows, ones, len(own))
    outside = np.abs(own[fixed, 0] - limits[fixed, 0]) > NARROW * sizes[fixed, 0]
    if inner < -NARROW or outside.any():
        raise ValueError(_impossible(claimed, limits, links))
    slack = triangle(np.eye(4)) * (2.0 * NARROW if inner < NARROW else 0.0)
    ones[: 10 * len(own)] += np.tile(slack, len(own))
    q, centre, turn = _centred(rows, ones, x, len(own))
    changes = basis * sizes.reshape(-1)[:, None]
    at_centre = own + (changes @ centre).reshape(own.shape)
    return FeasibleBodies(at_centre, sizes, basis, _solved(turn, changes), q, sized)


def _solved(turn: Floats, changes: Floats) -> Floats:
    """Return changes R^-1: by u in place of x."""
    return np.array(np.linalg.solve(turn.T, changes.T).T, dtype=np.float64)


def _lengths(sizes: Floats) -> Floats:
    """Return factors (N, 4) of rows and columns that give a link's pseudo-inertia the size 1."""
    mass, square = sizes[:, 0], sizes[:, 4] / sizes[:, 0]
    return np.stack([1.0 / np.sqrt(mass * square)] * 3 + [1.0 / np.sqrt(mass)], 1)


def _triangles(pi: Floats, cones: Floats) -> Floats:
    """Return the triangles (10 N,) of scaled pseudo-inertias C J C^T."""
    found: Floats = triangle(cones @ pseudo_inertia(pi) @ np.swapaxes(cones, -1, -2)).reshape(-1)
    return found


def _scaled(basis: Floats, sizes: Floats, cones: Floats) -> Floats:
    """Return the triangles of the basis' pseudo-inertias, (10 N, d)."""
    changes = (basis * sizes.reshape(-1)[:, None]).T.reshape(-1, *sizes.shape)
    found = [_triangles(one, cones) for one in changes]
    return np.stack(found, 1) if found else np.zeros((sizes.size, 0))


def _held(basis: Floats, own: Floats, limits: Floats, fixed: Sequence[int]) -> tuple[Floats, Floats]:
    """Return the part of the basis that keeps fixed masses, and bodies that have them, as near as can be.

    own, limits: in units of the sizes. Where a mass is held at 0, so is the first moment.
    """
    held = [10 * j + a for j in fixed for a in range(4 if limits[j, 0] == 0.0 else 1)]
    if not held:
        return basis, own
    wanted = np.array([limits[at // 10, 0] if at % 10 == 0 else 0.0 for at in held])
    there = own.reshape(-1)
    left, found, right = np.linalg.svd(basis[held])
    rank = int((found > ROUNDING).sum())
    steps = right[:rank].T @ ((left.T @ (wanted - there[held]))[:rank] / found[:rank])
    start, kept = there + basis @ steps, basis @ right[rank:].T
    if np.abs(start[held] - wanted).max() <= NARROW:
        start[held] = wanted
    kept[held] = 0.0
    return kept, start.reshape(own.shape)


def _other_rows(
    basis: Floats, sizes: Floats, own: Floats, limits: Floats, fixed: set[int]
) -> tuple[Floats, Floats, tuple[int, ...]]:
    """Return rows and offsets of mass limits and of sizes, and the places of the latter."""
    rows, ones = [], []
    for j, (low, high) in enumerate(limits):
        mass, unit = basis[10 * j], sizes[j, 0]
        if j in fixed:
            continue
        if low > 0.0:
            rows.append(mass)
            ones.append((own[j, 0] - low) / unit)
        if high < np.inf:
            rows.append(-mass)
            ones.append((high - own[j, 0]) / unit)
    first = len(rows)
    total = own[:, 0].sum() or 1.0
    square = (sizes[:, 4] / sizes[:, 0]).max()
    weights = np.diag([1.0 / square] * 3 + [1.0]) / (LARGEST * total)
    # tr(F J), in units of LARGEST
    factor = np.array([np.sum(weights * pseudo_inertia(one)) for one in np.eye(10)])
    for j in range(len(own)):
        rows.append(-(factor * sizes[j]) @ basis[10 * j : 10 * j + 10])
        ones.append(1.0 - float(factor @ own[j]))
    return np.array(rows), np.array(ones), tuple(range(first, len(rows)))


def _innermost(rows: Floats, ones: Floats, links: int) -> tuple[Floats, float]:
    """Return the x whose bodies are furthest inside of all cones, and how far, at most 1."""
    inwards = np.concatenate([np.tile(triangle(np.eye(4)), links), np.ones(len(rows) - 10 * links)])
    wide = np.concatenate([rows, -inwards[:, None]], 1)
    last = np.zeros((1, wide.shape[1]))
    last[0, -1] = -1.0
    c = np.zeros(wide.shape[1])
    c[-1] = -1.0
    u, _ = conic_least(c, np.concatenate([wide, last]), np.append(ones, 1.0), links)
    return u[:-1], float(u[-1])


def _centred(rows: Floats, ones: Floats, x: Floats, links: int) -> tuple[Floats, Floats, Floats]:
    """Return Q, the analytic centre and R of Q R = rows seen from there; x: a place inside.

    Newton's method: with Q^T Q = 1 the Hessian and -Q^T 1 the gradient, steps are Q^T 1.
    """
    identity = np.concatenate([np.tile(triangle(np.eye(4)), links), np.ones(len(rows) - 10 * links)])
    q, turn = np.linalg.qr(_seen_from(rows, ones + rows @ x, links))
    for _ in range(ROUNDS):
        step = q.T @ identity
        decrement = float(np.linalg.norm(step))
        if decrement < CENTRED:
            break
        x = x + np.linalg.solve(turn, step) / (1.0 + (decrement if decrement > DAMPED else 0.0))
        q, turn = np.linalg.qr(_seen_from(rows, ones + rows @ x, links))
    return q, x, turn


def _seen_from(rows: Floats, place: Floats, links: int) -> Floats:
    """Return the rows scaled such that a place inside is the identity, and ones."""
    cut = 10 * links
    lower = np.linalg.cholesky(squared(place[:cut].reshape(-1, 10)))
    back = np.linalg.inv(lower)
    matrices = squared(rows[:cut].T.reshape(-1, links, 10))
    turned = triangle(back @ matrices @ np.swapaxes(back, -1, -2))
    return np.concatenate([turned.reshape(-1, cut).T, rows[cut:] / place[cut:, None]])


def _impossible(own: Floats, limits: Floats, links: Sequence[str]) -> str:
    """Return why no bodies could exist, naming the link whose own body is furthest from one."""
    sizes = _lengths(link_sizes(own))
    least = np.linalg.eigvalsh(sizes[:, :, None] * pseudo_inertia(own) * sizes[:, None])[:, 0]
    if least.min() < -NARROW:
        worst = links[int(least.argmin())]
        return (
            f"no bodies that could exist have these joint torques: link {worst!r} is not a possible body; "
            "correct its mass, centre and inertia"
        )
    outside = np.flatnonzero((own[:, 0] < limits[:, 0]) | (own[:, 0] > limits[:, 1]))
    first = f"link {links[int(outside[0])]!r} outside of its own" if len(outside) else ""
    named = first or "too narrow together"
    return f"no bodies within the limits of masses have these joint torques: {named}; widen `masses`"
