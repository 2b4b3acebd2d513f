"""Records what torch computes while energies are differentiated, operation by operation.

Equal operations on equal operands are one, with one key in every recording: these are what graphs share.
A value that depends on no motion and no parameter is a constant, and no operation; nor is a product with 1
or a sum with 0, from which every sweep of autograd starts.
"""

import operator
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import blake2b
from pathlib import Path
from types import FrameType
from typing import NamedTuple

import torch
from torch import Tensor
from torch.utils._python_dispatch import TorchDispatchMode

ENERGIES = re.compile(r".*\.energies\.link_\d+")
"""Names of a package's modules that hold the energies' source lines."""
FILLED = {"ones_like", "zeros_like", "full_like", "new_zeros", "new_ones", "new_full", "new_empty_strided"}
"""Operations whose results have a tensor's shape, and nothing of its values."""
NEUTRAL = {"add": 0.0, "sub": 0.0, "mul": 1.0, "div": 1.0}
"""Numbers that leave the other operand as it is."""
CALLS: dict[str, Callable[..., object]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "neg": operator.neg,
    "pow": operator.pow,
}
"""Functions that compute an operation also where an operand is a number."""

Place = tuple[int, tuple[int, ...], tuple[int, ...], torch.dtype]
"""Address of a tensor's numbers in memory, and their layout."""


class Ref(NamedTuple):
    """An operand: the value of the leaf or the operation with this key."""

    key: str


@dataclass(frozen=True)
class Leaf:
    """A motion, q[k], qd[k] or qdd[k] with k from 0, or one number that is a parameter."""

    key: str
    """Key of the leaf, equal in every graph."""
    kind: str
    """One of q, qd, qdd and parameter."""
    name: str
    """Name of the joint, the run-time parameter, or the entry of an nn.Parameter, links.link2.com[0]."""
    shape: tuple[int, ...] = ()
    """Shape of the value for one sample."""


@dataclass(frozen=True)
class Operation:
    """One operation of torch."""

    key: str
    """Key, equal for the same operation on the same operands in every graph."""
    name: str
    """Name of the operation in torch, such as mul or sin."""
    arguments: tuple[object, ...]
    """Operands as `Ref`, numbers and other arguments of the operation, nested as they were."""
    options: Mapping[str, object]
    """Keyword arguments of the operation."""
    shape: tuple[int, ...]
    """Shape of the value for one sample."""
    source: str
    """Line of the energy that it computes or differentiates, link_2.py:31; empty where there is none."""
    derivative: int
    """Number of times that the energy has been differentiated: 0 in the energy itself."""
    pointwise: bool
    """True if it computes every sample by itself, whatever the shape of the batch."""
    call: Callable[..., object] = field(repr=False, compare=False)
    """Function that computes it."""

    @property
    def operands(self) -> tuple[str, ...]:
        """Keys of the values that it needs, in order."""
        return tuple(part.key for part in flat((self.arguments, tuple(self.options.values()))))


class OperationRecorder(TorchDispatchMode):  # type: ignore[no-untyped-call]
    """Records operations while it is entered; values belong to one sample."""

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self.operations: dict[str, Operation] = {}
        self._known: dict[Place, tuple[Ref, Tensor]] = {}
        self._sources: dict[int, str] = {}
        self._derivative = 0

    @classmethod
    def _should_skip_dynamo(cls) -> bool:
        """Return False: else torch imports its compiler, for seconds, to hide this mode from it.

        Nothing here is compiled.
        """
        return False

    def leaf(self, leaf: Leaf, value: Tensor) -> Tensor:
        """Take a tensor for the value of a leaf; other tensors that no operation made are constants."""
        self._know(value, Ref(leaf.key))
        return value

    @contextmanager
    def derivative(self, number: int) -> Iterator[None]:
        """Let all that is recorded inside belong to the derivative of this order."""
        former, self._derivative = self._derivative, number
        try:
            yield
        finally:
            self._derivative = former

    def operand(self, value: object, number: bool = True) -> object:
        """Return a value as an operand: a `Ref`, or a constant.

        number: whether a constant of a single number is returned as a Python number
        """
        if not torch.is_tensor(value):
            return value
        known = self._known.get(_place(value))
        if known is not None:
            return known[0]
        return value.item() if number and not value.dim() else value.detach().clone()

    def __torch_dispatch__(
        self,
        func: "torch._ops.OpOverload[..., Tensor | Sequence[Tensor]]",
        types: object,
        args: tuple[object, ...] = (),
        kwargs: Mapping[str, object] | None = None,
    ) -> Tensor | Sequence[Tensor]:
        """Compute an operation and record it."""
        if func._schema.is_mutable:
            raise TypeError(f"{func} writes into a tensor, which a graph cannot show; write x = x + 1, say")
        options = dict(kwargs or {})
        result = func(*args, **options)
        name = func.overloadpacket.__name__
        # An operation that is not in CALLS, or adds a multiple (alpha), needs tensors where it had tensors.
        number = name in CALLS and not options
        arguments = tuple(mapped(lambda value: self.operand(value, number), args))
        if name in FILLED or not any(flat(arguments)):
            return result  # a constant
        if not torch.is_tensor(result):
            ref = self._record(func, name, arguments, options, ())
            for at, part in enumerate(result):
                item = self._record(operator.getitem, "item", (ref, at), {}, tuple(part.shape))
                self._know(part, item)
            return result
        if _place(result) in self._known:
            return result  # an alias of a known value, as detach() returns
        same = _same(name, arguments, options, result)
        if same is None:
            same = self._record(func, name, arguments, options, tuple(result.shape))
        if isinstance(same, Ref):
            self._know(result, same)
        return result

    def _record(
        self,
        func: Callable[..., object],
        name: str,
        arguments: tuple[object, ...],
        options: Mapping[str, object],
        shape: tuple[int, ...],
    ) -> Ref:
        key = _key(name, arguments, options)
        source = self._source(arguments)
        if key not in self.operations:
            call = func if options else CALLS.get(name, func)
            pointwise = torch.Tag.pointwise in getattr(func, "tags", ())
            self.operations[key] = Operation(
                key, name, arguments, options, shape, source, self._derivative, pointwise, call
            )
        return Ref(key)

    def _know(self, value: Tensor, ref: Ref) -> None:
        self._known[_place(value)] = ref, value  # kept alive, so that no other tensor gets its memory

    def _source(self, arguments: tuple[object, ...]) -> str:
        """Return the line of the energy, or of the operation that this one differentiates."""
        node = torch._C._current_autograd_node()
        source = _line_of_energy() if node is None else self._sources.get(node._sequence_nr(), "")
        if not source and self._derivative:  # a sum of gradients: its line is that of what it sums
            found = (self.operations[r.key].source for r in flat(arguments) if r.key in self.operations)
            source = next(filter(None, found), "")
        self._sources.setdefault(torch._C._autograd._get_sequence_nr() - 1, source)
        return source


def flat(nested: object) -> Iterator[Ref]:
    """Yield the operands that are values, in order."""
    if isinstance(nested, Ref):
        yield nested
    elif isinstance(nested, list | tuple):
        for part in nested:
            yield from flat(part)


def mapped(function: Callable[[object], object], nested: Sequence[object]) -> Iterator[object]:
    """Yield the results of a function of everything in nested lists and tuples, nested likewise."""
    for part in nested:
        if isinstance(part, list | tuple) and not isinstance(part, Ref):
            yield type(part)(mapped(function, part))
        else:
            yield function(part)


def _place(value: Tensor) -> Place:
    """Return the address and layout of a tensor, equal for tensors of the same numbers in the same memory."""
    return value.data_ptr(), tuple(value.shape), value.stride(), value.dtype


def _same(
    name: str, arguments: tuple[object, ...], options: Mapping[str, object], result: Tensor
) -> Ref | float | None:
    """Return the operand that a product with 1, or a sum with 0, equals.

    Returns 0.0 for a product with 0, and None for any other operation. In a difference or a quotient only
    the second operand may be such a number.
    """
    if options or len(arguments) != 2 or name not in NEUTRAL or result.dim():
        return None
    one, other = arguments
    if isinstance(other, Ref) and name in ("add", "mul"):
        one, other = other, one
    if not isinstance(one, Ref) or not isinstance(other, float | int):
        return None
    if other == NEUTRAL[name]:
        return one
    return 0.0 if name == "mul" and other == 0.0 else None


def _key(name: str, arguments: tuple[object, ...], options: Mapping[str, object]) -> str:
    """Return a hash of an operation and its operands; the order of factors or summands does not matter."""
    parts = [repr(part.tolist() if torch.is_tensor(part) else part) for part in arguments]
    if name in ("add", "mul") and not options:
        parts.sort()
    return blake2b(repr((name, parts, sorted(options.items()))).encode(), digest_size=8).hexdigest()


def _line_of_energy() -> str:
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        if ENERGIES.fullmatch(frame.f_globals.get("__name__", "")):
            return f"{Path(frame.f_code.co_filename).name}:{frame.f_lineno}"
        frame = frame.f_back
    return ""
