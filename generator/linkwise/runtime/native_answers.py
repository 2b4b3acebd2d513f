"""Answers that C writes, zeros included, for arrays and for tensors of which no gradient is recorded."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .answers import Answers
from .arguments import has_tensors

if TYPE_CHECKING:
    from .native_backend import NativeBackend


class NativeAnswers(Answers):
    """The calls of the native back end."""

    def __init__(self, backend: "NativeBackend", check_finite: bool) -> None:
        super().__init__(backend.structure, backend, check_finite)
        self._native = backend

    def _computed(self, call: str, motion: Sequence[Any]) -> Any:
        if not has_tensors(motion):
            return self._native.calls.run(call, motion)
        from .native_torch import compute  # it needs torch, which arrays do without

        if self._native.on_torch().needs_operators(motion):
            return super()._computed(call, motion)
        return compute(self._native.calls, call, motion)

    def _compute_into(self, call: str, motion: Sequence[Any], into: Sequence[Any]) -> None:
        if not has_tensors(motion):
            self._native.calls.run(call, motion, into)
            return
        from .native_torch import compute

        if self._native.on_torch().needs_operators(motion):
            super()._compute_into(call, motion, into)
        else:
            compute(self._native.calls, call, motion, into)
