"""Closed forms on torch tensors."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from .answers import Answers
from .arguments import as_array, check_axes, no_common_shape, precision
from .interface import ClosedForms
from .parameter_values import fits
from .structure import Structure

FLOATS = ({torch.float32}, {torch.float64})


class TorchBackend:
    """Answers with tensors of the caller's dtype and device; gradients flow through motion and parameters."""

    name: ClassVar = "torch"
    takes_tensors: ClassVar = True

    def __init__(
        self, structure: Structure, links: Sequence[ClosedForms], parameters: Mapping[str, Any]
    ) -> None:
        self.structure = structure
        self.links = links
        self.parameters: dict[str, Any] = {
            k: v if torch.is_tensor(v) else torch.as_tensor(v, dtype=torch.float64)
            for k, v in parameters.items()
        }

    def arrays(self, named: Mapping[str, Tensor], n: int) -> Sequence[Tensor]:
        """The motion, checked and broadcast to a common shape (..., n); errors name the argument."""
        given = [value for value in named.values() if torch.is_tensor(value)]
        if len({t.device for t in given}) > 1:
            raise TypeError(f"{', '.join(named)} lie on different devices; move them to one")
        if len(given) < len(named) or {t.dtype for t in given} not in FLOATS:
            named = _tensors(named, given[0].device if given else torch.device("cpu"))
        check_axes(named, n)
        try:
            return torch.broadcast_tensors(*named.values())  # type: ignore[no-any-return, no-untyped-call]
        except RuntimeError:
            raise no_common_shape(named, n) from None

    def answers(self, check_finite: bool) -> Answers:
        """The calls of `Dynamics`."""
        return Answers(self.structure, self, check_finite)

    def decomposition(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Sequence[Tensor]:
        """c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        p = self._values(q)
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
        return self.concatenate(_stacked(q, link.torque(torch, q, qd, qdd, p)) for link in self.links)

    def position_gradient(self, q: Tensor, qd: Tensor, qdd: Tensor) -> Tensor:
        """c0 (..., count) in the order of `Layout.velocity`."""
        p = self._values(q)
        return self.concatenate(
            _stacked(q, link.position_gradient(torch, q, qd, qdd, p)) for link in self.links
        )

    def constant(self, values: Any, like: Tensor) -> Tensor:
        """A table of numbers, to compute with `like`."""
        with torch.inference_mode(False):  # it is kept, and a later call may need its gradient
            return torch.as_tensor(values, dtype=like.dtype, device=like.device)

    def index(self, values: Any, like: Tensor) -> Tensor:
        """A table of positions, to take from `like`."""
        with torch.inference_mode(False):  # it is kept, and a later call may need its gradient
            return torch.as_tensor(values, dtype=torch.long, device=like.device)

    def asarray(self, value: Any, like: Tensor) -> Tensor:
        """Anything array-like, in the dtype and on the device of `like`."""
        return torch.as_tensor(value, dtype=like.dtype, device=like.device)

    def zeros(self, like: Tensor, count: int) -> Tensor:
        """Zeros of shape (..., count) for `like` of shape (..., m)."""
        return like.new_zeros((*like.shape[:-1], count))

    def concatenate(self, parts: Iterable[Tensor]) -> Tensor:
        """The parts joined along the last axis."""
        return torch.cat(list(parts), -1)

    def _values(self, q: Tensor) -> dict[str, Tensor]:
        for name, value in self.parameters.items():
            if value.ndim:
                fits(name, value.shape, q.shape[:-1])
        return {k: v.to(q) for k, v in self.parameters.items()}


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
