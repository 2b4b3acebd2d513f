"""The results of sweeps.py by torch.func: slower, but open to transformations around them, and to compilers.

All differentiation is in reverse mode: a row of a second derivative is the gradient of one component, and the
Hessian times a direction is the gradient of (gradient . direction).

    tau = d(dL/dq . qd + dL/dqd . qdd)/dqd - dL/dq, the directions qd and qdd held fixed
    c2 = d(dL/dqd)/dqd, c1 = 1/2 d(tau)/dqd, c0 = d(tau)/dq, a row for each coordinate
"""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor
from torch.func import jacrev, vmap

from .energy_interface import Energies, Parameters
from .lanes import SharedValues

Links = Sequence[Energies]


def lagrangians(links: Links, q: Tensor, qd: Tensor, p: Parameters) -> Tensor:
    """Return the Lagrangians in J, shape (links, ...), for q and qd of shape (..., n)."""
    kinetic, potential = energies(links, q, qd, p)
    return kinetic - potential


def energies(links: Links, q: Tensor, qd: Tensor, p: Parameters) -> tuple[Tensor, Tensor]:
    """Return kinetic and potential energies in J, (links, ...) each, for q and qd of shape (..., n)."""
    x, v = SharedValues(q.unbind(-1)), SharedValues(qd.unbind(-1))
    pairs = [(link.kinetic(x, v, p), link.potential(x, p)) for link in links]
    nothing = torch.zeros_like(x[0])  # an energy may be a number
    kinetic, potential = (torch.stack([nothing + one for one in kind]) for kind in zip(*pairs, strict=True))
    return kinetic, potential


def decomposition_functional(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> list[Tensor]:
    """Return c2 (i <= k), c1, g, tau and h1, packed link by link: (..., count) each."""
    sweep, rest = _Sweep(links, p), torch.zeros_like(q)
    mass = sweep.rows(lambda v: sweep.slopes(q, v)[1], qd)
    slope = sweep.rows(lambda v: sweep.torques(q, v, qdd), qd)
    pairs = [(i, j, k) for j, link in enumerate(links) for i in link.path for k in link.path]
    return [
        _entries(mass, [(i, j, k) for i, j, k in pairs if i <= k]),
        _entries(0.5 * slope, pairs),
        sweep.packed(sweep.torques(q, rest, rest)),
        sweep.packed(sweep.torques(q, qd, qdd)),
        _entries(slope, []),
    ]


def torque_functional(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
    """Return tau of every link over its path, shape (..., count)."""
    sweep = _Sweep(links, p)
    return sweep.packed(sweep.torques(q, qd, qdd))


def position_gradient_functional(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
    """Return d(tau_i)/d(q_k) of every link over its path, row by row, shape (..., count)."""
    sweep = _Sweep(links, p)
    slope = sweep.rows(lambda x: sweep.torques(x, qd, qdd), q)
    return _entries(slope, [(i, j, k) for j, link in enumerate(links) for i in link.path for k in link.path])


class _Sweep:
    """Derivatives of the Lagrangians of all links, for motion (..., n): the links' axis comes first."""

    def __init__(self, links: Links, p: Parameters) -> None:
        self._links, self._p = links, p

    def energies(self, q: Tensor, qd: Tensor) -> Tensor:
        """Return the Lagrangians summed over the samples, shape (links,)."""
        return _per_link(lagrangians(self._links, q, qd, self._p))

    def slopes(self, q: Tensor, qd: Tensor) -> tuple[Tensor, Tensor]:
        """Return dL/dq and dL/dqd (links, ..., n)."""
        force, momentum = jacrev(self.energies, (0, 1))(q, qd)
        return force, momentum

    def torques(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """Return tau (links, ..., n)."""

        def along(v: Tensor) -> Tensor:
            force, momentum = self.slopes(q, v)
            return _per_link(force * qd + momentum * qdd)

        rate: Tensor = jacrev(along)(qd)
        return rate - self.slopes(q, qd)[0]

    def rows(self, function: Callable[[Tensor], Tensor], at: Tensor) -> Tensor:
        """Return d(function_i)/d(at_k), (i, links, ..., k)."""
        units = torch.eye(at.shape[-1], dtype=at.dtype, device=at.device)
        rows: Tensor = vmap(lambda unit: jacrev(lambda x: _per_link(function(x) * unit))(at))(units)
        return rows

    def packed(self, tau: Tensor) -> Tensor:
        """Return torques (links, ..., n) over the paths, (..., count)."""
        return torch.cat([tau[j][..., list(link.path)] for j, link in enumerate(self._links)], -1)


def _per_link(values: Tensor) -> Tensor:
    """Return values (links, ...) summed over the samples, which do not depend on one another."""
    return values.reshape(len(values), -1).sum(1)


def _entries(values: Tensor, places: Sequence[tuple[int, int, int]]) -> Tensor:
    """Return entries (i, j, k) of values (i, links, ..., k), as (..., count)."""
    rows = [[*place] for place in zip(*places, strict=True)] or [[], [], []]
    i, j, k = (torch.tensor(row, dtype=torch.long, device=values.device) for row in rows)
    return values.movedim(-1, 0)[k, i, j].movedim(0, -1)
