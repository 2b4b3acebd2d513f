"""Answers that C writes, zeros included, for arrays and for tensors of which no gradient is recorded."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ..answers import KINDS
from ..arguments import has_tensors
from ..interface import Backend
from ..sums.sum_answers import SumAnswers
from .native_calls import NativeCalls
from .native_control import ControlCalls, NativeSums
from .native_memory import LARGE
from .native_module import compiled_calls

DTYPES = (np.dtype("f8"), np.dtype("f4"))
"""In the order of the compiled module."""

COMPILED = (
    "packed",
    "packed_torque",
    "partial_torque",
    "inverse_dynamics",
    "coefficients",
    "propagation",
    "position_gradient",
)
"""What the compiled module has of the calls of `Dynamics`."""


class NativeAnswers(SumAnswers):
    """The calls of the native back end, as the compiled module passes them on, or without it."""

    contiguous: ClassVar = True

    def __init__(
        self,
        backend: Backend[Any],
        calls: NativeCalls,
        on_torch: Callable[[], Any],
        check_finite: bool,
        control: ControlCalls | None,
    ) -> None:
        """`on_torch` gives what computes with tensors, made when first asked for.

        control: C functions that take one sample; links of energies have none
        """
        super().__init__(calls.structure, backend, check_finite)
        if control is not None:
            self._sums = NativeSums(calls.structure, backend, self._parts, control)
        self._calls, self._on_torch = calls, on_torch
        made = compiled_calls()
        # What is learned may change from call to call, and what is looked at is looked at here.
        self._compiled = None if made is None or check_finite or self._calls.learned else self._made(made)
        self._known: set[tuple[str, np.dtype[Any]]] = set()

    @property
    def direct(self) -> Mapping[str, Callable[..., Any]]:
        """The compiled module's calls, where there is one."""
        calls = {call: getattr(self._compiled, call) for call in COMPILED} if self._compiled else {}
        for call in calls.values():
            call.__module__ = __name__  # torch.jit asks where a function is from, before it calls it
        return calls

    def _made(self, made: Any) -> Any:
        """The compiled module's side of this robot."""
        constants = [self._calls.constants(kind) for kind in DTYPES]
        answers = {call: (KINDS.get(call), shapes) for call, shapes in self._shapes.items()}
        return made(self._structure.n, LARGE - 1, *constants, answers)

    def _answer(self, call: str, given: Sequence[Any], out: Any) -> Any:
        if out is None and not self._check_finite:
            values = self._calls.desks.at_once(call, given)
            if values is not None:
                kind = KINDS.get(call)
                return kind(*values) if kind else values[0]
        return super()._answer(call, given, out)

    def _computed(self, call: str, motion: Sequence[Any]) -> Any:
        if type(motion[0]) is np.ndarray or not has_tensors(motion):
            return self._run(call, motion)
        from .native_torch import compute  # it needs torch, which arrays do without

        if self._on_torch().needs_operators(motion):
            return super()._computed(call, motion)
        return compute(self._quickest, call, motion)

    def _compute_into(self, call: str, motion: Sequence[Any], into: Sequence[Any]) -> None:
        if not has_tensors(motion):
            self._run(call, motion, into)
            return
        from .native_torch import compute

        if self._on_torch().needs_operators(motion):
            super()._compute_into(call, motion, into)
        else:
            compute(self._quickest, call, motion, into)

    def _parts(self, call: str, motion: Sequence[Any]) -> Sequence[Any]:
        if type(motion[0]) is np.ndarray:
            values: Sequence[Any] = self._quickest(call, motion, None)
            return values
        return super()._parts(call, motion)

    def _quickest(self, call: str, motion: Sequence[Any], into: Sequence[Any] | None) -> Any:
        """Results for arrays from the compiled module, where there is one and it has the call."""
        convention = {"propagation": ("closing",), "gradient_propagation": ("gradient",)}.get(call, ())
        if not self._compiled or not (convention or call in COMPILED):
            return self._run(call, motion, into)
        several = call in KINDS
        out = into if into is None else tuple(into) if several else into[0]
        answer = getattr(self._compiled, "propagation" if convention else call)(
            self, *motion, *convention, out
        )
        return answer if several else (answer,)

    def _run(self, call: str, motion: Sequence[Any], into: Sequence[Any] | None = None) -> Any:
        """Call C, and tell the compiled module of a function that it has not known so far."""
        results = self._calls.run(call, motion, into)
        kind = motion[0].dtype
        if self._compiled and (call, kind) not in self._known and motion[0].size:
            self._known.add((call, kind))
            self._compiled.learn(call, DTYPES.index(kind), self._calls.address(call, kind))
        return results
