"""The Lagrangian of one link as a torch module."""

from collections.abc import Collection, Sequence
from typing import Any, ClassVar, cast

import torch
from torch import Tensor

from ..arrays.torch_modules import RunTimeValues
from ..quantities import Coefficients
from ..structure import Structure
from .autograd_backend import AutogradBackend
from .energy_interface import Number, Parameters, Values
from .functional_sweeps import lagrangians


class PartialLagrangian(torch.nn.Module):
    """Lagrangian of one link as a module; a subclass implements `kinetic` and `potential`.

    A call link(q, qd) runs torch's hooks; `torque`, `coefficients` and the calls of the whole robot
    differentiate kinetic and potential energy separately, and call no module.
    """

    path: ClassVar[tuple[int, ...]] = ()
    """Coordinates that the energies depend on, ascending, counted from 0."""
    linear: ClassVar[bool] = False
    """True if the kinetic energy has terms linear in the velocities."""
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
