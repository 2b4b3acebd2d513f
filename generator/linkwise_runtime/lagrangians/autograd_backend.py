"""Lagrangians differentiated by torch."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, ClassVar

import torch
from torch import Tensor

from ..arrays.run_time_values import RunTimeValues
from ..arrays.torch_backend import TorchBackend
from ..rule.joint_tree import JointTree
from ..rule.tree_arrays import TreeArrays
from ..structure import Structure
from ..sums.sum_answers import SumAnswers
from .energy_interface import Energies, Parameters, numbers_of
from .functional_sweeps import decomposition_followed, energies, position_gradient_followed, torque_followed
from .graph_calls import graph_of, graph_parts_of
from .recording import transformed
from .sweeps import decomposition, position_gradient, torque

Call = Callable[..., Any]

AT_A_TIME = 1 << 16
"""Samples times lanes in one sweep, so that memory does not grow with the batch."""


class AutogradBackend(TorchBackend):
    """Partial torques and coefficients by differentiating each link's Lagrangian.

    modules: of the links, in the order of j; given: the run-time parameters, which these share
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
        self.parameters: Any = given

    def answers(self, check_finite: bool) -> SumAnswers:
        """The calls of `Dynamics`."""
        return _Answers(self.structure, self, check_finite)

    def numbers(self) -> Iterable[Tensor]:
        """All tensors that the energies hang on, beside the motion."""
        sources: dict[int, Any] = {id(self.given): self.given}
        for link in self.modules:
            at: Any = link
            while at is not None and id(at) not in sources:
                sources[id(at)] = at
                at = at.before
        return numbers_of(tuple(sources.values()))

    def seen_by(self, q: Tensor) -> Parameters:
        """Parameters and constants as a call computes with them."""
        wanted = torch.is_grad_enabled() and any(t.requires_grad for t in self.numbers())
        return Parameters(self._values(q), q[..., 0], wanted)

    def tree_numbers(self, own: tuple[TreeArrays, Any], q: Tensor) -> TreeArrays:
        """The tree's numbers, those in place of its own that the modules of the links have."""
        numbers = super().tree_numbers(own, q)
        translations, masses, centres = (list(a.unbind(-2)) for a in numbers[1:4])
        for j, link in enumerate(self.modules):
            held: Any = link
            for joint, name in held.places.items():
                translations[joint] = getattr(held, name).to(q)[:, None]
            if "mass" in held.constants:
                masses[j] = held.mass.to(q)[None]
            if "com" in held.constants:
                centres[j] = held.com.to(q)[:, None]
        found = (_side_by_side(rows) for rows in (translations, masses, centres))
        return numbers._replace(**dict(zip(("translations", "masses", "centres"), found, strict=True)))

    def decomposition(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Sequence[Tensor]:
        """c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        parts: Sequence[Tensor] = self._of_links((decomposition, decomposition_followed), q, qd, qdd)
        return parts

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """tau (..., count) in the order of `Layout.torque`."""
        tau: Tensor = self._of_links((torque, torque_followed), q, qd, qdd)
        return tau

    def position_gradient(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """c0 (..., count) in the order of `Layout.velocity`."""
        c0: Tensor = self._of_links((position_gradient, position_gradient_followed), q, qd, qdd)
        return c0

    def energies(self, q: Tensor, qd: Tensor) -> tuple[Tensor, Tensor]:
        """Kinetic and potential energies of the links in J, (..., N) each."""
        kinetic, potential = energies(tuple(self.modules), q, qd, self.seen_by(q))
        return kinetic.movedim(0, -1), potential.movedim(0, -1)

    def graph(self, *asked: Any) -> Any:
        """See `Dynamics.graph`."""
        return graph_of(self, *asked)

    def graph_parts(self, *asked: Any) -> Any:
        """See `Dynamics.graph_parts`."""
        return graph_parts_of(self, *asked)

    def _of_links(self, calls: tuple[Call, Call], q: Tensor, qd: Tensor, qdd: Tensor) -> Any:
        """What a function of sweeps.py makes of the Lagrangians, or its like where the call is followed."""
        links, (sweep, followed) = tuple(self.modules), calls
        if torch.compiler.is_exporting():
            # It records sweeps as they run, for any number of samples, but no torch.func within another.
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
    """Tensors (..., samples) as one of shape (..., rows, samples); of one sample is what all share."""
    samples = max(row.shape[-1] for row in rows)
    return torch.stack([row.expand(*row.shape[:-1], samples) for row in rows], -2)


def _in_pieces(call: Callable[..., Any], p: Parameters, motion: Sequence[Tensor], most: int) -> Any:
    """What `call` makes of all samples, so many at a time."""
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


class _Answers(SumAnswers):
    """Calls that refuse `out` also where a constant of a link is learned."""

    def read_beside_motion(self) -> Iterable[Any]:
        """Tensors that results hang on, beside the motion."""
        backend: Any = self._backend
        tensors: Iterable[Any] = backend.numbers()
        return tensors
