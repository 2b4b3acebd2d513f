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
from .energy_interface import Energies, Parameters, numbers_of, transformed
from .functional_sweeps import (
    decomposition_functional,
    energies,
    position_gradient_functional,
    torque_functional,
)
from .graph_calls import graph_of, graph_parts_of
from .sweeps import decomposition, position_gradient, torque

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
        sources: dict[int, torch.nn.Module] = {id(self.given): self.given}
        for link in self.modules:
            at: Energies | None = link
            while at is not None and id(at) not in sources:
                sources[id(at)] = cast(torch.nn.Module, at)
                at = at.before
        return numbers_of(tuple(sources.values()))

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
        parts: Sequence[Tensor] = self._of_links((decomposition, decomposition_functional), q, qd, qdd)
        return parts

    def torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return tau (..., count) in the order of `Layout.torque`."""
        tau: Tensor = self._of_links((torque, torque_functional), q, qd, qdd)
        return tau

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return c0 (..., count) in the order of `Layout.velocity`."""
        c0: Tensor = self._of_links((position_gradient, position_gradient_functional), q, qd, qdd)
        return c0

    def energies(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return the kinetic and potential energies of the links in J, (..., N) each."""
        at = cast(Tensor, q)
        kinetic, potential = energies(tuple(self.modules), at, cast(Tensor, qd), self.seen_by(at))
        return kinetic.movedim(0, -1), potential.movedim(0, -1)

    def graph(self, *asked: Any) -> Any:
        """Return the graph of a torque, see `Dynamics.graph`."""
        return graph_of(self, *asked)

    def graph_parts(self, *asked: Any) -> Any:
        """Return the graphs of a torque's parts, see `Dynamics.graph_parts`."""
        return graph_parts_of(self, *asked)

    def _of_links(self, calls: tuple[Call, Call], *motion: Numbers) -> Any:
        """Return the result of a function of sweeps.py, or of its counterpart inside a transformation."""
        links, (sweep, followed) = tuple(self.modules), calls
        q, qd, qdd = cast("tuple[Tensor, Tensor, Tensor]", motion)
        if torch.compiler.is_exporting():
            # Export records sweeps as they run, for any number of samples, but no nested torch.func.
            return sweep(links, self.seen_by(q), q, qd, qdd)
        if transformed():
            return followed(links, self.seen_by(q), q, qd, qdd)
        if torch.is_inference_mode_enabled():
            # Nothing can be differentiated in that mode, and the answer would be zeros.
            with torch.inference_mode(False), torch.no_grad():
                return self._of_links(calls, q.clone(), qd.clone(), qdd.clone())
        p, most = self.seen_by(q), max(1, AT_A_TIME // self.structure.sizes.tau)
        if q[..., 0].numel() <= most:
            return sweep(links, p, q, qd, qdd)
        return _in_pieces(lambda some, *motion: sweep(links, some, *motion), p, (q, qd, qdd), most)


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
