"""Closed forms and the vectorised rule on torch tensors."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, cast

import numpy as np
import torch
from torch import Tensor
from torch._subclasses.fake_tensor import unset_fake_temporarily
from torch.fx.experimental.proxy_tensor import disable_proxy_modes_tracing

from ..arguments import as_array, as_weights, check_axes, check_dense, no_common_shape, precision
from ..interface import ClosedForms, EnergyForms
from ..parameter_values import fits
from ..rule.joint_tree import Bodies, JointTree
from ..rule.rule_calls import RigidRule
from ..rule.tree_arrays import checked_bodies
from ..structure import Structure
from .array_backend import ArrayBackend
from .array_kernels import Crossing, known_kernel, operations
from .call_module import CallModule

FLOATS = ({torch.float32}, {torch.float64})
CROSSINGS = {
    "decomposition": Crossing(164, ((164, 16), (1016, 256), (3279, 512), (11719, 1024))),
    "torque": Crossing(618, ((618, 256), (1985, 512), (21901, 1024))),
    "position_gradient": Crossing(1217, ((1217, 128), (2044, 256), (4990, 512), (12905, 1024))),
}
"""Where the rule is quicker on a processor, see `array_kernels`; elsewhere it always is."""
MATRICES = 128
"""Links times samples up to which the rule is quicker in spatial matrices than with its samples innermost."""


class TorchBackend(ArrayBackend):
    """Answers with tensors of the caller's dtype and device; gradients flow through motion and parameters."""

    name: ClassVar = "torch"
    takes_tensors: ClassVar = True
    examples = tuple(torch.empty(0, dtype=dtype) for dtype in (torch.float32, torch.float64))
    face: ClassVar[Any] = None
    xp: ClassVar[Any] = torch
    traced: ClassVar[bool] = True
    """Whether torch.jit.trace sees all operations."""

    def __init__(
        self,
        structure: Structure,
        links: Sequence[ClosedForms] | None,
        parameters: Mapping[str, Any],
        rule: RigidRule | None = None,
        kernel: str = "auto",
        bodies: Bodies[Any] | None = None,
        tree: JointTree | None = None,
    ) -> None:
        """`links` are the closed forms, `rule` the vectorised rule: a package has one of them, or both.

        tree: where the frames are, of a back end without the rule

        Raises ValueError for a kernel that cannot be and for bodies of a wrong shape.
        """
        self.structure = structure
        self.links = links or ()
        self.operations = operations(links) if links and rule else {}
        self.rule = rule
        self.tree = tree or (rule.tree if rule else None)
        self.kernel = known_kernel(kernel, links is not None, rule is not None, bodies is not None)
        self.parameters: Any = {
            k: v if torch.is_tensor(v) else torch.as_tensor(v, dtype=torch.float64)
            for k, v in parameters.items()
        }
        self.bodies: Any = None if bodies is None else checked_bodies(bodies, structure.N, _tensor)
        # What torch.compile would trace otherwise: how numbers are summed up, and how tables are made.
        _ = structure.passive_sums
        if self.rule and self.kernel != "straight":
            for like in self.examples:
                self.rule.tables(self, like)

    def arrays(self, named: Mapping[str, Tensor], n: int) -> Sequence[Tensor]:
        """The motion, checked and broadcast to a common shape (..., n); errors name the argument."""
        self.check_untraced()
        check_dense(named)
        given = [value for value in named.values() if torch.is_tensor(value)]
        if len({t.device for t in given}) > 1:
            raise TypeError(f"{', '.join(named)} lie on different devices; move them to one")
        if len(given) < len(named) or {t.dtype for t in given} not in FLOATS:
            named = _tensors(named, given[0].device if given else torch.device("cpu"))
        check_axes(named, n, self.structure.file_joints)
        try:
            return torch.broadcast_tensors(*named.values())  # type: ignore[no-any-return, no-untyped-call]
        except RuntimeError:
            raise no_common_shape(named, n) from None

    def decomposition(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Sequence[Tensor]:
        """c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        p = self._values(q)
        if rule := self._rule("decomposition", q):
            return [*rule.decomposition(self, (q, qd, qdd), p, self._bodies(q)), self.zeros(q, 0)]
        groups: list[list[Tensor]] = [[] for _ in self.structure.sizes]
        for link in self.links:
            # Link by link, so that one link's values lend their memory to the next one's. A link without
            # energy terms linear in the velocities has no h1.
            for group, entries in zip(groups, link.decomposition(torch, q, qd, qdd, p), strict=False):
                group.append(_stacked(q, entries))
        return [self.concatenate(group) if group else self.zeros(q, 0) for group in groups]

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """tau (..., count) in the order of `Layout.torque`."""
        p = self._values(q)
        if rule := self._rule("torque", q):
            tau: Tensor = rule.torque(self, (q, qd, qdd), p, self._bodies(q))
            return tau
        return self.concatenate(_stacked(q, link.torque(torch, q, qd, qdd, p)) for link in self.links)

    def position_gradient(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """c0 (..., count) in the order of `Layout.velocity`."""
        p = self._values(q)
        if rule := self._rule("position_gradient", q):
            c0: Tensor = rule.position_gradient(self, (q, qd, qdd), p, self._bodies(q))
            return c0
        return self.concatenate(
            _stacked(q, link.position_gradient(torch, q, qd, qdd, p)) for link in self.links
        )

    def energies(self, q: Tensor, qd: Tensor) -> tuple[Tensor, Tensor]:
        """Kinetic and potential energies of the links in J, (..., N) each."""
        p = self._values(q)
        if self.rule:
            kinetic, potential = self.rule.energies(self, (q, qd), p, self._bodies(q))
            return kinetic, potential
        links = cast("Sequence[EnergyForms]", self.links)
        both = self.concatenate(_stacked(q, link.energy(torch, q, qd, p)) for link in links)
        return both[..., 0::2], both[..., 1::2]

    def regressor(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """Rows of 10 of tau in the order of `Layout.torque`, flat: (..., 10 count)."""
        assert self.rule is not None  # Answers has seen to it
        rows: Tensor = self.rule.regressor(self, (q, qd, qdd), self._values(q))
        return rows

    def coefficient_regressors(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Sequence[Tensor]:
        """Rows of 10 of c2, c1, g in the order of `Layout`, flat: (..., 10 count) each."""
        assert self.rule is not None  # Answers has seen to it
        return self.rule.coefficient_regressors(self, (q, qd, qdd), self._values(q))

    def check_untraced(self) -> None:
        """Raise TypeError inside torch.jit.trace where it would record only a part, or only the numbers."""
        if not (self.traced or torch.compiler.is_compiling()) and torch._C._is_tracing():
            raise TypeError(
                f"torch.jit.trace does not see how the back end {self.name} computes; "
                "take the back end torch, whose numbers are the same, or torch.export"
            )

    def module(self, robot: Any, call: str, fixed: Mapping[str, Any]) -> CallModule:
        """One call of a robot on this back end as a torch module."""
        return CallModule(robot, call, fixed)

    def constant(self, values: Any, like: Tensor) -> Tensor:
        """A table of numbers, to compute with `like`."""
        return _kept(values, like.dtype, like.device)

    def index(self, values: Any, like: Tensor) -> Tensor:
        """A table of positions, to take from `like`."""
        return _kept(values, torch.long, like.device)

    def weights(self, name: str, value: Any, like: Tensor) -> Tensor:
        """Real numbers in anything array-like, as `like` in dtype and device; errors name the argument."""
        if not torch.compiler.is_dynamo_compiling():  # which knows no dtypes of arrays
            value = as_weights(name, value)
            value = value if torch.is_tensor(value) else np.array(value, dtype=float)
        return torch.as_tensor(value, dtype=like.dtype, device=like.device)

    def zeros(self, like: Tensor, count: int) -> Tensor:
        """Zeros of shape (..., count) for `like` of shape (..., m)."""
        return like.new_zeros((*like.shape[:-1], count))

    def concatenate(self, parts: Iterable[Tensor]) -> Tensor:
        """The parts joined along the last axis."""
        return torch.cat(list(parts), -1)

    @property
    def fuses(self) -> bool:
        """Whether a compiler makes one loop of many operations, to which a matrix product is a wall."""
        return torch.compiler.is_dynamo_compiling()

    def few(self, samples: int, links: int) -> bool:
        """Whether spatial matrices are quicker for so many samples of a robot of so many links."""
        return not _watched() and samples * links <= MATRICES

    def chunk(self, motion: Sequence[Tensor], most: int) -> int | None:
        """Samples to compute at once: all, but on a CPU, with nothing recorded, what stays in its cache."""
        given = (*motion, *self.parameters.values(), *filter(torch.is_tensor, self.bodies or ()))
        if _watched() or motion[0].device.type != "cpu":
            return None
        # An operation of torch costs some four times what one of NumPy costs: it has to do so much more.
        return None if torch.is_grad_enabled() and any(t.requires_grad for t in given) else 4 * most

    def _rule(self, call: str, q: Tensor) -> RigidRule | None:
        """The rule where it is to be taken, None for closed forms."""
        if self.kernel == "auto" and not _watched() and q.device.type == "cpu":
            quicker = CROSSINGS[call].rule_is_quicker(self.operations[call], tuple(q.shape[:-1]))
            return self.rule if quicker else None
        return None if self.kernel == "straight" else self.rule

    def _bodies(self, q: Tensor) -> Bodies[Tensor] | None:
        return (
            None
            if self.bodies is None
            else Bodies(*(torch.as_tensor(a, dtype=q.dtype, device=q.device) for a in self.bodies))
        )

    def _values(self, q: Tensor) -> dict[str, Tensor]:
        for name, value in self.parameters.items():
            if value.ndim:
                fits(name, value.shape, q.shape[:-1])
        return {k: v.to(q) for k, v in self.parameters.items()}


def _kept(values: Any, dtype: torch.dtype, device: torch.device) -> Tensor:
    """A tensor that is kept: a later call may need its gradient, or not be one that torch.export traces."""
    if torch.compiler.is_dynamo_compiling():
        return torch.as_tensor(values, dtype=dtype, device=device)
    with torch.inference_mode(False), disable_proxy_modes_tracing(), unset_fake_temporarily(), _unrecorded():
        # In memory of its own, and side by side: torch.export.save warns of anything else.
        kept = torch.as_tensor(values, dtype=dtype, device=device)
        return kept.clone(memory_format=torch.contiguous_format)


@contextmanager
def _unrecorded() -> Iterator[None]:
    """Let torch.jit.trace not see what is made: it makes a graph twice, and wants the same."""
    tracing: Any = torch._C
    state = tracing._get_tracing_state()
    tracing._set_tracing_state(None)
    try:
        yield
    finally:
        tracing._set_tracing_state(state)


def _watched() -> bool:
    """Whether a compiler or a transformation records operations: it hides how many samples there are."""
    return torch.compiler.is_compiling() or torch._C._are_functorch_transforms_active()


def _tensor(name: str, value: Any) -> Any:
    """A tensor as it is, anything else that reads as an array."""
    return value if torch.is_tensor(value) else as_array(name, value)


def _tensors(named: Mapping[str, Any], device: torch.device) -> dict[str, Tensor]:
    """Motion of any kind as tensors of one dtype; arrays are copied, as a gradient may need them later."""
    read = {k: value if torch.is_tensor(value) else as_array(k, value) for k, value in named.items()}
    kind = precision(named, read)
    dtype = torch.float32 if kind == "float32" else torch.float64
    return {
        k: a.to(dtype)
        if torch.is_tensor(a)
        else torch.from_numpy(np.array(a, dtype=kind, order="C")).to(device)
        for k, a in read.items()
    }


def _stacked(q: Tensor, entries: Sequence[Any]) -> Tensor:
    """Entries, numbers or tensors that broadcast to the batch of q (..., n), as one tensor (..., count)."""
    shape, like = q.shape[:-1], q[..., 0]
    columns = [
        v.to(q.dtype).expand(shape) if torch.is_tensor(v) else torch.full_like(like, v) for v in entries
    ]
    return torch.stack(columns, -1)
