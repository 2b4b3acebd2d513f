"""What `Dynamics` answers, composed from packed values."""

from typing import Any

from .dense import Dense
from .interface import Backend
from .structure import Structure


class Composed:
    """The calls for a motion (..., n) of one shape, each with a tuple of arrays or tensors for an answer."""

    def __init__(self, structure: Structure, backend: Backend[Any]) -> None:
        self._backend, self._n = backend, structure.n
        self._dense = Dense(structure, backend)

    def packed(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """c2, c1, g, tau, h1."""
        return tuple(self._backend.decomposition(q, qd, qdd))

    def packed_torque(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """tau on the paths."""
        return (self._backend.torque(q, qd, qdd),)

    def partial_torque(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """tau_ij."""
        return (self._dense.spread(self._backend.torque(q, qd, qdd), "torque"),)

    def inverse_dynamics(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """tau_i."""
        return (self._dense.summed(self._backend.torque(q, qd, qdd)),)

    def coefficients(self, q: Any, qd: Any) -> tuple[Any, ...]:
        """c2, c1, g."""
        c2, c1, g, _, _ = self._backend.decomposition(q, qd, self._backend.zeros(q, self._n))
        spread = self._dense.spread
        return spread(c2, "acceleration"), spread(c1, "velocity"), spread(g, "gravity")

    def propagation(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """c2_ijk qdd_k, c1_ijk qd_k, g_ij."""
        return self._propagated(q, qd, qdd, False)

    def gradient_propagation(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """The same with c1 = d(tau_ij)/d(qd_k)."""
        return self._propagated(q, qd, qdd, True)

    def position_gradient(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """c0."""
        return (self._dense.spread(self._backend.position_gradient(q, qd, qdd), "velocity"),)

    def regressor(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        """Y of tau_ij."""
        return (self._dense.spread_rows(self._backend.regressor(q, qd, qdd), "torque"),)

    def coefficient_regressors(self, q: Any, qd: Any) -> tuple[Any, ...]:
        """Y of c2, c1, g."""
        at_rest = self._backend.zeros(q, self._n)
        rows = self._backend.coefficient_regressors(q, qd, at_rest)
        fields = ("acceleration", "velocity", "gravity")
        return tuple(self._dense.spread_rows(a, field) for a, field in zip(rows, fields, strict=True))

    def _propagated(self, q: Any, qd: Any, qdd: Any, slopes: bool) -> tuple[Any, ...]:
        c2, c1, g, _, h1 = self._backend.decomposition(q, qd, qdd)
        spread = self._dense.spread
        velocity: Any = spread(c1, "velocity")
        if slopes:
            velocity = 2.0 * velocity - spread(h1, "velocity_linear")
        acceleration = spread(c2, "acceleration") * qdd[..., None, None, :]
        return acceleration, velocity * qd[..., None, None, :], spread(g, "gravity")
