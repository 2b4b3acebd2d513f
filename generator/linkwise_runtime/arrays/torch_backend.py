"""Closed forms and the vectorised rule on torch tensors."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, cast

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor
from torch._subclasses.fake_tensor import unset_fake_temporarily
from torch.fx.experimental.proxy_tensor import disable_proxy_modes_tracing

from ..answers.packed import packed_joint_sums, packed_sums, packed_table
from ..arguments import (
    NOTHING,
    Beside,
    as_array,
    as_given,
    as_weights,
    check_axes,
    check_dense,
    no_common_shape,
    precision,
    samples_of,
)
from ..interface import ClosedForms, EnergyForms, Entries, Namespace, Numbers
from ..kinematics.frame_answers import make_frame_tables
from ..parameter_values import fits
from ..rule.calls import RigidRule, kept_rule_tables
from ..rule.joint_tree import Bodies, JointTree
from ..structure import Structure
from .backend import ArrayBackend, Crossing
from .torch_modules import CallModule, ReloadableRobot

for makes_tables in (packed_table, packed_joint_sums, packed_sums, kept_rule_tables, make_frame_tables):
    torch.compiler.assume_constant_result(makes_tables)  # type: ignore[no-untyped-call, unused-ignore]
KINDS = {"float32": torch.float32, "float64": torch.float64}
FLOATS = ({torch.float32}, {torch.float64})
CROSSINGS = {
    "decomposition": Crossing(164, ((164, 16), (1016, 256), (3279, 512), (11719, 1024))),
    "torque": Crossing(618, ((618, 256), (1985, 512), (21901, 1024))),
    "position_gradient": Crossing(1217, ((1217, 128), (2044, 256), (4990, 512), (12905, 1024))),
}
"""Limits up to which the rule is faster on a processor, see `Crossing`; elsewhere it always is."""
MATRICES = 128
"""Links times samples up to which the rule is faster in spatial matrices than with samples innermost."""


class TorchBackend(ArrayBackend):
    """Back end that answers with tensors of the caller's dtype and device.

    Gradients flow through motion and parameters.
    """

    name: ClassVar = "torch"
    takes_tensors: ClassVar = True
    examples: Sequence[Numbers] = tuple(
        torch.empty(0, dtype=dtype) for dtype in (torch.float32, torch.float64)
    )
    xp: ClassVar[Namespace] = cast(Namespace, torch)
    traced: ClassVar[bool] = True
    """True if torch.jit.trace sees all operations."""
    parameters: Mapping[str, Tensor]

    def __init__(
        self,
        structure: Structure,
        links: Sequence[ClosedForms] | None,
        parameters: Mapping[str, object],
        rule: RigidRule | None = None,
        kernel: str = "auto",
        bodies: object = None,
        tree: JointTree | None = None,
    ) -> None:
        """Set up the back end; raise ValueError for an impossible kernel and for bodies of a wrong shape."""
        super().__init__(structure, links, rule, kernel, bodies, _tensor, tree)
        self.parameters = {
            k: v if torch.is_tensor(v) else torch.as_tensor(v, dtype=torch.float64)
            for k, v in parameters.items()
        }
        # Otherwise torch.compile would trace how numbers are summed up, and how tables are made: it cannot
        # follow the lock of a cached property, which Python 3.11 has.
        _ = structure.n, structure.N, structure.layout, structure.sizes, structure.passive_sums
        _ = structure.share_names, self.answers.shapes
        if self.tree:
            _ = self.frames, self.wrenches
        if self.rule and self.kernel != "straight":
            for like in self.examples:
                self.rule.tables(self, like)

    def arrays(
        self, named: Mapping[str, object], n: int, beside: Mapping[str, Beside] = NOTHING
    ) -> Sequence[Numbers]:
        """Return the motion (..., n), then what is beside it, checked and in one shape of samples."""
        self.check_untraced()
        given = as_given(named, beside)
        check_dense(given)
        # By its type: a compiler takes an array for a tensor, whose device is none of torch's.
        tensors = [value for value in given.values() if isinstance(value, Tensor)]
        if len({t.device for t in tensors}) > 1:
            raise TypeError(f"{', '.join(given)} lie on different devices; move them to one")
        read = cast("Mapping[str, Tensor]", given)
        if len(tensors) < len(given) or {t.dtype for t in tensors} not in FLOATS:
            read = _tensors(given)
        check_axes(read, n, self.structure.file_joints, beside)
        batches = [samples_of(name, a, beside) for name, a in read.items()]
        try:
            batch = torch.broadcast_shapes(*batches)  # type: ignore[no-untyped-call]
        except RuntimeError:
            raise no_common_shape(read, n, beside) from None
        return [
            a if own == batch else a.expand(*batch, *a.shape[len(own) :])
            for a, own in zip(read.values(), batches, strict=True)
        ]

    def decomposition(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2, c1, g, tau and h1, each (..., count) in the order of `Layout`."""
        p = self._values(q)
        if rule := self._rule("decomposition", q):
            return [*rule.decomposition(self, (q, qd, qdd), p, self._bodies(q)), self.zeros(q, 0)]
        groups: list[list[Numbers]] = [[] for _ in self.structure.sizes]
        for link in self.links:
            # Link by link, so that the memory of one link's values is used for the next's. A link of what is
            # quadratic in the velocities has no h1.
            for group, entries in zip(groups, link.decomposition(torch, q, qd, qdd, p), strict=False):
                group.append(_stacked(q, entries))
        return [self.concatenate(group) if group else self.zeros(q, 0) for group in groups]

    def torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return tau (..., count), in the order of `Layout.torque`."""
        p = self._values(q)
        if rule := self._rule("torque", q):
            return rule.torque(self, (q, qd, qdd), p, self._bodies(q))
        return self.concatenate(_stacked(q, link.torque(torch, q, qd, qdd, p)) for link in self.links)

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return c0 (..., count), in the order of `Layout.velocity`."""
        p = self._values(q)
        if rule := self._rule("position_gradient", q):
            return rule.position_gradient(self, (q, qd, qdd), p, self._bodies(q))
        return self.concatenate(
            _stacked(q, link.position_gradient(torch, q, qd, qdd, p)) for link in self.links
        )

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Give run-time parameters of a separate copy these values."""
        tensors = {name: torch.as_tensor(value, dtype=torch.float64) for name, value in values.items()}
        cast("dict[str, Tensor]", self.parameters).update(tensors)

    def named_shares(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return shares of links written by hand, (..., count), in the order of `Structure.share_rows`."""
        p, links = self._values(q), cast("Sequence[EnergyForms]", self.links)
        entries = [value for link in links for value in link.named_shares(torch, q, qd, p)]
        return _stacked(q, tuple(entries)) if entries else self.zeros(q, 0)

    def evaluated(
        self, function: Callable[..., Sequence[object]], motion: Sequence[Numbers], count: int
    ) -> Numbers:
        """Return what a closed form returns of namespace, motion (..., n) and parameters, (..., count)."""
        return _stacked(motion[0], tuple(function(torch, *motion, self._values(motion[0]))))

    def _energy_columns(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return K, P and R of the links, one after the other, (..., 3 N)."""
        p, links = self._values(q), cast("Sequence[EnergyForms]", self.links)
        return self.concatenate(_stacked(q, link.energy(torch, q, qd, p)) for link in links)

    def regressor(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return the rows of 10 of tau in the order of `Layout.torque`, flat: (..., 10 count)."""
        assert self.rule is not None  # Answers has checked it
        return self.rule.regressor(self, (q, qd, qdd), self._values(q))

    def coefficient_regressors(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return the rows of 10 of c2, c1 and g in the order of `Layout`, flat: (..., 10 count) each."""
        assert self.rule is not None  # Answers has checked it
        return self.rule.coefficient_regressors(self, (q, qd, qdd), self._values(q))

    def check_untraced(self) -> None:
        """Raise TypeError inside torch.jit.trace where it would record only a part, or only the numbers."""
        if not (self.traced or torch.compiler.is_compiling()) and torch._C._is_tracing():
            raise TypeError(
                f"torch.jit.trace does not see how the back end {self.name} computes; "
                "take the back end torch, whose numbers are the same, or torch.export"
            )

    def module(self, robot: object, call: str, fixed: Mapping[str, object]) -> CallModule:
        """Return one call of a robot on this back end as a torch module."""
        return CallModule(cast(ReloadableRobot, robot), call, fixed)

    def constant(self, values: ArrayLike, like: Numbers) -> Numbers:
        """Return a table of numbers, to compute with `like`."""
        tensor = cast(Tensor, like)
        return _kept(values, tensor.dtype, tensor.device)

    def index(self, values: ArrayLike, like: Numbers) -> Numbers:
        """Return a table of positions, to index `like` with."""
        return _kept(values, torch.long, cast(Tensor, like).device)

    def weights(self, name: str, value: object, like: Numbers) -> Numbers:
        """Return real numbers, from anything array-like, with the dtype and device of `like`.

        Errors name the argument.
        """
        if not torch.compiler.is_dynamo_compiling():  # which knows no dtypes of arrays
            value = as_weights(name, value)
            value = value if torch.is_tensor(value) else np.array(value, dtype=float)
        tensor = cast(Tensor, like)
        return torch.as_tensor(value, dtype=tensor.dtype, device=tensor.device)

    def zeros(self, like: Numbers, count: int) -> Numbers:
        """Return zeros of shape (..., count) for `like` of shape (..., m)."""
        return cast(Tensor, like).new_zeros((*like.shape[:-1], count))

    def concatenate(self, parts: Iterable[Numbers]) -> Numbers:
        """Return the parts joined along the last axis."""
        return torch.cat(cast("list[Tensor]", list(parts)), -1)

    @property
    def fuses(self) -> bool:
        """True if a compiler makes one loop of many operations, which a matrix product would split."""
        return torch.compiler.is_dynamo_compiling()

    def few(self, samples: int, links: int) -> bool:
        """Return whether spatial matrices are faster for so many samples of a robot of so many links."""
        return not _watched() and samples * links <= MATRICES

    def chunk(self, motion: Sequence[Numbers], most: int) -> int | None:
        """Return the number of samples to compute at once; None for all.

        On a CPU, with nothing recorded, these are as many as stay in its cache.
        """
        tensors = cast("Sequence[Tensor]", motion)
        given = (*tensors, *self.parameters.values(), *filter(torch.is_tensor, self.bodies or ()))
        if _watched() or tensors[0].device.type != "cpu":
            return None
        # An operation of torch costs some four times what one of NumPy costs, so each has to do more.
        return None if torch.is_grad_enabled() and any(t.requires_grad for t in given) else 4 * most

    def _rule(self, call: str, q: Numbers) -> RigidRule | None:
        """Return the rule where it is to be used, None for closed forms."""
        if self.kernel == "auto" and not _watched() and cast(Tensor, q).device.type == "cpu":
            quicker = CROSSINGS[call].rule_is_quicker(self.operations[call], tuple(q.shape[:-1]))
            return self.rule if quicker else None
        return None if self.kernel == "straight" else self.rule

    def _bodies(self, q: Numbers) -> Bodies[Tensor] | None:
        if self.bodies is None:
            return None
        like = cast(Tensor, q)
        return Bodies(*(torch.as_tensor(a, dtype=like.dtype, device=like.device) for a in self.bodies))

    def _values(self, q: Numbers) -> Mapping[str, Tensor]:
        for name, value in self.parameters.items():
            if value.ndim:
                fits(name, value.shape, q.shape[:-1])
        return {k: v.to(cast(Tensor, q)) for k, v in self.parameters.items()}


def _kept(values: ArrayLike, dtype: torch.dtype, device: torch.device) -> Tensor:
    """Return a tensor that is kept: later calls may need its gradient, or not be traced by torch.export."""
    if torch.compiler.is_dynamo_compiling():
        return torch.as_tensor(values, dtype=dtype, device=device)
    with torch.inference_mode(False), disable_proxy_modes_tracing(), unset_fake_temporarily(), _unrecorded():
        # In memory of its own, and contiguous: torch.export.save warns of anything else.
        kept = torch.as_tensor(values, dtype=dtype, device=device)
        return kept.clone(memory_format=torch.contiguous_format)


@contextmanager
def _unrecorded() -> Iterator[None]:
    """Hide from torch.jit.trace what is made inside: it makes a graph twice, and expects the same."""
    tracing: Any = torch._C
    state = tracing._get_tracing_state()
    tracing._set_tracing_state(None)
    try:
        yield
    finally:
        tracing._set_tracing_state(state)


def _watched() -> bool:
    """Return whether a compiler or a transformation records operations, which hides the number of samples."""
    return torch.compiler.is_compiling() or torch._C._are_functorch_transforms_active()


def _tensor(name: str, value: object) -> Numbers:
    """Return a tensor as it is, anything else that reads as an array as an array."""
    return value if torch.is_tensor(value) else as_array(name, value)


def _tensors(named: Mapping[str, object]) -> dict[str, Tensor]:
    """Return numbers of any kind as tensors of one dtype; arrays are copied: a gradient may need them."""
    own = {k: value for k, value in named.items() if isinstance(value, Tensor)}
    device = next(iter(own.values())).device if own else torch.device("cpu")
    if own and torch.compiler.is_dynamo_compiling():  # which knows no dtypes of arrays
        own |= {k: torch.as_tensor(a) for k, a in named.items() if isinstance(a, np.ndarray)}
        dtype = KINDS[precision(own, own)]
        return {k: torch.as_tensor(value, dtype=dtype, device=device) for k, value in named.items()}
    read = {k: own[k] if k in own else as_array(k, value) for k, value in named.items()}
    kind = precision(named, read)
    return {
        k: a.to(KINDS[kind])
        if torch.is_tensor(a)
        else torch.from_numpy(np.array(a, dtype=kind, order="C")).to(device)
        for k, a in read.items()
    }


def _stacked(q: Numbers, entries: Entries) -> Numbers:
    """Return entries as one tensor (..., count).

    entries: numbers, or tensors that broadcast to the batch of q (..., n)
    """
    dtype, shape, like = cast(Tensor, q).dtype, q.shape[:-1], cast(Tensor, q)[..., 0]
    columns = [v.to(dtype).expand(shape) if torch.is_tensor(v) else torch.full_like(like, v) for v in entries]
    return torch.stack(columns, -1)
