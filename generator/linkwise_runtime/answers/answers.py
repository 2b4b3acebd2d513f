"""Calls of `Dynamics` as one back end answers them, for motion that has been read."""

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from ..call import PACKED
from ..call_table import CALLS
from ..interface import Numbers, is_traced, namespace, side_by_side
from ..robot_axes import axes_of
from ..structure import Structure, passive_torques
from .inertia_solve import solve_inertia
from .packed import PackedBackend, PackedTables

AT_ONCE = 1 << 22
"""Most packed numbers of a chunk of samples, each at n unit velocities, or of one sample at some of them."""

Shapes = tuple[tuple[int, ...], ...]


def answer_shapes(structure: Structure, frames: int = 0) -> dict[str, Shapes]:
    """Return the shapes of each call's results for one sample, by its key.

    Calls whose shapes depend on the arguments are left out.

    frames: the number of frames, where it is known
    """
    axes = axes_of(structure.joint_names, structure.joint_units, structure.link_names, structure.share_names)
    sizes = {axis: len(named.names) for axis, named in axes.items()}
    sizes |= dict(zip(PACKED, structure.sizes, strict=True)) | ({"frame": frames} if frames else {})
    return {
        key: tuple(tuple(sizes[axis] for axis in quantity.axes) for quantity in row.answers)
        for key, row in CALLS.items()
        if all(axis in sizes for quantity in row.answers for axis in quantity.axes)
    }


class Answers:
    """Rows of the table by their keys: methods on motion (..., n), in one shape, that return arrays."""

    contiguous = False
    """True if `out` must be contiguous."""

    def __init__(self, backend: PackedBackend) -> None:
        self._backend, self._structure = backend, backend.structure
        self._tables = PackedTables(backend)

    @cached_property
    def shapes(self) -> dict[str, Shapes]:
        """Shapes of each call's results for one sample."""
        return answer_shapes(self._structure)

    def compute_into(self, call: str, motion: Sequence[Numbers], into: Sequence[Numbers]) -> None:
        """Compute a call's results and write them into these arrays or tensors."""
        for place, value in zip(into, getattr(self, call)(*motion), strict=True):
            place[...] = value

    def packed(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return packed c2, c1, g, tau and h1, (..., count) each."""
        return self._backend.decomposition(q, qd, qdd)

    def packed_torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return tau on the paths, (..., count)."""
        return (self._backend.torque(q, qd, qdd),)

    def partial_torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return tau_ij, (..., n, N)."""
        return (self._tables.spread(self._backend.torque(q, qd, qdd), "torque"),)

    def inverse_dynamics(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return tau_i, (..., n)."""
        return (self._tables.sum_over_links(self._backend.torque(q, qd, qdd)),)

    def passive_torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return the torques for spring, damping, friction and armature, (..., n) each."""
        return passive_torques(self._backend, self._structure.passive_sums, q, qd, qdd)

    def coefficients(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return c2, c1 (..., n, N, n) and g (..., n, N)."""
        c2, c1, g, _, _ = self.packed(q, qd, self._rest(q))
        spread = self._tables.spread
        return spread(c2, "acceleration"), spread(c1, "velocity"), spread(g, "gravity")

    def propagation(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2_ijk qdd_k, c1_ijk qd_k (..., n, N, n) and g_ij (..., n, N)."""
        c2, c1, g, _, _ = self.packed(q, qd, qdd)
        return self._propagated(c2, self._tables.spread(c1, "velocity"), g, qd, qdd)

    def gradient_propagation(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return `propagation` with c1 = d(tau_ij)/d(qd_k)."""
        c2, c1, g, _, h1 = self.packed(q, qd, qdd)
        return self._propagated(c2, self._slopes(c1, h1), g, qd, qdd)

    def natural_impedance(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2, 2 c1 - h1 and c0, (..., n, N, n) each."""
        c2, c1, _, _, h1 = self.packed(q, qd, qdd)
        (stiffness,) = self.position_gradient(q, qd, qdd)
        return self._tables.spread(c2, "acceleration"), self._slopes(c1, h1), stiffness

    def named_shares(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return the shares that are not of motion by name, (..., n, N, M)."""
        if not self._structure.shares:
            (gravity,) = self.gravity_torque_by_link(q)
            return (gravity[..., None],)
        return (self._tables.spread(self._backend.named_shares(q, qd), "shares"),)

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c0, (..., n, N, n)."""
        return (self._tables.spread(self._backend.position_gradient(q, qd, qdd), "velocity"),)

    def masked(self, q: Numbers, qd: Numbers, qdd: Numbers, weights: Numbers) -> Sequence[Numbers]:
        """Return sum over m, k of w_mk c_m,ijk q_k^(m), (..., n, N), w of shape (3, n)."""
        acceleration, velocity, _ = self.coefficients(q, qd)
        total = velocity @ (weights[1] * qd)[..., None, :, None]
        total = total + acceleration @ (weights[2] * qdd)[..., None, :, None]
        # The numbers of a tensor may be hidden, as under vmap, and may weigh positions too.
        if not isinstance(weights, np.ndarray) or weights[0].any():
            (stiffness,) = self.position_gradient(q, qd, qdd)
            total = total + stiffness @ (weights[0] * q)[..., None, :, None]
        return (total[..., 0],)

    def regressor(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return Y of tau_ij, (..., n, N, 10)."""
        return (self._tables.spread_rows(self._backend.regressor(q, qd, qdd), "torque"),)

    def coefficient_regressors(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return Y of c2 and c1 (..., n, N, n, 10) and of g (..., n, N, 10)."""
        rows = self._backend.coefficient_regressors(q, qd, self._rest(q))
        fields = ("acceleration", "velocity", "gravity")
        return tuple(self._tables.spread_rows(a, field) for a, field in zip(rows, fields, strict=True))

    def mass_matrix(self, q: Numbers) -> Sequence[Numbers]:
        """Return M_ik = sum_j c2_ijk, (..., n, n)."""
        rest = self._rest(q)
        return (self._tables.matrices(self.packed(q, rest, rest)[0], "acceleration"),)

    def mass_matrix_by_link(self, q: Numbers) -> Sequence[Numbers]:
        """Return c2, (..., n, N, n)."""
        return self.coefficients(q, self._rest(q))[:1]

    def coriolis_matrix(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return C_ik = sum_j c1_ijk, (..., n, n)."""
        return (self._tables.matrices(self.packed(q, qd, self._rest(q))[1], "velocity"),)

    def coriolis_matrix_by_link(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return c1, (..., n, N, n)."""
        return self.coefficients(q, qd)[1:2]

    def gravity_torque(self, q: Numbers) -> Sequence[Numbers]:
        """Return g_i = tau_i at rest, (..., n)."""
        rest = self._rest(q)
        return self.inverse_dynamics(q, rest, rest)

    def gravity_torque_by_link(self, q: Numbers) -> Sequence[Numbers]:
        """Return g_ij = tau_ij at rest, (..., n, N)."""
        rest = self._rest(q)
        return self.partial_torque(q, rest, rest)

    def forward_dynamics_of_links(self, q: Numbers, qd: Numbers, tau: Numbers) -> Sequence[Numbers]:
        """Solve M qdd = tau - (h + g) for qdd, (..., n)."""
        mass, bias = self.equations(q, qd)
        return (solve_inertia(mass, tau - bias, self._structure.joint_names),)

    def forward_dynamics(self, q: Numbers, qd: Numbers, tau: Numbers) -> Sequence[Numbers]:
        """Solve (M + armature) qdd = tau - spring - damping - friction - (h + g) for qdd, (..., n)."""
        mass, bias = self.equations(q, qd, passive=True)
        return (solve_inertia(mass, tau - bias, self._structure.joint_names),)

    def equations(self, q: Numbers, qd: Numbers, passive: bool = False) -> tuple[Numbers, Numbers]:
        """Return M (..., n, n) and h + g (..., n) of M qdd + h + g = tau.

        passive: whether the joints' springs, damping, friction and armature are included
        """
        rest = self._rest(q)
        c2, _, _, bias, _ = self.packed(q, qd, rest)
        mass, force = self._tables.matrices(c2, "acceleration"), self._tables.sum_over_links(bias)
        if not (passive and self._structure.passive):
            return mass, force
        sums = self._structure.passive_sums
        spring, damping, friction, _ = passive_torques(self._backend, sums, q, qd, rest)
        armature = self._backend.constant(np.diag(sums.armature), q)
        return mass + armature, force + (spring + damping + friction)

    def sums(self, q: Numbers, qd: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Return M, C (..., n, n) and g (..., n)."""
        c2, c1, g, _, _ = self.packed(q, qd, self._rest(q))
        matrices = self._tables.matrices
        return matrices(c2, "acceleration"), matrices(c1, "velocity"), self._tables.sum_over_links(g)

    def energy(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return K_j and P_j, (..., N) each."""
        return [side_by_side(values) for values in self._backend.energies(q, qd)]

    def power(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2_ijk qdd_k qd_i, c1_ijk qd_k qd_i (..., n, N, n) and g_ij qd_i (..., n, N)."""
        acceleration, velocity, gravity = self.propagation(q, qd, qdd)
        rate = qd[..., :, None, None]
        return acceleration * rate, velocity * rate, gravity * rate[..., 0]

    def christoffel(self, q: Numbers) -> Sequence[Numbers]:
        """Return Gamma_ikl, the sum over j of Gamma_ijkl of `christoffel_by_link`, (..., n, n, n)."""
        return self._christoffel(q, lambda c1: self._tables.matrices(c1, "velocity"))

    def christoffel_by_link(self, q: Numbers) -> Sequence[Numbers]:
        """Return Gamma_ijkl = c1_ijk at qd = e_l, (..., n, N, n, n)."""
        return self._christoffel(q, lambda c1: self._tables.spread(c1, "velocity"))

    def check_regresses(self) -> None:
        """Raise ValueError where the back end lacks the calls that are for rigid links."""
        if not self._backend.regresses:
            raise ValueError(
                f"{self._structure.name} on {self._backend.name} has no regressors, which come from the rule "
                "for rigid links; load numpy, torch or native of a robot of rigid links"
            )

    def _slopes(self, c1: Numbers, h1: Numbers) -> Numbers:
        """Return d(tau_ij)/d(qd_k) = 2 c1 - h1, (..., n, N, n)."""
        slopes = 2.0 * self._tables.spread(c1, "velocity")
        return slopes - self._tables.spread(h1, "velocity_excess") if self._structure.nonquadratic else slopes

    def _propagated(
        self, c2: Numbers, velocity: Numbers, g: Numbers, qd: Numbers, qdd: Numbers
    ) -> Sequence[Numbers]:
        acceleration = self._tables.spread(c2, "acceleration") * qdd[..., None, None, :]
        return acceleration, velocity * qd[..., None, None, :], self._tables.spread(g, "gravity")

    def _christoffel(self, q: Numbers, made: Callable[[Numbers], Numbers]) -> Sequence[Numbers]:
        if max(self._structure.degrees, default=2) > 2:
            raise ValueError(
                f"velocity forces of {self._structure.name} have more than two velocities at once, and no "
                "Christoffel symbols; coefficients has c1"
            )
        n, batch, each = self._structure.n, q.shape[:-1], max(1, sum(self._structure.sizes))
        units = self._backend.constant(np.eye(n), q)
        if is_traced(q):
            return (side_by_side(self._of_units(q, units, made)),)
        if self._backend.samples:  # samples stay with their numbers
            # What is not of the motion's samples is refused here: the unit velocities below are samples too.
            self._backend.torque(q, self._rest(q), self._rest(q))
            rates = max(1, AT_ONCE // (each * max(1, math.prod(batch))))
            return (side_by_side(_joined([self._of_units(q, u, made) for u in _pieces(units, rates)], -1)),)
        samples, rates = max(1, AT_ONCE // (n * each)), max(1, AT_ONCE // each)
        whole = _joined(
            [
                _joined([self._of_units(part, some, made) for some in _pieces(units, rates)], -1)
                for part in _pieces(q.reshape(-1, n), samples)
            ],
            0,
        )
        return (side_by_side(whole.reshape(*batch, *whole.shape[1:])),)

    def _of_units(self, q: Numbers, units: Numbers, made: Callable[[Numbers], Numbers]) -> Numbers:
        """Return what `made` makes of c1 at unit velocities e_l, for samples (..., n); l is the last axis."""
        rates = units.reshape(len(units), *[1] * (q.ndim - 1), units.shape[-1]) + 0.0 * q
        symbols = made(self.packed(q + 0.0 * rates, rates, 0.0 * rates)[1])
        for axis in range(symbols.ndim - 1):  # vmap knows no moveaxis
            symbols = namespace(q).swapaxes(symbols, axis, axis + 1)
        return symbols

    def _rest(self, q: Numbers) -> Numbers:
        return self._backend.zeros(q, self._structure.n)


def _pieces(rows: Numbers, most: int) -> list[Numbers]:
    """Return rows (count, n) in pieces of at most `most` rows; one empty piece where there are no rows."""
    return [rows[at : at + most] for at in range(0, max(1, len(rows)), most)]


def _joined(parts: list[Numbers], axis: int) -> Numbers:
    return parts[0] if len(parts) == 1 else namespace(parts[0]).concat(parts, axis)
