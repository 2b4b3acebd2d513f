"""Partial torques and their parts, recorded for one sample, from the Lagrangians of links.

With L = K - P of a link, p_i = dK/dqd_i, and every derivative by autograd:

    tau_ij = sum_k dp_i/dqd_k qdd_k + h_i + g_ij      h_i = sum_s dp_i/dq_s qd_s - dK/dq_i      g_ij = dP/dq_i
    c2_ijk = dp_i/dqd_k     c1_ijk = 1/2 dh_i/dqd_k     c0_ijk = d(tau_ij)/d(q_k)

Of links that were written by hand g_ij is the sum of all shares with names, and c1 of those with a kinetic
energy of degree three or more is the mean of dh_i/dqd_k on the way from rest, as in written_sweeps.py.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
import torch
from torch import Tensor

from ..structure import Structure
from .operation_recorder import Leaf, Operation, OperationRecorder, Ref

MOTIONS = ("q", "qd", "qdd")
Number = Tensor | float
Slopes = tuple[dict[int, Number], dict[int, Number], Number]
"""Derivatives dp_i/dq_s and dp_i/dqd_s of a link by s, and dK/dq_i."""
Part = tuple[int | None, int | None]
"""Coordinate k and order m of a part; (None, None) is the torque, (None, 0) gravity, or all named shares."""


@dataclass(frozen=True)
class LinkEnergies:
    """Energies of one link in J, as functions of sequences of coordinates and velocities."""

    path: tuple[int, ...]
    kinetic: Callable[[Sequence[Tensor], Sequence[Tensor]], Number]
    potential: Callable[[Sequence[Tensor]], Number]
    written: "WrittenEnergies | None" = None
    """Terms beside them, of a link that was written by hand."""


@dataclass(frozen=True)
class WrittenEnergies:
    """Sums over the shares of a link that was written by hand, and the leaf that is time."""

    degree: int
    motion: Callable[[Sequence[Tensor], Sequence[Tensor]], Number]
    dissipation: Callable[[Sequence[Tensor], Sequence[Tensor]], Number]
    force: Callable[[Sequence[Tensor], Sequence[Tensor], int], Number]
    time: Tensor | None


@dataclass(frozen=True)
class RecordedParts:
    """A recording: all operations in order, the leaves, and the value of each part."""

    operations: Mapping[str, Operation]
    leaves: Mapping[str, Leaf]
    values: Mapping[Part, Ref | float]


def record(
    structure: Structure,
    links: Callable[[Mapping[str, Tensor]], Iterable[LinkEnergies]],
    beside: Mapping[Leaf, Tensor],
    joint: int,
    parts: Iterable[Part],
) -> RecordedParts:
    """Record parts of the torque on a joint, through the sum of some links.

    links: energies, for the values of leaves by their keys
    beside: the leaves that are no motion, with their values
    """
    recorder, leaves = OperationRecorder(), dict[str, Leaf]()

    def tensor_of(leaf: Leaf, value: float, varies: bool = False) -> Tensor:
        leaves[leaf.key] = leaf
        tensor = torch.tensor(value, dtype=torch.float64, device="cpu", requires_grad=varies)
        return recorder.leaf(leaf, tensor)

    names = structure.joint_names
    with torch.inference_mode(False), torch.enable_grad():
        motion = [
            [
                tensor_of(Leaf(f"{kind}[{k}]", kind, name), 0.3 + 0.1 * k, kind != "qdd")
                for k, name in enumerate(names)
            ]
            for kind in MOTIONS
        ]
        # Time is a parameter, by which written energies are differentiated.
        values = {
            leaf.key: tensor_of(leaf, value.detach().reshape(-1)[0].item(), leaf.name == structure.time)
            for leaf, value in beside.items()
        }
        energies = list(links(values))
        with recorder:
            recorded = _Torque(recorder, energies, joint, motion)
            found = {part: cast("Ref | float", recorder.operand(recorded.part(*part))) for part in parts}
    return RecordedParts(recorder.operations, leaves, found)


class _Torque:
    """Parts of a torque, summed over links; each coefficient is multiplied by its motion once."""

    def __init__(
        self,
        recorder: OperationRecorder,
        links: Sequence[LinkEnergies],
        joint: int,
        motion: Sequence[Sequence[Tensor]],
    ) -> None:
        self._recorder, self._joint = recorder, joint
        self._q, self._qd, self._qdd = motion
        self._links = [link for link in links if joint in link.path]
        self._path = sorted({k for link in self._links for k in link.path})

    def part(self, k: int | None, m: int | None) -> Number:
        """Return the value of a part: a tensor, or 0.0."""
        if m == 0:
            return self.gravity if k is None else _times(self._at(self.stiffness, k), self._q[k])
        if k is None:
            inertial = [self.part(s, 2) for s in self._path] if m != 1 else []
            moving = [self.velocity_force] if m != 2 else []
            return _sum([*inertial, *moving, *([self.gravity] if m is None else [])])
        acceleration = _times(self._at(self.inertia, k), self._qdd[k]) if m != 1 else 0.0
        velocity = _times(self._at(self.damping, k), self._qd[k]) if m != 2 else 0.0
        return _sum([acceleration, velocity])

    @cached_property
    def inertia(self) -> list[Number]:
        """Coefficients c2_ik, by k on the path."""
        return [_sum([rates[k] for _, rates, _ in self._moving if k in rates]) for k in self._path]

    @cached_property
    def velocity_force(self) -> Number:
        """Force h_i, summed over the links."""
        return _sum([self._force(slopes, self._qd) for slopes in self._moving])

    @cached_property
    def damping(self) -> list[Number]:
        """Coefficients c1_ik in the closing convention, by k on the path."""
        degree = max((link.written.degree for link in self._links if link.written), default=2)
        if degree <= 2:
            slopes = self._slopes(self.velocity_force, [self._qd[k] for k in self._path], 3)
            return [_times(slope, 0.5) for slope in slopes]
        points, weights = np.polynomial.legendre.leggauss((degree + 1) // 2)
        parts = []
        for point, weight in zip((points + 1.0) / 2.0, weights / 2.0, strict=True):
            moved = [float(point) * v for v in self._qd]
            slopes_of = (self._momentum(link.kinetic, link.path, moved) for link in self._links)
            force = _sum([self._force(slopes, moved) for slopes in slopes_of])
            slopes = self._slopes(force, [moved[k] for k in self._path], 3)
            parts.append([_times(slope, float(weight)) for slope in slopes])
        return [_sum(column) for column in zip(*parts, strict=True)]

    @cached_property
    def gravity(self) -> Number:
        """Gravity torque g_i, or that of all shares with names, summed over the links."""
        at = [self._q[self._joint]]
        stored = [slope for link in self._links for slope in self._slopes(link.potential(self._q), at, 1)]
        return _sum([*stored, *(part for link in self._links if link.written for part in self._lost(link))])

    def _lost(self, link: LinkEnergies) -> Iterator[Number]:
        """Yield parts of the shares of a link that was written by hand, but for its potentials."""
        written, qd, i = link.written, self._qd, self._joint
        assert written is not None
        yield self._force(self._momentum(written.motion, link.path, qd), qd)
        yield from self._slopes(written.dissipation(self._q, qd), [qd[i]], 1)
        yield _times(written.force(self._q, qd, i), -1.0)
        if written.time is not None:
            for term in (written.motion, link.kinetic):
                (momentum,) = self._slopes(term(self._q, qd), [qd[i]], 1)
                yield from self._slopes(momentum, [written.time], 2)

    @cached_property
    def stiffness(self) -> list[Number]:
        """Coefficients c0_ik, by k on the path."""
        return self._slopes(self.part(None, None), [self._q[k] for k in self._path], 3)

    def _at(self, coefficients: Sequence[Number], k: int) -> Number:
        return coefficients[self._path.index(k)] if k in self._path else 0.0

    @cached_property
    def _moving(self) -> list[Slopes]:
        return [self._momentum(link.kinetic, link.path, self._qd) for link in self._links]

    def _momentum(
        self,
        energy: Callable[[Sequence[Tensor], Sequence[Tensor]], Number],
        path: tuple[int, ...],
        qd: Sequence[Tensor],
    ) -> Slopes:
        """Return dp_i/dq_s and dp_i/dqd_s by s, and dK/dq_i of an energy K of a link with this path."""
        kinetic = energy(self._q, qd)
        momentum, force = self._slopes(kinetic, [qd[self._joint], self._q[self._joint]], 1)
        slopes = self._slopes(momentum, [*(self._q[s] for s in path), *(qd[s] for s in path)], 2)
        bends, rates = slopes[: len(path)], slopes[len(path) :]
        return dict(zip(path, bends, strict=True)), dict(zip(path, rates, strict=True)), force

    def _force(self, slopes: Slopes, qd: Sequence[Tensor]) -> Number:
        bends, _, force = slopes
        turned = _sum([_times(bend, qd[s]) for s, bend in bends.items()])
        if _none(force):
            return turned
        return -force if _none(turned) else turned - force

    def _slopes(self, value: Number, by: Sequence[Tensor], order: int) -> list[Number]:
        """Return derivatives of a value, which can be differentiated again; 0.0 where it has none."""
        if not torch.is_tensor(value) or not value.requires_grad:
            return [0.0] * len(by)
        with self._recorder.derivative(order):
            found = torch.autograd.grad(value, by, create_graph=True, allow_unused=True)
        return [0.0 if slope is None else slope for slope in found]


def _none(value: Number) -> bool:
    return not torch.is_tensor(value) and value == 0.0


def _times(a: Number, b: Number) -> Number:
    return 0.0 if _none(a) or _none(b) else a * b


def _sum(values: Sequence[Number]) -> Number:
    there = [value for value in values if not _none(value)]
    return sum(there[1:], there[0]) if there else 0.0
