"""Rigid-link rule in spatial matrices: few array operations, for few samples.

The formulas are those of `rigid` with S = (s, z), V = (v, omega) and A its rate, from minus gravity, and
with 6 x 6 matrices in place of 3-vectors, see `tables`. Here V x S = (omega x s + v x z, omega x z), its
negative transpose is V x*, and I is the spatial inertia of a link in the base's axes, about the first hinge
of its path:

    Sd = V x S       Sdd = A x S + V x Sd                  rates of a joint's screw
    P = I V          W = I A + V x* P                      wrench of a link in motion
    B = 1/2 (V x* I - I (V x) + the matrix of P)           of which only the columns that meet z are not zero

    c2: S_e . I S_f      c1: S_e . (I Sd_f + B S_f)
    c0: S_e . (I Sdd_f + 2 B Sd_f), and + S_e . (S_f x* W) where joint e is not behind f

Errors of tau are those of W, as `rigid` says.

(Wensing and Slotine's factorisation of the Coriolis terms; Singh, Russell and Wensing's derivatives.) Every
small matrix is a product of its own inside numpy or torch, so for many samples it is quicker to have samples
innermost, as in `rigid`.
"""

from collections.abc import Sequence
from typing import NamedTuple

from ..interface import Namespace, Numbers
from .kinematics import Slopes, curve_displacement, gather
from .products import packed
from .tables import RuleTables, SpatialNumbers, as_matrices


class SpatialMoment(NamedTuple):
    """Joints and links in motion, about the first hinge of their path; samples outermost.

    Methods are those of `Moment`.
    """

    xp: Namespace
    tables: RuleTables
    screws: Numbers
    """S of each joint, (samples, joints, 6)."""
    rates: Numbers
    """Sd of each joint, (samples, joints, 6)."""
    accelerations: Numbers
    """A of each joint, (samples, joints, 6)."""
    crosses: Numbers
    """V x of each joint, (samples, joints, 6, 6)."""
    inertias: Numbers
    """I of each link, (samples, N, 6, 6)."""
    momenta: Numbers
    """P of each link, (samples, N, 6)."""
    wrenches: Numbers
    """W of each link, (samples, N, 6)."""
    weights: Numbers
    """I of each link times minus gravity, (samples, N, 6)."""
    second: Numbers | None = None
    """Terms of curves in Sdd of each joint, (samples, joints, 6); None without curves."""
    bends: Numbers | None = None
    """Derivative of each S by its own coordinate, (samples, joints, 6); None without curves."""

    def coefficients(self) -> list[Numbers]:
        """Return packed c2 and c1."""
        z = self.screws[..., 3:]
        columns = [self.screws, 0.0 * z], [self.rates, z]
        dense = self._products(self._matrices(), columns)
        return [packed(self.xp, dense, positions) for positions in self.tables.positions[:2]]

    def gradient(self) -> list[Numbers]:
        """Return packed c0."""
        s, rate = self.screws, self.rates
        second = _applied(self._cross(self.accelerations), s) + _applied(self.crosses, rate)
        second = second if self.second is None else second + self.second
        columns = [second, 2.0 * rate[..., 3:], 0.0 * s], [second, 2.0 * rate[..., 3:], s]
        matrices = self.xp.concat([self._matrices(), self._wrench_cross(self.wrenches)], -1)
        return [packed(self.xp, self._products(matrices, columns), self.tables.positions[2])]

    def own_bends(self) -> Numbers | None:
        """Return dS/dq . (wrench) of tau, S by its own coordinate, packed as tau; None without curves."""
        return None if self.bends is None else self._replace(screws=self.bends).singles((4,))[0]

    def singles(self, fields: Sequence[int]) -> list[Numbers]:
        """Return packed S_e . (wrench) of g or tau, or both."""
        both = self.xp.concat([self.wrenches, self.weights], 1)
        dense = self.screws @ both.mT
        dense = dense.reshape(dense.shape[0], dense.shape[1] * dense.shape[2])
        return [packed(self.xp, dense, self.tables.positions[field]) for field in fields]

    def _matrices(self) -> Numbers:
        """Return [I B] of each link, with only those columns of B that meet z, (samples, N, 6, 9)."""
        own = self.inertias @ gather(self.crosses, self.tables.spatial.joints, -3)
        b = 0.5 * (self._wrench_cross(self.momenta) - own - own.mT)
        return self.xp.concat([self.inertias, b[..., 3:]], -1)

    def _cross(self, motions: Numbers) -> Numbers:
        return as_matrices(motions, self.tables.spatial.motion_cross)

    def _wrench_cross(self, wrenches: Numbers) -> Numbers:
        return as_matrices(wrenches, self.tables.spatial.force_cross)

    def _products(self, matrices: Numbers, columns: Sequence[Sequence[Numbers]]) -> Numbers:
        """Return S_e . (L column) for each group's links and any two joints e and f on its path.

        The answer is (samples, entries). Entries are ordered by e, link, kind, f; groups stand in a row.

        matrices: L, (samples, N, 6, m); columns: of each kind the parts that make one of m entries, (samples,
        joints, ...)
        """
        xp, answers = self.xp, []
        right = xp.stack([xp.concat(list(parts), -1) for parts in columns], 1)
        samples, kinds, _, size = right.shape
        for links, path in self.tables.groups:
            block, behind = gather(matrices, links, -3), gather(right, path, -2)
            count, depth = block.shape[1], behind.shape[2]
            rows = xp.swapaxes(block, 1, 2).reshape(samples, 6 * count, size)
            wrench = rows @ behind.reshape(samples, kinds * depth, size).mT
            answer = gather(self.screws, path) @ wrench.reshape(samples, 6, count * kinds * depth)
            answers.append(answer.reshape(samples, depth * count * kinds * depth))
        return xp.concat(answers, 1) if len(answers) > 1 else answers[0]


def spatial_moment(
    xp: Namespace, tables: RuleTables, numbers: SpatialNumbers, motion: Sequence[Numbers]
) -> SpatialMoment:
    """Return the motion of joints and links for q, qd and qdd, (samples, n) each."""
    spatial = tables.spatial
    way, slopes = _moved(xp, tables, gather(motion[0], spatial.coordinates, -1))
    x = _placed(xp, tables, numbers, way)
    s = straight = gather((x[:, :-1] @ spatial.units)[..., 0], spatial.swapped, -1)
    velocity = gather(motion[1], spatial.own, -1)[..., None]
    acceleration = gather(motion[2], spatial.own, -1)[..., None]
    if slopes is not None:
        slope, bend, jerk = (a[:, :-1, None] for a in slopes)
        s = straight * slope
    # V = sum of S qd, A = -gravity + sum of S qdd + Sd qd, over the joints of the path; S x S = 0.
    v = spatial.chains @ (s * velocity)
    crosses = as_matrices(v, spatial.motion_cross)
    rate = _applied(crosses, s)
    second = bends = None
    if slopes is not None:
        bends = straight * bend
        second = _applied(crosses, bends) * velocity + straight * (
            jerk * velocity * velocity + bend * acceleration
        )
        rate = rate + bends * velocity
    a = spatial.chains @ (s * acceleration + rate * velocity) - numbers.gravity
    links = spatial.joints
    x = gather(x, links, -3)
    inertia = x @ numbers.inertias @ x.mT
    momentum = _applied(inertia, gather(v, links))
    # V x* is minus the transpose of V x.
    turning = _applied(gather(crosses, links, -3).mT, momentum)
    wrench = _applied(inertia, gather(a, links)) - turning
    weight = _applied(inertia, -numbers.gravity)
    return SpatialMoment(xp, tables, s, rate, a, crosses, inertia, momentum, wrench, weight, second, bends)


def _moved(xp: Namespace, tables: RuleTables, position: Numbers) -> tuple[Numbers, Slopes | None]:
    """Return the displacements of all joints and their slopes, (samples, frames), for q of each."""
    if tables.frames.curves is None:
        return position, None
    way, slopes = curve_displacement(tables.frames.curves, xp.swapaxes(position, 0, 1))
    slope, bend, jerk = (xp.swapaxes(a, 0, 1) for a in slopes)
    return xp.swapaxes(way, 0, 1), (slope, bend, jerk)


def _placed(xp: Namespace, tables: RuleTables, numbers: SpatialNumbers, position: Numbers) -> Numbers:
    """Return X of all frames into the base's axes, (samples, frames, 6, 6); position: (samples, frames)."""
    angle = tables.spatial.turns * position
    x = numbers.frames[0] + numbers.frames[1] * xp.cos(angle)[..., None, None]
    x = x + numbers.frames[2] * xp.sin(angle)[..., None, None]
    if tables.spatial.slides is not None:
        x = x + numbers.frames[3] * (tables.spatial.slides * position)[..., None, None]
    for parents in tables.spatial.steps:
        x = gather(x, parents, -3) @ x
    return x


def _applied(matrices: Numbers, vectors: Numbers) -> Numbers:
    """Return matrices (..., 6, 6) times vectors (..., 6)."""
    return (matrices @ vectors[..., None])[..., 0]
