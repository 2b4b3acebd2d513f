"""Check of `out`: whether the answer of a call can be written to the arrays or tensors that were given."""

import sys
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, cast

import numpy as np

from .arguments import has_tensors
from .interface import Numbers

if TYPE_CHECKING:
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]


def accepted(
    out: object,
    fields: Sequence[str],
    shapes: Sequence[tuple[int, ...]],
    motion: Mapping[str, Numbers],
    beside: Iterable[object],
    contiguous: bool,
) -> list[Numbers]:
    """Return the arrays or tensors of `out`, in order, after checking that the answer can be written to them.

    fields: names of the results where there are several; shapes: their shapes for one sample; motion: what is
    read, in one shape (..., n); beside: what else is read; contiguous: whether places must be contiguous, in
    C's order.
    Raises ValueError or TypeError, which names the place that cannot be written to and says why.
    """
    like = next(iter(motion.values()))
    given: Sequence[object] = [out]
    if fields:
        if not isinstance(out, tuple | list) or len(out) != len(fields):
            raise TypeError(f"out is {_kind(out)}; give {len(fields)} of them: {', '.join(fields)}")
        given = out
    names = [f"out.{field}" for field in fields] or ["out"]
    named: dict[str, Numbers] = {}
    for name, one, shape in zip(names, given, shapes, strict=True):
        named[name] = _checked(name, one, (*like.shape[:-1], *shape), like)
        if contiguous and not _is_contiguous(named[name]):
            raise ValueError(f"{name} is not contiguous; give what empty() makes, in C's order")
    if has_tensors([like]) and _recorded([*motion.values(), *beside]):
        raise TypeError(
            "out keeps no gradient, which the motion or a parameter requires; leave it away, or call under "
            "torch.no_grad()"
        )
    pairs = [*((a, b) for a in named.items() for b in motion.items()), *combinations(named.items(), 2)]
    for (name, place), (other, read) in pairs:
        if _overlap(place, read):
            raise ValueError(f"{name} overlaps {other}; give it memory of its own")
    return list(named.values())


def _checked(name: str, one: object, shape: tuple[int, ...], like: Numbers) -> Numbers:
    tensor = has_tensors([like])
    right = has_tensors([one]) if tensor else isinstance(one, np.ndarray)
    if not right or isinstance(one, np.ma.MaskedArray):
        raise TypeError(f"{name} is {_kind(one)}; the answer is {'a tensor' if tensor else 'an array'}")
    place = cast(Numbers, one)
    if place.dtype != like.dtype:
        raise TypeError(f"{name} has dtype {_word(place)}; the answer has {_word(like)}")
    where, there = getattr(place, "device", None), getattr(like, "device", None)
    if tensor and where != there:
        raise TypeError(f"{name} lies on {where}; the answer lies on {there}")
    if tuple(place.shape) != shape:
        raise ValueError(f"{name} has shape {tuple(place.shape)}; the answer has {shape}")
    if _overlaps_itself(place):
        raise ValueError(f"{name} overlaps itself; give it memory of its own")
    if getattr(place, "requires_grad", False):
        raise TypeError(f"{name} requires a gradient; give {name}.detach()")
    if isinstance(place, np.ndarray) and not place.flags.writeable:
        raise ValueError(f"{name} is read-only; give an array that may be written to")
    return place


def _overlaps_itself(one: Numbers) -> bool:
    """Return whether the step along an axis is zero, or smaller than what axes with smaller steps cover."""
    if 0 in one.shape:
        return False
    array = isinstance(one, np.ndarray)
    steps = one.strides if isinstance(one, np.ndarray) else cast("Tensor", one).stride()
    covered = one.itemsize - 1 if array else 0
    for step, size in sorted((abs(step), size) for step, size in zip(steps, one.shape, strict=True)):
        if size > 1 and step <= covered:
            return True
        covered += (size - 1) * step
    return False


def _is_contiguous(one: Numbers) -> bool:
    if isinstance(one, np.ndarray):
        return one.flags.c_contiguous and one.flags.aligned
    tensor = cast("Tensor", one)
    return tensor.is_contiguous() and not tensor.is_neg()


def _recorded(tensors: Iterable[object]) -> bool:
    torch = sys.modules["torch"]
    return torch.is_grad_enabled() and any(getattr(t, "requires_grad", False) for t in tensors)


def _overlap(a: Numbers, b: Numbers) -> bool:
    """Return whether two arrays, or two tensors, lie in the same stretch of memory."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.may_share_memory(a, b)
    one, other = cast("Tensor", a), cast("Tensor", b)
    (a_first, a_end), (b_first, b_end) = _stretch(one), _stretch(other)
    return one.device == other.device and a_first < b_end and b_first < a_end


def _stretch(tensor: "Tensor") -> tuple[int, int]:
    """Return where in memory a tensor's numbers begin and end."""
    first = tensor.data_ptr()
    if not tensor.numel():
        return first, first
    steps = sum((size - 1) * step for size, step in zip(tensor.shape, tensor.stride(), strict=True))
    return first, first + (steps + 1) * tensor.element_size()


def _kind(value: object) -> str:
    return f"a {type(value).__name__}" + (f" of {len(value)}" if isinstance(value, tuple | list) else "")


def _word(a: Numbers) -> str:
    return str(a.dtype).removeprefix("torch.")
