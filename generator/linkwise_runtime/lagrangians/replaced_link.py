"""Link whose energies a module of the user's has in place of the package's: one that is learned, say."""

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor

from .energy_interface import Number, Parameters, Values
from .partial_lagrangian import PartialLagrangian, RigidLagrangian

FACE = ("kinetic", "potential")
SAMPLES = 32
"""Number of samples by which energies are tried, unless parameters have samples of their own."""
REMEDY = "give sums of m_ik(q) qd_i qd_k, a mass matrix that is learned, say"


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
        return float(found) if isinstance(found, int) else found

    def potential(self, q: Values, p: Parameters) -> Number:
        """Return the potential energy in J, by the user's module."""
        found: Number = self.module.potential(q, p)  # type: ignore[operator]
        return float(found) if isinstance(found, int) else found

    def check_quadratic(self, q: Tensor, qd: Tensor, seen: Callable[[Tensor], Parameters]) -> None:
        """Raise ValueError for a kinetic energy that is no quadratic form of the velocities (..., n).

        It is one if K(a + b) + K(a - b) = 2 K(a) + 2 K(b), here at a = qd and one b; only then do
        coefficients own its forces. A weight that training has moved may have changed it.

        seen: function of q that returns the parameters as a call computes with them
        """
        p = seen(q)
        with torch.no_grad():
            other = (1.0 + abs(qd).amax()) * torch.linspace(0.3, 1.1, qd.shape[-1]).to(qd).expand(qd.shape)
            at = q.unbind(-1)
            speeds = (qd + other, qd - other, qd, other)
            both = [torch.as_tensor(self.kinetic(at, v.unbind(-1), p)) for v in speeds]
            left, size = both[0] + both[1] - 2.0 * (both[2] + both[3]), sum(map(abs, both))
            wrong = abs(left) > torch.finfo(qd.dtype).eps ** 0.5 * size
        if bool(wrong.any()):
            raise ValueError(
                f"the kinetic energy of a replaced link, {type(self.module).__name__}, is no quadratic form "
                f"of the velocities, so that no coefficients own its forces; {REMEDY}"
            )

    def __getattr__(self, name: str) -> Any:
        """Return what the package's module has: its numbers and where they belong."""
        try:
            return super().__getattr__(name)
        except AttributeError:
            return getattr(self.__dict__["_own"][0], name)


def replaced(own: PartialLagrangian, module: object) -> PartialLagrangian:
    """Return a link with the energies of a user's module, or the package's own for itself.

    Raises TypeError for a module without energies, or with such as a call could not use.
    """
    while isinstance(own, ReplacedLink):
        own = own._own[0]
    if module is own:
        return own
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
    """Raise TypeError for energies that a call could not use: of another kind or shape, without a slope.

    Raises whatever the module raises, if it does for motion of float64 and of float32.
    """
    structure, values = link._backend.structure, link._backend.given.values()
    shapes = [value.shape for value in values]
    batch = torch.broadcast_shapes(*shapes) or (SAMPLES,)  # type: ignore[no-untyped-call]
    device = next((t.device for t in link.module.state_dict().values()), torch.device("cpu"))
    draw, error = torch.Generator().manual_seed(0), None
    for dtype in (torch.float64, torch.float32):
        motion = (torch.randn(*batch, structure.n, dtype=dtype, generator=draw) for _ in range(2))
        q, qd = (a.to(device).requires_grad_() for a in motion)
        given = link._backend.seen_by(q)
        try:
            with torch.enable_grad():
                kinetic = link.kinetic(q.unbind(-1), qd.unbind(-1), given)
                potential = link.potential(q.unbind(-1), given)
        except RuntimeError as found:  # of a module of the other dtype, say
            error = error or found
            continue
        _check_energy("kinetic", kinetic, batch, "qd")
        _check_energy("potential", potential, batch, "q")
        if device.type != "meta":
            try:
                link.check_quadratic(q, qd, link._backend.seen_by)
            except ValueError as found:
                raise TypeError(str(found)) from None
        return
    if error is not None:
        raise error


def _check_energy(name: str, energy: object, batch: Sequence[int], by: str) -> None:
    if isinstance(energy, float):
        return
    if not isinstance(energy, torch.Tensor) or not energy.is_floating_point():
        kind = energy.dtype if isinstance(energy, torch.Tensor) else type(energy).__name__
        raise TypeError(f"{name} answers with {kind}; give a tensor of real numbers, made by torch from {by}")
    if energy.shape != batch:
        raise TypeError(
            f"{name} answers with shape {tuple(energy.shape)} where each q[k] has shape {tuple(batch)}; give "
            "one energy in J for each sample"
        )
    known = energy.detach() if energy.device.type != "meta" else energy.new_zeros(1, device="cpu")
    varies = bool((known.nan_to_num() != known.nan_to_num().reshape(-1)[0]).any())
    if varies and not energy.requires_grad:
        raise TypeError(
            f"{name} changes with the motion, but torch cannot differentiate it by {by}: the module detaches "
            "it, or computes it without gradients"
        )
