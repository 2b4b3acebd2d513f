"""The back end that differentiates Lagrangians by torch."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, cast

import torch
from torch import Tensor

from ..arrays.torch_backend import TorchBackend
from ..arrays.torch_modules import RunTimeValues
from ..interface import Numbers
from ..rule.joint_tree import JointTree
from ..rule.tree_arrays import TreeArrays
from ..structure import Structure
from . import functional_sweeps, sweeps, written_sweeps
from .energy_interface import Energies, Parameters, numbers_of, transformed
from .graph_calls import graph_of, graph_parts_of

Call = Callable[..., Any]

AT_A_TIME = 1 << 16
"""Samples times lanes in one sweep, so that memory does not grow with the batch."""


class AutogradBackend(TorchBackend):
    """Back end that gets partial torques and coefficients by differentiating each link's Lagrangian.

    modules: modules of the links, in the order of j
    given: the run-time parameters, which the modules share
    """

    name: ClassVar = "autograd"
    traced: ClassVar = False

    def __init__(
        self,
        structure: Structure,
        modules: Iterable[Energies],
        given: RunTimeValues,
        tree: JointTree | None = None,
    ) -> None:
        super().__init__(structure, (), {}, tree=tree)
        self.modules, self.given = modules, given
        self.parameters = cast("Mapping[str, Any]", given)

    def read_beside_motion(self) -> Iterable[Tensor]:
        """Return all tensors, besides the motion, that the energies depend on: constants of links too."""
        sources: dict[int, torch.nn.Module] = {}
        for link in self.modules:
            at: Energies | None = link
            while at is not None and id(at) not in sources:
                sources[id(at)] = cast(torch.nn.Module, at)
                at = at.before
        return *self.parameters.values(), *numbers_of(tuple(sources.values()))

    def seen_by(self, q: Tensor) -> Parameters:
        """Return the parameters and constants as a call computes with them."""
        wanted = torch.is_grad_enabled() and any(t.requires_grad for t in self.read_beside_motion())
        return Parameters(self._values(q), q[..., 0], wanted)

    def tree_numbers(self, own: tuple[TreeArrays, Numbers], q: Numbers) -> TreeArrays:
        """Return the tree's numbers, with those that the links' modules hold in place of its own."""
        numbers = super().tree_numbers(own, q)
        translations, masses, centres = (list(cast(Tensor, a).unbind(-2)) for a in numbers[1:4])
        like = cast(Tensor, q)
        for j, link in enumerate(self.modules):
            held: Any = link
            for joint, name in held.places.items():
                translations[joint] = getattr(held, name).to(like)[:, None]
            if "mass" in held.constants:
                masses[j] = held.mass.to(like)[None]
            if "com" in held.constants:
                centres[j] = held.com.to(like)[:, None]
        found = (_side_by_side(rows) for rows in (translations, masses, centres))
        return numbers._replace(**dict(zip(("translations", "masses", "centres"), found, strict=True)))

    def decomposition(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        self._check_quadratic(cast(Tensor, q), cast(Tensor, qd))
        parts: Sequence[Tensor] = self._of_links("decomposition", q, qd, qdd)
        return parts

    def torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return tau (..., count) in the order of `Layout.torque`."""
        tau: Tensor = self._of_links("torque", q, qd, qdd)
        return tau

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return c0 (..., count) in the order of `Layout.velocity`."""
        c0: Tensor = self._of_links("position_gradient", q, qd, qdd)
        return c0

    def energies(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return the kinetic and potential energies of the links in J, (..., N) each."""
        at, rate = cast(Tensor, q), cast(Tensor, qd)
        if self.structure.shares:
            kinetic, potential, _ = self._of_links("energies", at, rate).tensor_split(3, -1)
            return kinetic, potential
        kinetic, potential = functional_sweeps.energies(tuple(self.modules), at, rate, self.seen_by(at))
        return kinetic.movedim(0, -1), potential.movedim(0, -1)

    def power_beside(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return R_j, the power that links written by hand get otherwise than from joints, in W, (..., N)."""
        power: Tensor = self._of_links("energies", q, qd).tensor_split(3, -1)[2]
        return power

    def named_shares(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return shares of links written by hand, (..., count), in the order of `Structure.share_rows`."""
        shares: Tensor = self._of_links("named_shares", q, qd)
        return shares

    def graph(self, *asked: Any) -> Any:
        """Return the graph of a torque, see `Dynamics.graph`."""
        return graph_of(self, *asked)

    def graph_parts(self, *asked: Any) -> Any:
        """Return the graphs of a torque's parts, see `Dynamics.graph_parts`."""
        return graph_parts_of(self, *asked)

    def _check_quadratic(self, q: Tensor, qd: Tensor) -> None:
        if transformed() or torch.compiler.is_compiling() or q.device.type == "meta" or not q.numel():
            return  # nobody may look at numbers, or there are none
        for link in self.modules:
            link.check_quadratic(q, qd, self.seen_by)

    def _of_links(self, call: str, *motion: Numbers) -> Any:
        """Return the result of a function of sweeps.py, or of its counterpart inside a transformation.

        Links that were written by hand have functions of their own, for both.
        """
        links, (q, *rates) = tuple(self.modules), cast("tuple[Tensor, ...]", motion)
        written, exported = bool(self.structure.shares), torch.compiler.is_exporting()
        sweep: Call = getattr(written_sweeps if written else sweeps, call)
        if exported:
            # Export records sweeps as they run, for any number of samples, but no nested torch.func.
            return sweep(links, self.seen_by(q), q, *rates)
        if transformed():
            followed: Call = sweep if written else getattr(functional_sweeps, f"{call}_functional")
            return followed(links, self.seen_by(q), q, *rates)
        if torch.is_inference_mode_enabled():
            # Nothing can be differentiated in that mode, and the answer would be zeros.
            with torch.inference_mode(False), torch.no_grad():
                return self._of_links(call, *(a.clone() for a in (q, *rates)))
        sweep = _recorded(sweep) if written else sweep
        p, most = self.seen_by(q), max(1, AT_A_TIME // self.structure.sizes.tau)
        if q[..., 0].numel() <= most:
            return sweep(links, p, q, *rates)
        return _in_pieces(lambda some, *motion: sweep(links, some, *motion), p, (q, *rates), most)


def _recorded(sweep: Call) -> Call:
    """Return a function that differentiates whatever grad mode its caller is in."""

    def call(links: Any, p: Parameters, q: Tensor, *rates: Tensor) -> Any:
        wanted = p.wanted or (torch.is_grad_enabled() and any(t.requires_grad for t in (q, *rates)))
        with torch.enable_grad():
            found = sweep(links, p, q, *rates)
        if wanted:
            return found
        return found.detach() if torch.is_tensor(found) else [part.detach() for part in found]

    return call


def _side_by_side(rows: Sequence[Tensor]) -> Tensor:
    """Stack tensors (..., samples) to (..., rows, samples); a tensor of one sample counts for all samples."""
    samples = max(row.shape[-1] for row in rows)
    return torch.stack([row.expand(*row.shape[:-1], samples) for row in rows], -2)


def _in_pieces(call: Callable[..., Any], p: Parameters, motion: Sequence[Tensor], most: int) -> Any:
    """Return the results of `call` for all samples, computed for at most `most` samples at a time."""
    batch = motion[0].shape[:-1]
    flat = [a.reshape(-1, a.shape[-1]) for a in motion]
    values = {name: v.expand(batch).reshape(-1) if v.dim() else v for name, v in p.items()}
    parts = []
    for at in range(0, len(flat[0]), most):
        own = [a[at : at + most] for a in flat]
        some = {name: v[at : at + most] if v.dim() else v for name, v in values.items()}
        parts.append(call(Parameters(some, own[0][..., 0], p.wanted), *own))
    if torch.is_tensor(parts[0]):
        return torch.cat(parts).reshape(*batch, -1)
    return [torch.cat(part).reshape(*batch, part[0].shape[-1]) for part in zip(*parts, strict=True)]
