"""Partial torques and their coefficients of links that were written by hand, by differentiating their terms.

    p_i = dK/dqd_i      h_i = sum_s dp_i/dq_s qd_s - dK/dq_i      c2_ik = dp_i/dqd_k
    c1_ik = integral of dh_i/dqd_k (q, s qd) over s from 0 to 1, for K of any degree, by Gauss's points
    s_i = d/dt dl/dqd_i - dl/dq_i + dD/dqd_i - Q_i, with l = motion - potential, for each share with a name
    tau_i = sum_k c2_ik qdd_k + h_i + sum of all s_i

K has degree two or more in the velocities, l one at most. Everything is differentiated in reverse mode, by
autograd in an ordinary call and in an export, which records it, and by torch.func inside a transformation.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from .energy_interface import Number, Parameters, Values, transformed, variable

Function = Callable[[Tensor], Tensor]
"""Function of (..., n), or of (...), with values (...)."""


class WrittenTerms(Protocol):
    """Terms of a link that was written by hand."""

    @property
    def path(self) -> tuple[int, ...]:
        """Coordinates that they depend on, ascending, counted from 0."""

    @property
    def degree(self) -> int:
        """Highest power of the velocities in the kinetic energy."""

    @property
    def shares(self) -> tuple[str, ...]:
        """Names of the shares."""

    @property
    def imposed(self) -> str:
        """Name of the share that takes what time itself changes in the kinetic energy; empty without."""

    @property
    def time(self) -> str:
        """Name of the parameter that is time; empty where nothing depends on it."""

    @property
    def uneven(self) -> bool:
        """True if d(tau)/d(qd) is not 2 c1."""

    def kinetic(self, q: Values, qd: Values, p: Parameters) -> Number:
        """Return the kinetic energy in J."""

    def potentials(self, q: Values, p: Parameters) -> Mapping[str, Number]:
        """Return potential energies in J, by share."""

    def motions(self, q: Values, qd: Values, p: Parameters) -> Mapping[str, Number]:
        """Return terms of the Lagrangian linear in the velocities, or without them, by share."""

    def dissipations(self, q: Values, qd: Values, p: Parameters) -> Mapping[str, Number]:
        """Return Rayleigh's dissipation in W, by share."""

    def forces(self, q: Values, qd: Values, p: Parameters) -> Mapping[str, Mapping[int, Number]]:
        """Return generalised forces by share and coordinate."""


Links = Sequence[WrittenTerms]


def gradient(function: Function, at: Tensor) -> Tensor:
    """Return the slope of a function of samples, which do not depend on one another, of the shape of `at`."""
    if transformed() and not torch.compiler.is_exporting():
        found: Tensor = torch.func.grad(lambda x: function(x).sum())(at)
        return found
    x = variable(at)
    value = function(x)
    if not value.requires_grad:
        return torch.zeros_like(at)
    (slope,) = torch.autograd.grad(value.sum(), x, create_graph=True, allow_unused=True)
    return torch.zeros_like(at) if slope is None else slope


def rows(function: Function, at: Tensor, path: Iterable[int]) -> list[Tensor]:
    """Return the slopes of components i on the path of a function (..., n), (..., n) each."""

    def entry(i: int, x: Tensor) -> Tensor:
        return function(x)[..., i]

    return [gradient(partial(entry, i), at) for i in path]


class WrittenLink:
    """Derivatives of one link's terms at samples: q, qd (..., n)."""

    def __init__(self, link: WrittenTerms, p: Parameters, q: Tensor, qd: Tensor) -> None:
        self.link, self.q, self.qd, self._p = link, q, qd, p
        self._time = p[link.time].expand(q.shape[:-1]) if link.time else None

    def kinetic(self, q: Tensor, qd: Tensor, time: Tensor | None = None) -> Tensor:
        """Return the kinetic energy (...)."""
        return _at(q, self.link.kinetic(q.unbind(-1), qd.unbind(-1), self._given(time)))

    def potential(self, name: str, q: Tensor, time: Tensor | None = None) -> Tensor:
        """Return a potential energy (...)."""
        return _at(q, self.link.potentials(q.unbind(-1), self._given(time)).get(name, 0.0))

    def force(self, qd: Tensor) -> Tensor:
        """Return h (..., n)."""
        return self._lagrange(self.kinetic, qd)

    def inertial(self, qd: Tensor, qdd: Tensor) -> Tensor:
        """Return sum_k c2_ik qdd_k + h_i, (..., n)."""
        pull = gradient(lambda v: (self._momentum(v) * qdd).sum(-1), qd)
        return pull + self.force(qd)

    def inertia(self) -> list[Tensor]:
        """Return rows c2_ik (..., n) for i of the path."""
        return rows(self._momentum, self.qd, self.link.path)

    def owned(self) -> list[Tensor]:
        """Return rows c1_ik (..., n) for i of the path."""
        nodes = _gauss_nodes((self.link.degree + 1) // 2)
        slopes = [[w * row for row in rows(self.force, x * self.qd, self.link.path)] for x, w in nodes]
        return [sum(parts[1:], parts[0]) for parts in zip(*slopes, strict=True)]

    def unstored(self, name: str, qd: Tensor) -> Tensor:
        """Return a share without the slope of its potential, (..., n)."""
        link, q = self.link, self.q

        def motion(x: Tensor, v: Tensor, time: Tensor | None = None) -> Tensor:
            return _at(x, link.motions(x.unbind(-1), v.unbind(-1), self._given(time)).get(name, 0.0))

        def lost(v: Tensor) -> Tensor:
            return _at(q, link.dissipations(q.unbind(-1), v.unbind(-1), self._given(None)).get(name, 0.0))

        share = self._lagrange(motion, qd) + gradient(lost, qd)
        if self._time is not None:
            changing = (motion, self.kinetic) if name == link.imposed else (motion,)
            for term in changing:
                share = share + gradient(partial(self._rate, term), qd)
        given = link.forces(q.unbind(-1), qd.unbind(-1), self._given(None)).get(name, {})
        if not given:
            return share
        columns = [_at(q, given.get(k, 0.0)) for k in range(q.shape[-1])]
        return share - torch.stack(columns, -1)

    def share(self, name: str, qd: Tensor) -> Tensor:
        """Return a share s_i (..., n)."""
        return self.unstored(name, qd) + gradient(lambda x: self.potential(name, x), self.q)

    def weight(self, qd: Tensor) -> Tensor:
        """Return the sum g of all shares, (..., n)."""
        return sum((self.share(name, qd) for name in self.link.shares), torch.zeros_like(self.q))

    def torque(self, qd: Tensor, qdd: Tensor) -> Tensor:
        """Return tau (..., n)."""
        return self.inertial(qd, qdd) + self.weight(qd)

    def energies(self) -> list[Tensor]:
        """Return K, P and R, (...) each: d(K + P)/dt = tau . qd + R."""
        kinetic = self.kinetic(self.q, self.qd)
        if self.link.degree > 2:
            kinetic = (self._momentum(self.qd) * self.qd).sum(-1) - kinetic
        zero = torch.zeros_like(self.q[..., 0])
        potential = sum((self.potential(name, self.q) for name in self.link.shares), zero)
        lost = sum((self.unstored(name, self.qd) for name in self.link.shares), torch.zeros_like(self.q))
        power = -(lost * self.qd).sum(-1)
        if self._time is not None:
            for name in self.link.shares:
                power = power + gradient(partial(self.potential, name, self.q), self._time)
            moved = gradient(lambda v: self._rate(self.kinetic, v), self.qd)
            power = power + (moved * self.qd).sum(-1) - self._rate(self.kinetic, self.qd)
        return [kinetic, potential, power]

    def _momentum(self, qd: Tensor) -> Tensor:
        return gradient(lambda v: self.kinetic(self.q, v), qd)

    def _rate(self, term: Callable[..., Tensor], qd: Tensor) -> Tensor:
        """Return the derivative of a term by time itself, (...)."""
        assert self._time is not None
        return gradient(lambda time: term(self.q, qd, time), self._time)

    def _lagrange(self, term: Callable[..., Tensor], qd: Tensor) -> Tensor:
        """Return sum_s d2/dqd_i dq_s qd_s - d/dq_i of a term, (..., n)."""
        way = qd

        def along(v: Tensor) -> Tensor:
            return (gradient(lambda x: term(x, v), self.q) * way).sum(-1)

        return gradient(along, qd) - gradient(lambda x: term(x, qd), self.q)

    def _given(self, time: Tensor | None) -> Parameters:
        return self._p if time is None else self._p.with_value(self.link.time, time)


def decomposition(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> list[Tensor]:
    """Return c2 (i <= k), c1, g, tau and h1, packed link by link: (..., count) each."""
    parts: list[list[Tensor]] = [[] for _ in range(5)]
    c2, c1, g, tau, h1 = parts
    for link, one in _each(links, p, q, qd):
        path = list(link.path)
        c2 += [row[..., [k for k in path if k >= i]] for i, row in zip(path, one.inertia(), strict=True)]
        owned = [row[..., path] for row in one.owned()]
        c1 += owned
        weight = one.weight(qd)
        g.append(weight[..., path])
        tau.append((one.inertial(qd, qdd) + weight)[..., path])
        if link.uneven:
            slopes = rows(partial(_torque_at, one, qdd), qd, path)
            h1 += [2.0 * row - slope[..., path] for row, slope in zip(owned, slopes, strict=True)]
    return [torch.cat(part, -1) if part else q.new_zeros((*q.shape[:-1], 0)) for part in parts]


def torque(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
    """Return tau of every link over its path, shape (..., count)."""
    return torch.cat([one.torque(qd, qdd)[..., list(link.path)] for link, one in _each(links, p, q, qd)], -1)


def position_gradient(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
    """Return d(tau_i)/d(q_k) of every link over its path, row by row, shape (..., count)."""
    found: list[Tensor] = []
    for link in links:

        def torques(x: Tensor, link: WrittenTerms = link) -> Tensor:
            return WrittenLink(link, p, x, qd).torque(qd, qdd)

        found += [row[..., list(link.path)] for row in rows(torques, q, link.path)]
    return torch.cat(found, -1)


def energies(links: Links, p: Parameters, q: Tensor, qd: Tensor) -> Tensor:
    """Return K of every link, then P, then R, (..., 3 links)."""
    kinds = zip(*(one.energies() for _, one in _each(links, p, q, qd)), strict=True)
    return torch.cat([torch.stack(kind, -1) for kind in kinds], -1)


def named_shares(links: Links, p: Parameters, q: Tensor, qd: Tensor) -> Tensor:
    """Return the shares of every link over its path, name by name, (..., count)."""
    found = [
        one.share(name, qd)[..., list(link.path)]
        for link, one in _each(links, p, q, qd)
        for name in link.shares
    ]
    return torch.cat(found, -1) if found else q.new_zeros((*q.shape[:-1], 0))


@torch.compiler.assume_constant_result  # type: ignore[untyped-decorator, unused-ignore]
def _gauss_nodes(count: int) -> list[tuple[float, float]]:
    """Return Gauss's points from 0 to 1 with their weights; compilers take them as they are."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return [(float(x + 1.0) / 2.0, float(w) / 2.0) for x, w in zip(points, weights, strict=True)]


def _torque_at(link: WrittenLink, qdd: Tensor, qd: Tensor) -> Tensor:
    return link.torque(qd, qdd)


def _each(links: Links, p: Parameters, q: Tensor, qd: Tensor) -> list[tuple[WrittenTerms, WrittenLink]]:
    return [(link, WrittenLink(link, p, q, qd)) for link in links]


def _at(q: Tensor, value: Number) -> Tensor:
    """Return a value, which may be a number, as one for each sample."""
    if torch.is_tensor(value):
        return value.expand(q.shape[:-1])
    return q[..., 0] * 0.0 + value
