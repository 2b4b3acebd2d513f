"""Variances of shares of torque, from the covariance of what links carry.

Shares are linear in inertial parameters, s = sum_j Y_j . pi_j, so that with the covariance of `BodySpread`

    var(s) = sum_j |F_j^T Y_j|^2 + |sum_j H_j^T Y_j|^2

of which a share through one link has its own j alone: there the covariance of ten parameters will do. Places
of joints add (ds/dp)^2 for each direction p of one standard deviation: they are independent of bodies, and
count to first order.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np

from ..answers.packed import PackedTables
from ..arrays.backend import ArrayBackend
from ..chosen_names import known_kind
from ..interface import Numbers
from ..quantities import PARAMETERS
from ..rule.calls import RigidRule
from ..rule.joint_tree import JointTree
from .parameter_moments import Floats
from .uncertain_bodies import (
    BodySpread,
    UncertainBodies,
    body_axes,
    body_spread,
    length_shifts,
    tree_bodies,
)

AT_ONCE = 1 << 21
"""Most numbers of the regressors of a piece of samples."""


class PackedVariances(NamedTuple):
    """Variances of one robot's shares, packed in the order of `Layout`, (S, count) each."""

    c2: Numbers
    c1: Numbers
    gravity: Numbers
    torque: Numbers
    joint_torque: Numbers
    """Variances of the sums over all links, (S, n)."""
    joint_c2: Numbers
    """(S, n, n)"""
    joint_c1: Numbers
    """(S, n, n)"""
    joint_gravity: Numbers
    """(S, n)"""


class ShareVariances:
    """Variances of shares of a robot on one back end, whose bodies are spread."""

    def __init__(self, backend: ArrayBackend, spread: BodySpread, shifts: Any = ()) -> None:
        """Set up the variances; shifts: those of joints' places, as of `length_shifts`."""
        self._backend, self._tables = backend, PackedTables(backend)
        layout, links = backend.structure.layout, range(backend.structure.N)
        self._layout, self._causes = layout, layout.velocity[:, 2].copy()  # writable, as torch wants it
        self._spread, self._by_link = spread, spread.by_link
        # By QR, however many columns there are: ten by ten for each link.
        wide = np.pad(self._by_link.mT, ((0, 0), (0, PARAMETERS), (0, 0)))
        self._triangles = np.asarray(np.linalg.qr(wide, mode="r")).mT
        self._slices = {
            field: [slice(*np.searchsorted(getattr(layout, field)[:, 1], [j, j + 1])) for j in links]
            for field in ("acceleration", "velocity", "gravity", "torque")
        }
        place = {tuple(row): at for at, row in enumerate(layout.acceleration.tolist())}
        self._shifts = shifts
        self._rule = backend.rule or RigidRule(cast(JointTree, backend.tree))
        self._mirrored = np.array([place[min(i, k), j, max(i, k)] for i, j, k in layout.velocity.tolist()])

    def packed(self, motion: Sequence[Numbers], with_sums: bool = True) -> PackedVariances:
        """Return the variances for q, qd and qdd (S, n), as many samples at once as memory wants.

        with_sums: whether sums over the links by cause are wanted; else they are left out, (S, 0)
        """
        wide = max(PARAMETERS, self._spread.shared.shape[-1])
        most = max(16, AT_ONCE // (wide * sum(map(len, self._layout[:4]))))
        samples = len(motion[0])
        size = self._backend.chunk(motion, most) or samples
        if samples <= size:
            return self._piece(motion, with_sums)
        starts = range(0, samples, size)
        pieces = [self._piece([a[at : at + size] for a in motion], with_sums) for at in starts]
        return PackedVariances(*(self._backend.xp.concat(some, 0) for some in zip(*pieces, strict=True)))

    def _piece(self, motion: Sequence[Numbers], with_sums: bool) -> PackedVariances:
        known, (q, qd, qdd) = None, motion
        if not self._spread.shared.shape[-1]:
            known = self._backend.share_variances(q, qd, qdd, self._triangles)
        variances = self._by_rows(motion, with_sums) if known is None else self._summed(known, with_sums)
        for changes in self._changes(q, qd, qdd, with_sums):
            variances = [a + b**2 for a, b in zip(variances, changes, strict=True)]
        nothing = self._backend.zeros(q, 0)
        return PackedVariances(*variances, *([] if with_sums else [nothing] * 3))

    def _summed(self, shares: Sequence[Numbers], with_sums: bool) -> list[Numbers]:
        """Return variances of shares, then of their sums over links, whose errors are independent."""
        c2, c1, g, tau = shares
        tables = self._tables
        sums = [tables.sum_over_links(tau)]
        if with_sums:
            sums += [tables.matrices(c2, "acceleration"), tables.matrices(c1, "velocity")]
            sums.append(tables.sum_over_links(g))
        return [*shares, *sums]

    def _by_rows(self, motion: Sequence[Numbers], with_sums: bool) -> list[Numbers]:
        """Return the same from regressors, whatever the errors of links have in common."""
        xp, (q, qd, qdd) = self._backend.xp, motion
        flat = self._backend.coefficient_regressors(q, qd, 0.0 * q)
        counts = (len(getattr(self._layout, field)) for field in ("acceleration", "velocity", "gravity"))
        c2, c1, g = (
            rows.reshape(rows.shape[0], count, PARAMETERS) for rows, count in zip(flat, counts, strict=True)
        )
        causes = self._backend.index(self._causes, q)
        every = self._backend.index(self._mirrored, q)
        moved = c2[..., every, :] * qdd[..., causes, None] + c1 * qd[..., causes, None]
        tau = [g[..., part, :] for part in self._slices["torque"]]
        for j, (pairs, part) in enumerate(zip(self._slices["torque"], self._slices["velocity"], strict=True)):
            size = pairs.stop - pairs.start
            own = moved[..., part, :]
            tau[j] = tau[j] + own.reshape(*own.shape[:-2], size, size, own.shape[-1]).sum(-2)
        torque = xp.concat(tau, -2)
        variances = [self._share_variance(rows, field) for rows, field in self._fields(c2, c1, g, torque)]
        if not self._spread.shared.shape[-1]:
            return self._summed(variances, with_sums)
        sums, matrices = self._tables.sum_over_links, self._tables.matrices
        summed = [(torque, "torque", sums)]
        if with_sums:
            summed += [
                (c2, "acceleration", partial(matrices, field="acceleration")),
                (c1, "velocity", partial(matrices, field="velocity")),
                (g, "gravity", sums),
            ]
        variances += [self._sum_variance(*one) for one in summed]
        return variances

    def _changes(self, q: Numbers, qd: Numbers, qdd: Numbers, with_sums: bool) -> Iterator[list[Numbers]]:
        """Yield for each direction of joints' places what shares change by, in the order of answers."""
        if not len(self._shifts):
            return
        tables, sums = self._rule.tables(self._backend, q), self._tables.sum_over_links
        numbers = self._backend.tree_numbers((tables.own, tables.sources), q)
        for shift in self._shifts:
            along = self._backend.constant(shift, q)
            c2, c1, g, tau = self._rule.translation_gradient(self._backend, (q, qd, qdd), numbers, along)
            found = [c2, c1, g, tau, sums(tau)]
            if with_sums:
                matrices = self._tables.matrices
                found += [matrices(c2, "acceleration"), matrices(c1, "velocity"), sums(g)]
            yield found

    @staticmethod
    def _fields(*rows: Numbers) -> Sequence[tuple[Numbers, str]]:
        return list(zip(rows, ("acceleration", "velocity", "gravity", "torque"), strict=True))

    def _mapped(self, rows: Numbers, field: str, factors: Floats) -> Numbers:
        """Return F_j^T Y_j of rows (S, count, 10), (S, count, R), for factors F_j (N, 10, R)."""
        maps = self._backend.constant(factors, rows)
        parts = [rows[:, part] @ maps[j] for j, part in enumerate(self._slices[field])]
        return self._backend.xp.concat(parts, -2)

    def _share_variance(self, rows: Numbers, field: str) -> Numbers:
        """Return the variance of shares through one link, (S, count)."""
        return (self._mapped(rows, field, self._by_link) ** 2).sum(-1)

    def _sum_variance(self, rows: Numbers, field: str, sums: Callable[[Numbers], Numbers]) -> Numbers:
        """Return the variance of `sums` over the links, (S, ...), which takes values (..., count)."""
        own = sums((self._mapped(rows, field, self._spread.own) ** 2).sum(-1))
        common = self._backend.xp.swapaxes(self._mapped(rows, field, self._spread.shared), -1, -2)
        return own + (sums(common) ** 2).sum(1)

    def spread(self, values: Numbers, field: str) -> Numbers:
        """Return packed values (S, count) of a field of `Layout` as (S, n, N) or (S, n, N, n)."""
        return self._tables.spread(values, field)


def share_variances(backend: ArrayBackend, bodies: object) -> ShareVariances:
    """Return the variances of a robot on a back end that has regressors.

    Raises TypeError for what is not `UncertainBodies`, ValueError as `body_spread` does.
    """
    if any(not hasattr(bodies, name) for name in UncertainBodies._fields):
        raise TypeError(f"bodies is {known_kind(bodies, UncertainBodies)}; give an UncertainBodies")
    given = cast(UncertainBodies, bodies)
    try:
        shifts = length_shifts(cast(JointTree, backend.tree), given.lengths)
        return ShareVariances(backend, spread_of(backend, given), shifts)
    except ValueError as error:
        raise ValueError(f"bodies: {error}") from None


def spread_of(backend: ArrayBackend, bodies: UncertainBodies) -> BodySpread:
    """Return the spread of the bodies of a robot on a back end; raises as `body_spread` does."""
    tree = cast(JointTree, backend.tree)
    carried = tree_bodies(tree, backend.parameters, cast(Any, backend.bodies))
    return body_spread(backend.structure.link_names, carried, body_axes(tree), bodies)


def root(xp: Any, variance: Numbers) -> Numbers:
    """Return square roots, through which a gradient runs that is zero where the variance is."""
    there = xp.logical_not(variance <= 0)  # NaN stays
    roots = xp.where(there, variance, xp.ones_like(variance)) ** 0.5
    found: Numbers = xp.where(there, roots, xp.zeros_like(variance))
    return found
