"""What torch computes while energies are differentiated, written down operation by operation.

Equal operations on equal operands are one, known by one key in every recording: that is what graphs share.
A value that hangs on no motion and no parameter is a constant, and no operation; nor is a product with 1
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
"""Modules of a package whose lines energies are."""
FILLED = {"ones_like", "zeros_like", "full_like", "new_zeros", "new_ones", "new_full", "new_empty_strided"}
"""Operations whose results have a tensor's shape, and nothing of its values."""
NEUTRAL = {"add": 0.0, "sub": 0.0, "mul": 1.0, "div": 1.0}
"""Numbers that leave what stands before them as it is."""
CALLS: dict[str, Callable[..., object]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "neg": operator.neg,
    "pow": operator.pow,
}
"""What computes an operation also where an operand is a number."""

Place = tuple[int, tuple[int, ...], tuple[int, ...], torch.dtype]
"""Where a tensor's numbers lie in memory, and how."""


class Ref(NamedTuple):
    """An operand: the value of the leaf or the operation with this key."""

    key: str


@dataclass(frozen=True)
class Leaf:
    """A motion, q[k], qd[k] or qdd[k] with k from 0, or one number that is a parameter."""

    key: str
    """The same for the same leaf of every graph."""
    kind: str
    """q, qd, qdd or parameter."""
    name: str
    """Of the joint, the run-time parameter, or the entry of a link's nn.Parameter: links.link2.com[0]."""
    shape: tuple[int, ...] = ()
    """Of one sample."""


@dataclass(frozen=True)
class Operation:
    """One operation of torch."""

    key: str
    """The same for the same operation on the same operands in every graph."""
    name: str
    """As torch calls it: mul, sin."""
    arguments: tuple[object, ...]
    """Operands as `Ref`, numbers and whatever else the operation was called with, nested as it was."""
    options: Mapping[str, object]
    """What it was called with by name."""
    shape: tuple[int, ...]
    """Of its value for one sample."""
    source: str
    """Line of the energy that it computes or differentiates, link_2.py:31; empty where there is none."""
    derivative: int
    """How often the energy has been differentiated: 0 in the energy itself."""
    pointwise: bool
    """Whether it computes every sample by itself, whatever the shape of the batch."""
    call: Callable[..., object] = field(repr=False, compare=False)
    """What computes it."""

    @property
    def operands(self) -> tuple[str, ...]:
        """Keys of the values that it needs, in order."""
        return tuple(part.key for part in flat((self.arguments, tuple(self.options.values()))))


class OperationRecorder(TorchDispatchMode):  # type: ignore[no-untyped-call]
    """Records while it is entered; values belong to one sample."""

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self.operations: dict[str, Operation] = {}
        self._known: dict[Place, tuple[Ref, Tensor]] = {}
        self._sources: dict[int, str] = {}
        self._derivative = 0

    @classmethod
    def _should_skip_dynamo(cls) -> bool:
        """Torch would import its compiler, for seconds, to hide this from it; nothing here is compiled."""
        return False

    def leaf(self, leaf: Leaf, value: Tensor) -> Tensor:
        """Take a tensor for the value of a leaf; others that no operation made are constants."""
        self._know(value, Ref(leaf.key))
        return value

    @contextmanager
    def derivative(self, number: int) -> Iterator[None]:
        """What is recorded inside belongs to the derivative of this order."""
        former, self._derivative = self._derivative, number
        try:
            yield
        finally:
            self._derivative = former

    def operand(self, value: object, number: bool = True) -> object:
        """A value as an operand: a `Ref`, or a constant, of a single number as such where that will do."""
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
        """Compute an operation and write it down."""
        if func._schema.is_mutable:
            raise TypeError(f"{func} writes into a tensor, which a graph cannot show; write x = x + 1, say")
        options = dict(kwargs or {})
        result = func(*args, **options)
        name = func.overloadpacket.__name__
        # What is not in CALLS, or adds a multiple (alpha), takes tensors where it was given tensors.
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
            return result  # the same value once more, as of detach()
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
        self._known[_place(value)] = ref, value  # kept, so that its memory is no other's

    def _source(self, arguments: tuple[object, ...]) -> str:
        """Line of the energy, or of the operation that this one differentiates."""
        node = torch._C._current_autograd_node()
        source = _line_of_energy() if node is None else self._sources.get(node._sequence_nr(), "")
        if not source and self._derivative:  # a sum of gradients: it belongs to what it sums
            found = (self.operations[r.key].source for r in flat(arguments) if r.key in self.operations)
            source = next(filter(None, found), "")
        self._sources.setdefault(torch._C._autograd._get_sequence_nr() - 1, source)
        return source


def flat(nested: object) -> Iterator[Ref]:
    """Operands that are values, in order."""
    if isinstance(nested, Ref):
        yield nested
    elif isinstance(nested, list | tuple):
        for part in nested:
            yield from flat(part)


def mapped(function: Callable[[object], object], nested: Sequence[object]) -> Iterator[object]:
    """A function of everything in nested lists and tuples."""
    for part in nested:
        if isinstance(part, list | tuple) and not isinstance(part, Ref):
            yield type(part)(mapped(function, part))
        else:
            yield function(part)


def _place(value: Tensor) -> Place:
    """What two tensors have in common that are the same numbers in the same memory."""
    return value.data_ptr(), tuple(value.shape), value.stride(), value.dtype


def _same(
    name: str, arguments: tuple[object, ...], options: Mapping[str, object], result: Tensor
) -> Ref | float | None:
    """The operand that a product with 1, or a sum with 0, is, or the number 0 for a product with it.

    Of a difference and a quotient only the second may be such a number.
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
    """Hash of an operation and its operands; which factor or summand comes first does not matter."""
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
