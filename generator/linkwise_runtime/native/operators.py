"""Compiled C as torch operators, with gradients.

The forward pass runs the C code; the backward pass differentiates the closed forms, or the rule, in torch.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import cached_property
from typing import ClassVar, Protocol, cast

import torch
from torch import Tensor
from torch._subclasses.fake_tensor import is_fake

from ..answers.answers import Answers
from ..arguments import NOTHING, Beside, too_many_axes
from ..arrays.torch_backend import TorchBackend
from ..call_table import CALLS, QDD
from ..interface import ClosedForms, Numbers
from ..kinematics.link_wrenches import CauseWrenches
from ..rule.calls import RigidRule
from .build import Sources
from .calls import FUNCTIONS, LINK_WRENCHES, NativeCalls
from .compiled_calls import QuickCalls
from .memory import NumberArray

FLOATS = (torch.float64, torch.float32)

Run = Callable[[str, Sequence[NumberArray], Sequence[NumberArray] | None], Sequence[NumberArray]]
"""Function that answers a call by name, given the motion, and where results go, or None."""

OPERATED = {
    "decomposition": "packed",
    "torque": "packed_torque",
    "position_gradient": "packed_position_gradient",
}
"""Torch operators, of which all answers are composed, and the names of their calls in `NativeCalls`."""

Results = Tensor | tuple[Tensor, ...]
"""Results of an operator: one tensor by itself, or several."""
Operator = Callable[[Tensor, Tensor, Tensor, Tensor, int], Results]
"""Operator on q, qd, qdd, parameters and threads."""
Inputs = tuple[Tensor, Tensor, Tensor, Tensor]
"""Inputs that an operator has gradients for: q, qd, qdd and the parameters."""
Again = Callable[[Tensor, Tensor, Tensor, Tensor], Sequence[Tensor]]
"""Function that computes an operator's results once more in torch."""

OPERATORS: dict[tuple[Sources, str], Operator] = {}
"""Operators made so far; torch needs each to be defined only once."""


class Context(Protocol):
    """Values that torch keeps from a forward pass for the backward pass."""

    saved_tensors: Inputs
    needs_input_grad: Sequence[bool]

    def save_for_backward(self, *tensors: Tensor) -> None:
        """Keep these as `saved_tensors`."""


class TorchSide(TorchBackend):
    """The native back end's calls with tensors."""

    name: ClassVar = "native"
    traced: ClassVar = False

    def __init__(
        self, calls: NativeCalls, run: Run, links: Sequence[ClosedForms] | None, rule: RigidRule | None
    ) -> None:
        """Define the operators; `run` answers calls with arrays by C."""
        super().__init__(calls.structure, links, calls.parameters, rule)
        self.calls, self.run = calls, run
        self._given = [value for value in calls.parameters.values() if torch.is_tensor(value)]
        self.operators = {call: operator(calls, links, rule, call) for call in OPERATED}

    def separate(self) -> TorchBackend:
        """Return a copy whose parameters may be set."""
        made = cast(TorchSide, super().separate())
        made.calls = self.calls.separate()
        made.run = QuickCalls(made.calls).run
        return made

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Give run-time parameters of a separate copy these values, one number each."""
        super().set_parameters(values)
        self.calls.parameters.update(cast("Mapping[str, float | Numbers]", values))

    @cached_property
    def answers(self) -> Answers:
        """Answers to the calls of the call table: by C where it has the call and nothing is recorded."""
        return TensorAnswers(self)

    def arrays(
        self, named: Mapping[str, object], n: int, beside: Mapping[str, Beside] = NOTHING
    ) -> Sequence[Numbers]:
        """Return the motion, then the other arguments, in one shape of samples.

        Raises TypeError for tensors that are not in the CPU's memory, and inside torch.func or forward-mode
        differentiation.
        """
        self.check_untraced()
        motion = cast("list[Tensor]", list(named.values()))
        q = motion[0]
        plain = all(
            type(t) is Tensor and t.is_cpu and t.layout is torch.strided and not t.is_nested for t in motion
        )
        alike = plain and not beside and q.dtype in FLOATS and q.shape[-1:] == (n,)
        if not alike or not all(t.dtype == q.dtype and t.shape == q.shape for t in motion[1:]):
            motion = cast("list[Tensor]", list(super().arrays(named, n, beside)))
            if not motion[0].is_cpu:
                raise TypeError(
                    f"the tensors lie on {motion[0].device}; this back end takes CPU tensors, torch takes all"
                )
        if _transformed(motion):
            raise TypeError(
                "this back end does not run inside torch.func or forward-mode differentiation; take torch"
            )
        return motion

    def decomposition(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        return list(self._run("decomposition", q, qd, qdd))

    def torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return tau (..., count) in the order of `Layout.torque`."""
        return self._run("torque", q, qd, qdd)[0]

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return c0 (..., count) in the order of `Layout.velocity`."""
        return self._run("position_gradient", q, qd, qdd)[0]

    def link_wrenches(self, q: Numbers, qd: Numbers) -> CauseWrenches:
        """Return the wrenches of links by cause, (..., N, X, 6), by C where torch need not record them."""
        motion = cast("tuple[Tensor, Tensor]", (q, qd))
        if self.ties_joints or self.needs_operators(motion):
            return super().link_wrenches(q, qd)
        return self.wrenches.of_packed(q, compute(self.run, LINK_WRENCHES, motion))

    def _run(self, call: str, *motion: Numbers) -> tuple[Tensor, ...]:
        q, qd, qdd = cast("tuple[Tensor, Tensor, Tensor]", motion)
        if not self.needs_operators((q, qd, qdd)):
            return compute(self.run, OPERATED[call], (q, qd, qdd))
        names = self.structure.parameters
        values = [self.parameters[name].to(q).reshape(()) for name in names]
        p = torch.stack(values) if values else q.new_empty(0)
        operated = self.operators[call](q, qd, qdd, p, self.calls.threads)
        return operated if isinstance(operated, tuple) else (operated,)

    def needs_operators(self, motion: Sequence[Tensor]) -> bool:
        """Return whether torch has to record the computation: for a gradient, or while it compiles."""
        if torch.compiler.is_compiling():
            return True
        return torch.is_grad_enabled() and any(t.requires_grad for t in (*motion, *self._given))


class TensorAnswers(Answers):
    """Answers to the calls that C has, where torch need not record the computation."""

    contiguous = True

    def __init__(self, side: TorchSide) -> None:
        super().__init__(side)
        self._side = side

    def compute_into(self, call: str, motion: Sequence[Numbers], into: Sequence[Numbers]) -> None:
        """Compute a call's results and write them to the tensors `into`."""
        tensors = cast("Sequence[Tensor]", motion)
        if call in FUNCTIONS and not self._side.needs_operators(tensors):
            compute(self._side.run, call, tensors, cast("Sequence[Tensor]", into))
        else:
            super().compute_into(call, motion, into)


def _of_c(key: str) -> Callable[..., Sequence[Numbers]]:
    """Return a method that answers the call `key` by the compiled C where torch need not record it."""
    composed = getattr(Answers, key)

    def row(self: TensorAnswers, *motion: Tensor) -> Sequence[Numbers]:
        if self._side.needs_operators(motion):
            found: Sequence[Numbers] = composed(self, *motion)
            return found
        return compute(self._side.run, key, motion)

    return row


for _name in FUNCTIONS.keys() & CALLS.keys():
    setattr(TensorAnswers, _name, _of_c(_name))


def compute(
    run: Run, call: str, motion: Sequence[Tensor], into: Sequence[Tensor] | None = None
) -> tuple[Tensor, ...]:
    """Return results of the C code, which `run` calls with arrays, as tensors that share its memory."""
    try:
        arrays = [as_numbers(t) for t in motion]
    except ValueError:  # a tensor has more than 64 axes
        raise too_many_axes(dict(zip(QDD, motion, strict=False)), motion[0].shape[-1]) from None
    if into is None:
        return tuple(torch.from_numpy(result) for result in run(call, arrays, None))
    for t in into:
        torch.autograd.graph.increment_version(t)  # no gradient may use the values that are overwritten
    run(call, arrays, [as_numbers(t) for t in into])
    return tuple(into)


def as_numbers(t: Tensor) -> NumberArray:
    """Return a CPU tensor's numbers as an array, in the same memory unless a negation is pending."""
    return (t.detach() if t.requires_grad else t).resolve_neg().numpy()


def operator(
    calls: NativeCalls, links: Sequence[ClosedForms] | None, rule: RigidRule | None, call: str
) -> Operator:
    """Return the torch operator of a C function, with a gradient, defined when first asked for."""
    key = (calls.sources, call)
    if key not in OPERATORS:
        OPERATORS[key] = _define(calls, links, rule, call)
    return OPERATORS[key]


def _define(
    calls: NativeCalls, links: Sequence[ClosedForms] | None, rule: RigidRule | None, call: str
) -> Operator:
    """Define the operator (q, qd, qdd, p, threads) -> results; p has parameters in the structure's order."""
    structure, sources, sizes = calls.structure, calls.sources, calls.sizes[OPERATED[call]]

    def values(p: Tensor) -> dict[str, Tensor]:
        return dict(zip(structure.parameters, p.unbind(), strict=True))

    def forward(q: Tensor, qd: Tensor, qdd: Tensor, p: Tensor, threads: int) -> Results:
        present = NativeCalls(structure, sources.directory, values(p.detach()), threads)
        return _bare(compute(present.run, OPERATED[call], (q, qd, qdd)))

    def fake(q: Tensor, qd: Tensor, qdd: Tensor, p: Tensor, threads: int) -> Results:
        return _bare(tuple(q.new_empty((*q.shape[:-1], size)) for size in sizes))

    def setup(ctx: Context, inputs: tuple[Tensor, Tensor, Tensor, Tensor, int], output: Results) -> None:
        ctx.save_for_backward(*inputs[:4])

    def again(q: Tensor, qd: Tensor, qdd: Tensor, p: Tensor) -> Sequence[Tensor]:
        found = getattr(TorchBackend(structure, links, values(p), rule), call)(q, qd, qdd)
        return [found] if torch.is_tensor(found) else cast("Sequence[Tensor]", found)

    def backward(ctx: Context, *slopes: Tensor) -> tuple[Tensor | None, ...]:
        inputs, needed = ctx.saved_tensors, ctx.needs_input_grad[:-1]
        hidden = any(map(is_fake, inputs))
        found = (
            differentiated(*inputs, needed, slopes) if hidden else _backward(again, inputs, needed, slopes)
        )
        each = iter(found)
        return (*(next(each) if need else None for need in needed), None)

    results = ", ".join(["Tensor"] * len(sizes))
    schema = f"(Tensor q, Tensor qd, Tensor qdd, Tensor p, int threads) -> ({results})"
    made = torch.library.custom_op(f"{_namespace(sources)}::{call}", forward, mutates_args=(), schema=schema)
    made.register_fake(fake)
    made.register_autograd(backward, setup_context=setup)
    differentiated = _differentiated(f"{_namespace(sources)}::{call}_slopes", again)
    return made


def _differentiated(name: str, again: Again) -> Callable[..., list[Tensor]]:
    """Define the operator (q, qd, qdd, p, needed, slopes of results) -> slopes of the needed inputs.

    A compiler takes it as one opaque operator: what torch would record of the rule has tables that the
    compiler may not see.
    """

    def forward(
        q: Tensor, qd: Tensor, qdd: Tensor, p: Tensor, needed: Sequence[bool], slopes: Sequence[Tensor | None]
    ) -> list[Tensor]:
        with _recorded_in_an_operator():
            found = _backward(again, (q, qd, qdd, p), needed, slopes)
        return [slope.clone() for slope in found]

    def fake(
        q: Tensor, qd: Tensor, qdd: Tensor, p: Tensor, needed: Sequence[bool], slopes: Sequence[Tensor | None]
    ) -> list[Tensor]:
        return [torch.empty_like(t) for t, need in zip((q, qd, qdd, p), needed, strict=True) if need]

    schema = "(Tensor q, Tensor qd, Tensor qdd, Tensor p, bool[] needed, Tensor?[] slopes) -> Tensor[]"
    made = torch.library.custom_op(name, forward, mutates_args=(), schema=schema)
    made.register_fake(fake)
    return made


def _recorded_in_an_operator() -> AbstractContextManager[object]:
    """Let torch record for gradients within an operator, where it otherwise does not."""
    left_out = torch._C._dispatch_tls_local_exclude_set().remove(torch._C.DispatchKey.AutogradCPU)
    return torch._C._ForceDispatchKeyGuard(torch._C._dispatch_tls_local_include_set(), left_out)


def _backward(
    again: Again, inputs: Inputs, needed: Sequence[bool], slopes: Sequence[Tensor | None]
) -> Sequence[Tensor]:
    """Return the slopes of the needed inputs from those of the results, computed once more in torch."""
    differentiable = torch.is_grad_enabled()
    with torch.enable_grad():
        fresh = [t if differentiable else t.detach().requires_grad_() for t in inputs]
        results = again(*fresh)
        pairs = [(r, s) for r, s in zip(results, slopes, strict=True) if r.requires_grad and s is not None]
        wanted = [t for t, need in zip(fresh, needed, strict=True) if need]
        if not pairs:  # only constants, such as the stiffness of a prismatic joint
            return [torch.zeros_like(t) for t in wanted]
        reached, given = zip(*pairs, strict=True)
        return torch.autograd.grad(
            reached, wanted, given, create_graph=differentiable, materialize_grads=True
        )


def _transformed(motion: Sequence[Tensor]) -> bool:
    """Return whether a transformation that needs more than values is active; it would be lost silently."""
    if torch.compiler.is_compiling():
        return False
    if torch._C._are_functorch_transforms_active():
        return True
    inside = torch.autograd.forward_ad._current_level >= 0
    return inside and any(_has_tangent(t) for t in motion)


def _has_tangent(t: Tensor) -> bool:
    return torch.autograd.forward_ad.unpack_dual(t).tangent is not None  # type: ignore[no-untyped-call]


def _bare(results: tuple[Tensor, ...]) -> Results:
    """Return one result by itself, and several as a tuple, as torch's operators do."""
    return results if len(results) > 1 else results[0]


def _namespace(sources: Sources) -> str:
    """Return a namespace of torch operators for this package alone, also beside another of the same name."""
    place = hashlib.sha256(f"{__name__} {sources.directory}".encode()).hexdigest()[:12]
    return f"linkwise_{sources.name}_{place}"
