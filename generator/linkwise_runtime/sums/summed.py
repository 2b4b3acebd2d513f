"""What the sums answer, composed from the decomposition of one back end."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..dense import Dense
from ..interface import Backend
from ..passive_joints import passive_torques
from ..structure import Structure
from .inertia_solve import solved
from .joint_matrices import JointMatrices
from .namespace import hidden, namespace

AT_ONCE = 1 << 22
"""Packed numbers of one chunk of samples, each at n unit velocities; of one sample at some of them."""

Compute = Callable[[str, Sequence[Any]], Sequence[Any]]
"""The results of another call, by its name."""


class Summed:
    """The calls for a motion (..., n) of one shape, each with a tuple of arrays or tensors for an answer."""

    def __init__(self, structure: Structure, backend: Backend[Any], compute: Compute) -> None:
        self._structure, self._backend, self._compute = structure, backend, compute
        self._dense, self._matrices = Dense(structure, backend), JointMatrices(structure, backend)

    def mass_matrix(self, q: Any) -> tuple[Any, ...]:
        """M_ik = sum_j c2_ijk."""
        rest = self._rest(q)
        return (self._matrices.summed(self._compute("packed", (q, rest, rest))[0], "acceleration"),)

    def mass_matrix_by_link(self, q: Any) -> tuple[Any, ...]:
        """c2."""
        return (self._compute("coefficients", (q, self._rest(q)))[0],)

    def coriolis_matrix(self, q: Any, qd: Any) -> tuple[Any, ...]:
        """C_ik = sum_j c1_ijk."""
        return (self._matrices.summed(self._compute("packed", (q, qd, self._rest(q)))[1], "velocity"),)

    def coriolis_matrix_by_link(self, q: Any, qd: Any) -> tuple[Any, ...]:
        """c1."""
        return (self._compute("coefficients", (q, qd))[1],)

    def gravity_torque(self, q: Any) -> tuple[Any, ...]:
        """g_i = tau_i at rest."""
        rest = self._rest(q)
        return tuple(self._compute("inverse_dynamics", (q, rest, rest)))

    def gravity_torque_by_link(self, q: Any) -> tuple[Any, ...]:
        """g_ij = tau_ij at rest."""
        rest = self._rest(q)
        return tuple(self._compute("partial_torque", (q, rest, rest)))

    def forward_dynamics_of_links(self, q: Any, qd: Any, tau: Any) -> tuple[Any, ...]:
        """Solve M qdd = tau - (h + g)."""
        return self._accelerations(q, qd, tau)

    def forward_dynamics(self, q: Any, qd: Any, tau: Any) -> tuple[Any, ...]:
        """Solve (M + armature) qdd = tau - spring - damping - friction - (h + g)."""
        if not self._structure.passive:
            return self._accelerations(q, qd, tau)
        sums, side = self._structure.passive_sums, self._backend.side(q)
        spring, damping, friction, _ = passive_torques(side, sums, q, qd, self._rest(q))
        armature = side.constant(np.diag(sums.armature), q)
        return self._accelerations(q, qd, tau - (spring + damping + friction), armature)

    def _accelerations(self, q: Any, qd: Any, force: Any, armature: Any = 0.0) -> tuple[Any, ...]:
        """Solve (M + armature) qdd = force - (h + g), h + g the torque without acceleration."""
        c2, _, _, bias, _ = self._compute("packed", (q, qd, self._rest(q)))
        mass = self._matrices.summed(c2, "acceleration") + armature
        return (solved(mass, force - self._dense.summed(bias), self._structure.joint_names),)

    def energy(self, q: Any, qd: Any) -> tuple[Any, ...]:
        """K_j and P_j."""
        return self._backend.energies(q, qd)

    def power(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """c2_ijk qdd_k qd_i, c1_ijk qd_k qd_i, g_ij qd_i."""
        acceleration, velocity, gravity = self._compute("propagation", (q, qd, qdd))
        rate = qd[..., :, None, None]
        return acceleration * rate, velocity * rate, gravity * rate[..., 0]

    def christoffel(self, q: Any) -> tuple[Any, ...]:
        """The sums over j of the next."""
        return self._christoffel(q, lambda c1: self._matrices.summed(c1, "velocity"))

    def christoffel_by_link(self, q: Any) -> tuple[Any, ...]:
        """Gamma_ijkl = c1_ijk at qd = e_l, less c1 at rest, which terms of energies linear in qd leave."""
        return self._christoffel(q, lambda c1: self._dense.spread(c1, "velocity"))

    def _christoffel(self, q: Any, made: Callable[[Any], Any]) -> tuple[Any, ...]:
        n, batch, each = self._structure.n, tuple(q.shape[:-1]), max(1, sum(self._structure.sizes))
        flat, units = q.reshape(-1, n), self._backend.constant(np.eye(n), q)
        if hidden(flat):
            whole = self._of_units(flat, units, made)
        else:
            samples, rates = max(1, AT_ONCE // (n * each)), max(1, AT_ONCE // each)
            whole = _joined(
                [
                    _joined([self._of_units(part, some, made) for some in _pieces(units, rates)], -1)
                    for part in _pieces(flat, samples)
                ],
                0,
            )
        return (whole.reshape(*batch, *whole.shape[1:]),)

    def _of_units(self, q: Any, units: Any, made: Callable[[Any], Any]) -> Any:
        """What is made of c1 at some unit velocities e_l, for samples (count, n); l is the last axis."""
        places, rates = q[:, None, :] + 0.0 * units, 0.0 * q[:, None, :] + units
        values = self._compute("packed", (places, rates, 0.0 * rates))[1]
        if self._structure.linear:
            rest = self._rest(q)
            values = values - self._compute("packed", (q, rest, rest))[1][:, None, :]
        symbols = made(values)
        for axis in range(1, symbols.ndim - 1):  # vmap knows no moveaxis
            symbols = namespace(q).swapaxes(symbols, axis, axis + 1)
        return symbols

    def _rest(self, q: Any) -> Any:
        return self._backend.zeros(q, self._structure.n)


def _pieces(rows: Any, most: int) -> list[Any]:
    """Rows (count, n), so many at a time; one piece of none where there are none."""
    return [rows[at : at + most] for at in range(0, max(1, len(rows)), most)]


def _joined(parts: list[Any], axis: int) -> Any:
    return parts[0] if len(parts) == 1 else namespace(parts[0]).concat(parts, axis)
