"""Link whose energies a module of the user's has in place of the package's: one that is learned, say."""

from typing import Any

import torch

from .energy_interface import Number, Parameters, Values
from .partial_lagrangian import PartialLagrangian, RigidLagrangian

FACE = ("kinetic", "potential")
SAMPLES = 8
"""Number of samples by which energies are tried."""


class ReplacedLink(PartialLagrangian):
    """Energies of a user's module, at the place of a link in the chain.

    Links that hang on it are moved by `own`, the package's module, with its numbers; `own` has no energy any
    more, unless the user's module asks it for that.
    """

    def __init__(self, own: RigidLagrangian, module: torch.nn.Module) -> None:
        super().__init__(own._backend.structure, own._backend.given, own.before)
        self.path = own.path  # type: ignore[misc]
        self.module = module
        if all(own is not inside for inside in module.modules()):
            self.own = own
        self._own = (own,)  # no second owner of its tensors where the user's module has it

    def kinetic(self, q: Values, qd: Values, p: Parameters) -> Number:
        """Return the kinetic energy in J, by the user's module."""
        found: Number = self.module.kinetic(q, qd, p)  # type: ignore[operator]
        return found

    def potential(self, q: Values, p: Parameters) -> Number:
        """Return the potential energy in J, by the user's module."""
        found: Number = self.module.potential(q, p)  # type: ignore[operator]
        return found

    def __getattr__(self, name: str) -> Any:
        """Return what the package's module has: its numbers and where they belong."""
        try:
            return super().__getattr__(name)
        except AttributeError:
            return getattr(self.__dict__["_own"][0], name)


def replaced(own: PartialLagrangian, module: object) -> ReplacedLink:
    """Return a link with the energies of a user's module; raises TypeError for one without them."""
    while isinstance(own, ReplacedLink):
        own = own._own[0]
    if not isinstance(own, RigidLagrangian):
        raise TypeError(
            "links that were written in SymPy have shares by name, which a module does not say; write the "
            "energy there, or add the module's torque to the robot's"
        )
    lacking = [name for name in FACE if not callable(getattr(module, name, None))]
    if not isinstance(module, torch.nn.Module) or lacking:
        told = f" without {' and '.join(lacking)}" if lacking else ""
        raise TypeError(
            f"a link is a torch.nn.Module with kinetic(q, qd, p) and potential(q, p), energies in J of shape "
            f"q[k].shape; this is {type(module).__name__}{told}"
        )
    made = ReplacedLink(own, module)
    _check_energies(made)
    return made


def _check_energies(link: ReplacedLink) -> None:
    """Raise TypeError for energies of another shape, and a kinetic energy not of degree two in velocities.

    Coefficients c1 own the velocity forces of energies of degree two alone.
    """
    n = link._backend.structure.n
    for dtype in (torch.float64, torch.float32):
        draw = torch.Generator().manual_seed(0)
        q, qd = (torch.rand(n, SAMPLES, dtype=dtype, generator=draw) for _ in range(2))
        given = link._backend.seen_by(q.mT)
        try:
            with torch.no_grad():
                once, twice = (link.kinetic(q.unbind(), (by * qd).unbind(), given) for by in (1.0, 2.0))
                energies = {"kinetic": once, "potential": link.potential(q.unbind(), given)}
        except RuntimeError:  # a module of the other dtype, whose calls are to have motion of that
            continue
        for name, energy in energies.items():
            if isinstance(energy, torch.Tensor) and energy.shape != (SAMPLES,):
                raise TypeError(
                    f"{name} answers with shape {tuple(energy.shape)} where each q[k] has shape ({SAMPLES},)"
                    "; give one energy in J for each sample"
                )
        once, twice = torch.as_tensor(once), torch.as_tensor(twice)
        size = float(once.nan_to_num().abs().max())  # NaN where the energy is not defined tells nothing
        if not torch.allclose(twice, 4.0 * once, rtol=1e-4, atol=1e-4 * size, equal_nan=True):
            raise TypeError(
                "its kinetic energy is not of degree two in the velocities, so that no coefficients own its "
                "forces; give sums of m_ik(q) qd_i qd_k, a mass matrix that is learned, say"
            )
        return
