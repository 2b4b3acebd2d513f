"""Partial torques and their coefficients of one link, by differentiating its Lagrangian.

With L = K - P, K of degree two in the velocities, and D_i = d/dt d/dqd_i - d/dq_i,

    tau_i = D_i L           M = d2K/dqd2            p = dK/dqd
    c1_ik = 1/2 (dM_ik/dt + dp_i/dq_k - dp_k/dq_i)  =  1/2 d(tau_i)/d(qd_k)

Nothing here is worked out beforehand: one reverse sweep gives the gradient of K, a second one how that
gradient changes along time or along one velocity, and all the directions go side by side, in one lane each.
"""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import torch
from torch import Tensor

from .recording import Recording, gradient, variable

Parameters = Mapping[str, Tensor]
"""Values by name."""
Values = Sequence[Tensor]
"""One tensor for each coordinate."""
Matrix = Sequence[Sequence[Tensor]]
"""One tensor for each pair (i, k) of coordinates."""


class PartialLagrangian(torch.nn.Module):
    """Lagrangian of one link as a module; a subclass writes down `kinetic` and `potential`."""

    path: ClassVar[tuple[int, ...]] = ()
    """Coordinates that the energies depend on, ascending, counted from 0."""
    linear: ClassVar[bool] = False
    """Whether the kinetic energy has terms linear in the velocities."""

    def __init__(self, p: Parameters) -> None:
        super().__init__()
        self.p = p

    def kinetic(self, q: Values, qd: Values) -> Any:
        """Kinetic energy in J."""
        raise NotImplementedError

    def potential(self, q: Values) -> Any:
        """Potential energy in J."""
        raise NotImplementedError

    def forward(self, q: Tensor, qd: Tensor) -> Tensor:
        """Lagrangian in J, shape (...); q and qd of shape (..., n)."""
        x, v = q.unbind(-1), qd.unbind(-1)
        energy = self.kinetic(x, v) - self.potential(x)
        value: Tensor = energy + torch.zeros_like(x[0])
        return value

    def decomposition(self, q: Tensor, qd: Tensor, qdd: Tensor) -> list[Tensor]:
        """c2 (i <= k), c1, g, tau and h1, the part of c1 linear in qd, packed over the path."""
        record = Recording.of((q, qd, qdd), self.p.values())
        with torch.enable_grad():
            d = range(len(self.path))
            x, v, a = self._motion(q), self._motion(qd), self._motion(qdd)
            mass, rate, cross, still = self._second_derivatives(x, v, record)
            gravity = self._gravity(x, record)
            c1 = [[0.5 * (rate[i][k] + cross[k][i] - cross[i][k]) for k in d] for i in d]
            h1 = [[0.5 * (still[k][i] - still[i][k]) for k in d] for i in d] if still else []
            if h1:
                c1 = [[c1[i][k] + h1[i][k] for k in d] for i in d]
            tau = [sum(mass[i][k] * a[k] + c1[i][k] * v[k] for k in d) + gravity[i] for i in d]
            return record.finish(
                [mass[i][k] for i in d for k in d[i:]],
                [c1[i][k] for i in d for k in d],
                gravity,
                tau,
                [2.0 * entry for row in h1 for entry in row],
            )

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """tau over the path, shape (..., d)."""
        record = Recording.of((q, qd, qdd), self.p.values())
        with torch.enable_grad():
            tau = self._torque(self._motion(q), self._motion(qd), self._motion(qdd), record)
            return record.finish(tau)[0]

    def position_gradient(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """d(tau_i)/d(q_k) over the path, row by row, shape (..., d * d)."""
        record = Recording.of((q, qd, qdd), self.p.values(), again=True)
        with torch.enable_grad():
            x = [variable(a) for a in self._motion(q)]
            tau = self._torque(x, self._motion(qd), self._motion(qdd), record)
            rows = [gradient(entry, x, record.keep) for entry in tau]
            return record.finish([entry for row in rows for entry in row])[0]

    def _motion(self, a: Tensor) -> list[Tensor]:
        parts = a.unbind(-1)
        return [parts[k] for k in self.path]

    def _spread(self, values: Values) -> list[Any]:
        """Values of the path's coordinates at their own indices."""
        slots: list[Any] = [None] * (self.path[-1] + 1)
        for k, value in zip(self.path, values, strict=True):
            slots[k] = value
        return slots

    def _torque(self, x: Values, v: Values, a: Values, record: Recording) -> list[Tensor]:
        """d/dt dK/dqd - dK/dq + dP/dq, the time derivative along (qd, qdd)."""
        force, _, _, momentum_rate = self._energy_gradient(x, v, v, a, record)
        gravity = self._gravity(x, record)
        return [m - f + g for m, f, g in zip(momentum_rate, force, gravity, strict=True)]

    def _gravity(self, x: Values, record: Recording) -> Values:
        x = [variable(a) for a in x]
        return gradient(self.potential(self._spread(x)), x, record.keep)

    def _energy_gradient(
        self, x: Values, v: Values, dx: Values, dv: Values, record: Recording
    ) -> tuple[Values, Values, Values, Values]:
        """dK/dx and dK/dv, and how they change along (dx, dv).

        The change of a gradient is the Hessian times the direction; the Hessian is symmetric, so that is the
        gradient of (gradient . direction): a second reverse sweep over the graph of the first.
        """
        d = len(self.path)
        x, v = [variable(a) for a in x], [variable(a) for a in v]
        slopes = gradient(self.kinetic(self._spread(x), self._spread(v)), [*x, *v], keep=True)
        along = sum((s * t).sum() for s, t in zip(slopes, [*dx, *dv], strict=True))
        rates = gradient(along, [*x, *v], record.keep)
        return slopes[:d], slopes[d:], rates[:d], rates[d:]

    def _second_derivatives(
        self, x: Values, v: Values, record: Recording
    ) -> tuple[Matrix, Matrix, Matrix, Matrix | None]:
        """M_ik, its time derivative, d2K/dq_i dqd_k, and that at rest when K has terms linear in qd."""
        d, like = len(self.path), record.like
        stand, lean, moving, carry = _lanes(d, self.linear, like)
        shape = (len(stand), *like.shape)

        def column(a: Tensor) -> Tensor:
            return a.reshape(-1, *[1] * like.dim())

        x_lanes = [a.expand(shape) for a in x]
        v_lanes = [column(stand[:, k]) + column(carry) * a for k, a in enumerate(v)]
        dx = [column(moving) * a for a in v]
        dv = [column(lean[:, k]).expand(shape) for k in range(d)]
        _, _, bend, rate = self._energy_gradient(x_lanes, v_lanes, dx, dv, record)
        mass = [[rate[i][d + k] for k in range(d)] for i in range(d)]
        mass_rate = [[rate[i][k] for k in range(d)] for i in range(d)]
        cross = [[bend[i][d + k] for k in range(d)] for i in range(d)]
        if not self.linear:
            return mass, mass_rate, cross, None
        mass_rate = [[rate[i][k] - rate[i][2 * d] for k in range(d)] for i in range(d)]
        still = [[bend[i][2 * d + 1 + k] for k in range(d)] for i in range(d)]
        return mass, mass_rate, cross, still


def _lanes(d: int, linear: bool, like: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Where lanes stand and lean, (lanes, d), and whether they move along qd and carry qd, (lanes,).

    Lanes 0..d-1 stand at velocity e_k and move along qd: d/dt (dK/dqd at e_k) is column k of dM/dt.
    Lanes d..2d-1 stand at velocity qd and lean towards e_k.
    With linear terms d + 1 more stand at rest: one moves along qd, the others lean.
    """
    units = torch.eye(d, dtype=like.dtype, device=like.device)
    none = units.new_zeros(1, d)
    stand = torch.cat([units, none.expand(d, d)] + [none.expand(d + 1, d)] * linear)
    lean = torch.cat([none.expand(d, d), units] + [none, units] * linear)
    moving = torch.tensor([1.0] * d + [0.0] * d + ([1.0] + [0.0] * d) * linear).to(units)
    carry = torch.tensor([0.0] * d + [1.0] * d + [0.0] * (d + 1) * linear).to(units)
    return stand, lean, moving, carry
