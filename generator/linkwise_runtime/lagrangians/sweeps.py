"""Partial torques and their coefficients of all links, by differentiating their Lagrangians.

With L = K - P of one link, K of degree two in the velocities, and D_i = d/dt d/dqd_i - d/dq_i,

    tau_i = D_i L           M = d2K/dqd2            dK/dqd = p = M qd
    c1_ik = 1/2 (dM_ik/dt + dp_i/dq_k - dp_k/dq_i) = 1/2 d(tau_i)/d(qd_k)

Nothing here is derived in advance. A first reverse sweep gives the gradient of K. The Hessian of K times a
direction is the gradient of (gradient . direction), as the Hessian is symmetric: a second reverse sweep over
the graph of the first. Several directions, and several links, go side by side in lanes.

Link j has a lane for each coordinate k: at e_k, a velocity of 1 of k alone, dK/dqd is column k of M, its
change along qd column k of dM/dt, and dp_k/dq = d(e_k . M qd)/dq.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache

import torch
from torch import Tensor

from .energy_interface import Energies, Parameters, Recording, gradient, variable
from .lanes import Indices, LaneEntries, Leaf, Motion, Plan, Rows, pick

Links = Sequence[Energies]


class Sweep:
    """The motion of one call in the lanes of a plan, and derivatives of the Lagrangians there."""

    def __init__(
        self, links: Links, p: Parameters, plan: Plan, motion: Sequence[Tensor], record: Recording
    ) -> None:
        self.links, self.p, self.plan, self.motion, self.record = links, p, plan, motion, record
        self.x, self.v, self.a = (part.unbind(-1) for part in motion)
        self.n, self.dim = len(self.x), record.like.dim() + 1

    def same(self, values: Sequence[Tensor]) -> Leaf:
        """Return a leaf that gives all lanes the same value of a coordinate."""
        return lambda k, rows: values[k].expand(rows.stop - rows.start, *self.record.like.shape)

    def lay(self, leaf: Leaf) -> Motion:
        """Return variables with the values of `leaf`."""
        return self.plan.lay(lambda k, rows: variable(leaf(k, rows)), self.dim)

    def kinetic(self, velocity: Leaf) -> tuple[Motion, Motion, Sequence[Tensor], Sequence[Tensor]]:
        """Return q and qd in lanes, and the gradients of the kinetic energy by the variables of each."""
        q, qd = self.lay(self.same(self.x)), self.lay(velocity)
        moved = zip(self.links, q.own, qd.own, strict=True)
        energies = [link.kinetic(position, speed, self.p) for link, position, speed in moved]
        x, v = q.variables(), qd.variables()
        slopes = gradient(energies, None, [*x, *v], keep=True, last=False)
        return q, qd, slopes[: len(x)], slopes[len(x) :]

    def potential(self, keep: bool) -> tuple[Motion, Sequence[Tensor]]:
        """Return q in lanes, and the gradient of the potential energy by its variables."""
        q = self.lay(self.same(self.x))
        energies = [link.potential(at, self.p) for link, at in zip(self.links, q.own, strict=True)]
        return q, gradient(energies, None, q.variables(), keep, last=True)

    def rows(self, values: Sequence[Tensor], *motions: Motion) -> Rows:
        """Return values that belong to the variables of one or more motions, in their order, as `Rows`."""
        places = (place for motion in motions for place in motion.places())
        return Rows(places, values, self.plan.lanes, self.n, self.record.like)

    def along(self, motion: Motion, direction: Leaf) -> list[Tensor]:
        """Return a direction for each variable of a motion."""
        return [direction(k, rows) for k, rows in motion.places()]

    def marks(self, chosen: Callable[[int], Indices]) -> Leaf:
        """Return a leaf that is one in the lanes that are chosen for a coordinate, and zero in the others."""
        like = self.record.like
        columns = [torch.from_numpy(chosen(k)).to(like.device, like.dtype) for k in range(self.n)]
        return lambda k, rows: self.record.lanes(columns[k][rows])

    def torque(self, keep: bool) -> tuple[tuple[Motion, ...], tuple[Sequence[Tensor], ...]]:
        """Return variables qd, q and q again, and for each its part of tau: d/dt dK/dqd, dK/dq and dP/dq."""
        q, qd, force, momentum = self.kinetic(self.same(self.v))
        way = [*self.along(q, self.same(self.v)), *self.along(qd, self.same(self.a))]
        rate = gradient([*force, *momentum], way, qd.variables(), keep, last=True)
        place, gravity = self.potential(keep)
        return (qd, q, place), (rate, force, gravity)


def entries_of(links: Links) -> LaneEntries:
    """Return the entries and lanes of these links."""
    numbers = {id(link): j for j, link in enumerate(links)}
    parents = tuple(numbers.get(id(link.before)) for link in links)
    return _entries(tuple(link.path for link in links), parents)


_entries = lru_cache(maxsize=64)(LaneEntries)


def decomposition(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> list[Tensor]:
    """Return c2 (i <= k), c1, g, tau and h1, which is empty, packed link by link: (..., count) each."""
    entries, record = _begin(links, p, q, qd, qdd)
    with torch.enable_grad():
        sweep = Sweep(links, p, entries.plan, (q, qd, qdd), record)
        mass, c1 = _second_derivatives(sweep, entries)
        gravity = _gravity(sweep, entries)
        k = entries.pairs[:, 1]
        terms = mass * pick(qdd.movedim(-1, 0), k) + c1 * pick(qd.movedim(-1, 0), k)
        tau = _sums(terms, entries) + gravity
        return [record.finish(part) for part in (pick(mass, entries.upper), c1, gravity, tau, c1[:0])]


def torque(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
    """Return tau of every link over its path, shape (..., count)."""
    entries, record = _begin(links, p, q, qd, qdd)
    with torch.enable_grad():
        sweep = Sweep(links, p, entries.single, (q, qd, qdd), record)
        rate, force, gravity = (
            sweep.rows(values, motion)(*entries.paths_in_lanes)
            for motion, values in zip(*sweep.torque(record.wanted), strict=True)
        )
        return record.finish(rate - force + gravity)


def position_gradient(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
    """Return d(tau_i)/d(q_k) of every link over its path, row by row, shape (..., count)."""
    entries, record = _begin(links, p, q, qd, qdd)
    with torch.enable_grad():
        # Lane e_i of a link serves its tau_i.
        sweep = Sweep(links, p, entries.plan, (q, qd, qdd), record)
        (qd_, q_, place), (rate, force, gravity) = sweep.torque(keep=True)
        mine = sweep.marks(lambda k: entries.lanes[:, 1] == k)
        weights = [*sweep.along(qd_, mine), *(-m for m in sweep.along(q_, mine)), *sweep.along(place, mine)]
        moved = [*q_.variables(), *place.variables()]
        slopes = gradient([*rate, *force, *gravity], weights, moved, record.wanted, last=True)
        found = sweep.rows(slopes, q_, place)
        return record.finish(found(entries.pairs[:, 1], entries.pairs[:, 2]))


def _begin(links: Links, p: Parameters, *motion: Tensor) -> tuple[LaneEntries, Recording]:
    return entries_of(links), Recording.of(motion, p.wanted)


def _second_derivatives(sweep: Sweep, entries: LaneEntries) -> tuple[Tensor, Tensor]:
    """Return M_ik and c1_ik of all pairs (i, k)."""
    coordinate = entries.lanes[:, 1]
    keep, along_qd = sweep.record.wanted, sweep.same(sweep.v)
    q, qd, force, momentum = sweep.kinetic(sweep.marks(lambda k: coordinate == k))
    rate = gradient(force, sweep.along(q, along_qd), qd.variables(), keep, last=False)
    mass_rate, mass = sweep.rows(rate, qd), sweep.rows(momentum, qd)
    i, k, at_i, at_k = entries.pairs.T
    bent = gradient(momentum, sweep.along(qd, along_qd), q.variables(), keep, last=True)
    bend = sweep.rows(bent, q)
    return mass(i, at_k), 0.5 * (mass_rate(i, at_k) + bend(k, at_i) - bend(i, at_k))


def _gravity(sweep: Sweep, entries: LaneEntries) -> Tensor:
    """Return dP/dq_i of every link over its path, in one lane for each link."""
    sweep = Sweep(sweep.links, sweep.p, entries.single, sweep.motion, sweep.record)
    place, slopes = sweep.potential(sweep.record.wanted)
    return sweep.rows(slopes, place)(*entries.paths_in_lanes)


def _sums(terms: Tensor, entries: LaneEntries) -> Tensor:
    """Return the sums over k of terms (i, k), link by link."""
    sizes = [len(path) for path in entries.paths]
    blocks = terms.split_with_sizes([d * d for d in sizes])
    return torch.cat([b.reshape(d, d, *b.shape[1:]).sum(1) for d, b in zip(sizes, blocks, strict=True)])
