"""The Lagrangian of a link that was written by hand, with its dissipation and forces, as a torch module."""

from collections.abc import Mapping
from typing import Any, ClassVar

from torch import Tensor

from .energy_interface import Number, Parameters, Values
from .partial_lagrangian import PartialLagrangian


class WrittenLagrangian(PartialLagrangian):
    """Terms of one link as a module; a subclass implements `kinetic` and what it has by names of shares.

    A call link(q, qd) returns L = kinetic + motions - potentials, without dissipation and forces.
    """

    degree: ClassVar[int] = 2
    """Highest power of the velocities in the kinetic energy, all of whose terms have degree two or more."""
    shares: ClassVar[tuple[str, ...]] = ()
    """Names of the shares that are not of motion."""
    imposed: ClassVar[str] = ""
    """Name of the share that takes what time itself changes in the kinetic energy; empty without."""
    uneven: ClassVar[bool] = False
    """True if d(tau)/d(qd) is not 2 c1, as with dissipation."""
    time: ClassVar[str] = ""
    """Name of the parameter that is time; empty where nothing depends on it."""

    def potentials(self, q: Values, p: Parameters) -> Mapping[str, Number]:
        """Return potential energies in J, by share."""
        return {}

    def motions(self, q: Values, qd: Values, p: Parameters) -> Mapping[str, Number]:
        """Return terms of the Lagrangian in J of degree one or none in the velocities, by share."""
        return {}

    def dissipations(self, q: Values, qd: Values, p: Parameters) -> Mapping[str, Number]:
        """Return Rayleigh's dissipation in W, by share."""
        return {}

    def forces(self, q: Values, qd: Values, p: Parameters) -> Mapping[str, Mapping[int, Number]]:
        """Return generalised forces in N m or N, by share and coordinate, counted from 0."""
        return {}

    def potential(self, q: Values, p: Parameters) -> Number:
        """Return the potential energy in J, of all shares."""
        return sum(self.potentials(q, p).values(), 0.0)

    def forward(self, q: Tensor, qd: Tensor) -> Tensor:
        """Return the Lagrangian in J, shape (...); q and qd of shape (..., n)."""
        at, moved = self._read(q=q, qd=qd)
        x, v, p = at.unbind(-1), moved.unbind(-1), self._backend.seen_by(at)
        motion: Any = sum(self.motions(x, v, p).values(), 0.0)
        value: Tensor = 0.0 * at[..., 0] + self.kinetic(x, v, p) + motion - self.potential(x, p)
        return value
