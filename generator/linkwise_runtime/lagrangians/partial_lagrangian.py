"""The Lagrangian of one link as a torch module, and that of a rigid link, whose numbers the module holds."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, ClassVar, cast

import torch
from torch import Tensor

from ..arrays.torch_modules import RunTimeValues, hold
from ..interface import Unscripted
from ..quantities import Coefficients
from ..structure import Structure
from .autograd_backend import AutogradBackend
from .energy_interface import Nested, Number, Parameters, Values, transformed
from .frame_motion import Vector
from .functional_sweeps import lagrangians

Body = tuple[Number, Vector, Sequence[Vector] | Tensor]
"""Mass in kg, centre of mass in m, inertia about it in kg m^2."""

CROSS = (
    (0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0),
    (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0),
    (0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
)
"""Tensor with c·CROSS the entries of the matrix [c]×, row by row, where [c]× a = c × a."""


class PartialLagrangian(Unscripted, torch.nn.Module):
    """Lagrangian of one link as a module; a subclass implements `kinetic` and `potential`.

    A call link(q, qd) runs torch's hooks; `torque`, `coefficients` and the calls of the whole robot
    differentiate kinetic and potential energy separately, and call no module.
    """

    path: ClassVar[tuple[int, ...]] = ()
    """Coordinates that the energies depend on, ascending, counted from 0."""
    parent: ClassVar["type[PartialLagrangian] | None"] = None
    """Lagrangian of the link that carries this one, if their energies share work."""

    def __init__(
        self,
        alone: Structure,
        given: RunTimeValues,
        before: "PartialLagrangian | None" = None,
        learned: Collection[str] = (),
    ) -> None:
        """Hold the link's back end; `alone` is the robot with this link only.

        given: the run-time parameters
        before: module of the link that carries this one; no submodule, as each tensor has one owner
        learned: names of constants that are nn.Parameters
        """
        super().__init__()
        self._before = (before,)
        self._backend = AutogradBackend(alone, (self,), given)

    @property
    def before(self) -> Any:
        """Module of the link that carries this one; None where their energies share no work."""
        return self._before[0]

    def kinetic(self, q: Values, qd: Values, p: Parameters) -> Number:
        """Return the kinetic energy in J."""
        raise NotImplementedError

    def potential(self, q: Values, p: Parameters) -> Number:
        """Return the potential energy in J."""
        raise NotImplementedError

    def check_quadratic(self, q: Tensor, qd: Tensor, seen: Callable[[Tensor], Parameters]) -> None:
        """Accept the kinetic energy: linkwise wrote it; a module of the user's is looked at."""

    def forward(self, q: Tensor, qd: Tensor) -> Tensor:
        """Return the Lagrangian in J, shape (...); q and qd of shape (..., n)."""
        at, moved = self._read(q=q, qd=qd)
        return lagrangians((self,), at, moved, self._backend.seen_by(at))[0]

    def energies(self, q: Tensor, qd: Tensor) -> tuple[Tensor, Tensor]:
        """Return kinetic and potential energy in J, shape (...) each."""
        kinetic, potential = self._backend.answers.energy(*self._read(q=q, qd=qd))
        return cast(Tensor, kinetic[..., 0]), cast(Tensor, potential[..., 0])

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """Return tau_ij of this link j, the torque on each joint i through it, shape (..., n)."""
        (tau,) = self._backend.answers.partial_torque(*self._read(q=q, qd=qd, qdd=qdd))
        return cast(Tensor, tau[..., 0])

    def coefficients(self, q: Tensor, qd: Tensor) -> Coefficients[Tensor]:
        """Return c2_ik and c1_ik (..., n, n) and g_i (..., n) of this link, in the closing convention."""
        c2, c1, g = self._backend.answers.coefficients(*self._read(q=q, qd=qd))
        return Coefficients(*(cast(Tensor, a) for a in (c2[..., 0, :], c1[..., 0, :], g[..., 0])))

    def _read(self, **named: Tensor) -> Sequence[Tensor]:
        return cast("Sequence[Tensor]", self._backend.arrays(named, self._backend.structure.n))


class RigidLagrangian(PartialLagrangian):
    """Lagrangian of a rigid link; a subclass lists its numbers in `constants`.

    They are float64 buffers of the module, or nn.Parameters where they are `learned`, by these names:

    mass     in kg, shape ()
    com      centre of mass in m, (3,)
    inertia  about the centre of mass in kg m^2, (3, 3); only its symmetric part counts
    place    of its joint in the frame of the link before it, in m, (3,); place_a, place_b, ... where joints
             without a body lie between them

    Numbers that depend on run-time parameters are not listed: the subclass computes them from these.
    """

    constants: ClassVar[Mapping[str, Nested]] = {}
    places: ClassVar[Mapping[int, str]] = {}
    """Joints, counted as in tree.py, whose place is one of these constants, and the constant's name."""

    def __init__(
        self,
        alone: Structure,
        given: RunTimeValues,
        before: PartialLagrangian | None,
        learned: Collection[str] = (),
    ) -> None:
        super().__init__(alone, given, before)
        for name, value in self.constants.items():
            hold(self, name, value, name.partition("_")[0] in learned)

    def body(self, p: Parameters) -> Body:
        """Return mass, centre of mass and inertia: numbers, or tensors to differentiate by."""
        own = p.constants(self)
        return own["mass"], own["com"], own["inertia"]


def kinetic_energy(body: Body, w: Sequence[Number], v: Sequence[Number]) -> Number:
    """Return m v·v/2 + m v·(w × c) + w·I w/2 in J.

    I = inertia + m (c·c 1 - c cᵀ) is the inertia about the frame's origin.

    body: mass m in kg, centre of mass c in m, inertia about it in kg m^2: tensors, or numbers where
    nothing is differentiated by them
    w, v: angular velocity in rad/s and velocity of the frame's origin in m/s, in the body's axes; tensors of
    one shape, and the number 0.0 for components that are always zero
    """
    moving = {a: value for a, value in enumerate((*w, *v)) if torch.is_tensor(value)}
    if not moving:
        return 0.0
    values = list(moving.values())
    if not values[0].dim() and not transformed():
        return _written_out(w, v, *body)
    speeds = torch.stack(values)
    if _holds_tensors(body):
        parts = (_tensor(part, axes, speeds) for axes, part in enumerate(body))
        half = 0.5 * _spatial_inertia(*parts)
        if len(moving) < 6:
            kept = torch.tensor(list(moving), device=half.device)
            half = half[..., kept[:, None], kept]
    else:
        rows = _spatial_numbers(*cast("tuple[float, Sequence[float], Sequence[Sequence[float]]]", body))
        table = [[0.5 * rows[a][b] for b in moving] for a in moving]
        half = torch.tensor(table, dtype=speeds.dtype, device=speeds.device)
    return (speeds * _product(half, speeds)).sum(0)


def _written_out(
    w: Sequence[Number], v: Sequence[Number], m: Number, c: Vector, inertia: Sequence[Vector] | Tensor
) -> Number:
    """Return m u·u/2 + w·inertia w/2 with u = v + w × c, for single numbers.

    A recording of one sample then shows products and sums of numbers, without those with zeros.
    """
    u = [
        _dot((1.0, c[2], -c[1]), (v[0], w[1], w[2])),
        _dot((1.0, c[0], -c[2]), (v[1], w[2], w[0])),
        _dot((1.0, c[1], -c[0]), (v[2], w[0], w[1])),
    ]
    return 0.5 * _dot((m, 1.0), (_dot(u, u), _dot(w, [_dot(row, w) for row in inertia])))


def _dot(a: Vector, b: Vector) -> Number:
    """Return a·b without the products with the number 0."""
    pairs = ((x, y) for x, y in zip(a, b, strict=True) if not (_is(x, 0.0) or _is(y, 0.0)))
    products = [y if _is(x, 1.0) else x * y for x, y in pairs]
    return sum(products[1:], products[0]) if products else 0.0


def _is(value: Number, number: float) -> bool:
    return not torch.is_tensor(value) and value == number


def _spatial_inertia(m: Tensor, c: Tensor, inertia: Tensor) -> Tensor:
    """Return H (..., 6, 6) with K = (w, v)·H (w, v)/2: the blocks I, m [c]×, its transpose and m 1."""
    cross = c @ c.new_tensor(CROSS)
    cross = cross.reshape(*c.shape, 3)
    mass = m[..., None, None]
    moment = mass * cross
    about = inertia + moment @ cross.mT
    moment = moment.expand(about.shape)
    weight = (mass * torch.eye(3, dtype=c.dtype, device=c.device)).expand(about.shape)
    return torch.cat([torch.cat([about, moment], -1), torch.cat([moment.mT, weight], -1)], -2)


def _spatial_numbers(m: float, c: Sequence[float], inertia: Sequence[Sequence[float]]) -> list[list[float]]:
    """Return the matrix H (6, 6) of `_spatial_inertia` as lists of numbers."""
    x, y, z = c
    cross = ((0.0, -m * z, m * y), (m * z, 0.0, -m * x), (-m * y, m * x, 0.0))
    squares = (y * y + z * z, x * x + z * z, x * x + y * y)
    rows = []
    for i in range(3):
        about = [inertia[i][k] + m * (squares[i] if i == k else -c[i] * c[k]) for k in range(3)]
        rows.append([*about, *cross[i]])
    return rows + [
        [*(cross[k][i] for k in range(3)), *(m if i == k else 0.0 for k in range(3))] for i in range(3)
    ]


def _product(matrix: Tensor, vector: Tensor) -> Tensor:
    """Return a matrix (m, m), behind axes of samples if each has its own, times a vector (m, ...)."""
    if matrix.dim() == vector.dim() == 2:
        return matrix @ vector
    if matrix.dim() == 2:
        return (matrix @ vector.reshape(len(vector), -1)).reshape(vector.shape)
    table = matrix.movedim((-2, -1), (0, 1))
    ones = [1] * (vector.dim() + 1 - table.dim())
    return (table.reshape(*table.shape[:2], *ones, *table.shape[2:]) * vector).sum(1)


def _holds_tensors(value: Nested | Body) -> bool:
    """Return whether a number, or anything nested in a list of numbers, is a tensor."""
    if isinstance(value, list | tuple):
        return any(map(_holds_tensors, value))
    return value.__class__ is not float


def _tensor(value: Nested | Body, axes: int, like: Tensor) -> Tensor:
    """Return a number, a vector or a matrix as a tensor.

    It has `axes` axes of 3, behind axes of samples if entries have these.
    """
    if torch.is_tensor(value) or not _holds_tensors(value):
        return torch.as_tensor(value, dtype=like.dtype, device=like.device)
    rows = cast(Sequence[Sequence[Number]], value if axes == 2 else [value])
    given = [torch.as_tensor(entry, dtype=like.dtype, device=like.device) for row in rows for entry in row]
    stacked: Tensor = torch.stack(torch.broadcast_tensors(*given), -1)  # type: ignore[no-untyped-call]
    return stacked.reshape(*stacked.shape[:-1], *[3] * axes)
