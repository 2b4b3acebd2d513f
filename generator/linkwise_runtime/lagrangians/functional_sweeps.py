"""The results of sweeps.py by torch.func: slower, but open to transformations around them, and to compilers.

All differentiation is in reverse mode, in the lanes of sweeps.py, of which one gradient serves all: vmap,
with which torch.func makes Jacobians, needs the number of samples, which a compiler leaves open.
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.func import grad

from .energy_interface import Energies, Number, Parameters
from .lanes import LaneEntries, Leaf, Plan, SharedValues

Links = Sequence[Energies]


class LaneTables(NamedTuple):
    """Contents of `LaneEntries` in numbers of Python, which a compiler takes as they are."""

    plan: tuple[Any, ...]
    single: tuple[Any, ...]
    """Fields of the plans: of their objects themselves, compilers would ask where they come from."""
    coordinates: list[int]
    """Coordinate k of each lane of `plan`."""
    i: list[int]
    k: list[int]
    at_i: list[int]
    at_k: list[int]
    """Coordinates of each pair, and the lanes at e_i and e_k."""
    upper: list[int]
    """Pairs with i <= k."""
    rows: list[int]
    """Number of pairs of each torque."""
    single_i: list[int]
    single_at: list[int]
    """Coordinate of each torque, and its link's lane of `single`."""


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
    at = _tables(links)
    sweep, units = _Sweep(links, p, Plan(*at.plan), (q, qd, qdd)), _units(at, q)

    def momentum(x: Tensor) -> tuple[Tensor, Tensor]:
        found = sweep.slopes(x, units)[1]
        return (found * sweep.v).sum(), found

    bend, mass = grad(momentum, has_aux=True)(sweep.x)
    mass_rate = grad(lambda v: (sweep.slopes(sweep.x, v)[0] * sweep.v).sum())(units)
    c2, bent = _entries(mass, at.i, at.at_k), _entries(bend, at.k, at.at_i) - _entries(bend, at.i, at.at_k)
    c1 = 0.5 * (_entries(mass_rate, at.i, at.at_k) + bent)
    single = _Sweep(links, p, Plan(*at.single), (q, qd, qdd))
    gravity = _entries(grad(single.potential)(single.x), at.single_i, at.single_at)
    terms = c2 * qdd[..., at.k] + c1 * qd[..., at.k]
    tau = torch.stack([row.sum(-1) for row in terms.split_with_sizes(at.rows, -1)], -1) + gravity
    return [c2[..., at.upper], c1, gravity, tau, c1[..., :0]]


def torque_functional(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
    """Return tau of every link over its path, shape (..., count)."""
    at = _tables(links)
    sweep = _Sweep(links, p, Plan(*at.single), (q, qd, qdd))
    return _entries(sweep.torque(sweep.x), at.single_i, at.single_at)


def position_gradient_functional(links: Links, p: Parameters, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
    """Return d(tau_i)/d(q_k) of every link over its path, row by row, shape (..., count)."""
    at = _tables(links)
    sweep, units = _Sweep(links, p, Plan(*at.plan), (q, qd, qdd)), _units(at, q)
    slopes = grad(lambda x: (sweep.torque(x) * units).sum())(sweep.x)  # lane e_i of a link serves its tau_i
    return _entries(slopes, at.k, at.at_i)


class _Sweep:
    """Motion of one call in the lanes of a plan, (lanes, ..., n), and derivatives of all energies there."""

    def __init__(self, links: Links, p: Parameters, plan: Plan, motion: Sequence[Tensor]) -> None:
        self._links, self._p, self._plan = links, p, plan
        self.x, self.v, self.a = (part.expand(plan.lanes, *part.shape) for part in motion)

    def kinetic(self, x: Tensor, v: Tensor) -> Tensor:
        """Return the sum of the kinetic energies, shape ()."""
        q, qd = (self._plan.lay(_leaf(a), a.dim() - 1).own for a in (x, v))
        moved = zip(self._links, q, qd, strict=True)
        return _total((link.kinetic(position, speed, self._p) for link, position, speed in moved), x)

    def potential(self, x: Tensor) -> Tensor:
        """Return the sum of the potential energies, shape ()."""
        q = self._plan.lay(_leaf(x), x.dim() - 1).own
        return _total((link.potential(at, self._p) for link, at in zip(self._links, q, strict=True)), x)

    def slopes(self, x: Tensor, v: Tensor) -> tuple[Tensor, Tensor]:
        """Return dK/dq and dK/dqd."""
        force, momentum = grad(self.kinetic, (0, 1))(x, v)
        return force, momentum

    def torque(self, x: Tensor) -> Tensor:
        """Return tau at positions x, at the motion's velocities and accelerations."""

        def along(v: Tensor) -> tuple[Tensor, Tensor]:
            force, momentum = self.slopes(x, v)
            return (force * self.v + momentum * self.a).sum(), force

        rate, force = grad(along, has_aux=True)(self.v)
        tau: Tensor = rate - force + grad(self.potential)(x)
        return tau


def _leaf(values: Tensor) -> Leaf:
    """Return a leaf for values (lanes, ..., n)."""
    columns = values.unbind(-1)
    return lambda k, rows: columns[k][rows]


def _total(values: Iterable[Number], like: Tensor) -> Tensor:
    """Return the sum of what depends on the motion in any lane, over all of them."""
    total: Tensor = like.new_zeros(())
    for value in values:
        if torch.is_tensor(value):
            total = total + value.sum()
    return total


def _units(at: LaneTables, q: Tensor) -> Tensor:
    """Return the velocities e_k of the lanes, (lanes, ..., n)."""
    units = torch.eye(q.shape[-1], dtype=q.dtype, device=q.device)[at.coordinates]
    return units.reshape(len(at.coordinates), *[1] * (q.dim() - 1), -1).expand(-1, *q.shape)


def _entries(values: Tensor, k: Sequence[int], lanes: Sequence[int]) -> Tensor:
    """Return entries (lane, k) of values (lanes, ..., n), as (..., count)."""
    index = [torch.tensor(row, dtype=torch.long, device=values.device) for row in (k, lanes)]
    return values.movedim(-1, 0)[index[0], index[1]].movedim(0, -1)


def _tables(links: Links) -> LaneTables:
    numbers = {link: j for j, link in enumerate(links)}
    parents = (None if link.before is None else numbers.get(link.before) for link in links)
    tables: LaneTables = _constant_tables(tuple(link.path for link in links), tuple(parents))
    return tables


@torch.compiler.assume_constant_result  # type: ignore[untyped-decorator, unused-ignore]
def _constant_tables(paths: tuple[tuple[int, ...], ...], parents: tuple[int | None, ...]) -> LaneTables:
    """Return the tables of links, which compilers need not follow."""
    return _listed(paths, parents)


@lru_cache(maxsize=64)
def _listed(paths: tuple[tuple[int, ...], ...], parents: tuple[int | None, ...]) -> LaneTables:
    entries = LaneEntries(paths, parents)
    i, k, at_i, at_k = entries.pairs.T.tolist()
    single_i, single_at = (rows.tolist() for rows in entries.paths_in_lanes)
    rows = [len(path) for path in paths for _ in path]
    coordinates, upper = entries.lanes[:, 1].tolist(), entries.upper.tolist()
    plans = tuple(entries.plan), tuple(entries.single)
    return LaneTables(*plans, coordinates, i, k, at_i, at_k, upper, rows, single_i, single_at)
