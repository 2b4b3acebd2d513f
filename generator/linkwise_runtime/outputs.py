"""Arrays and tensors that a caller gives for the answer: taken only where the answer can stand in them."""

import sys
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from .arguments import has_tensors


def accepted(
    out: Any,
    fields: Sequence[str],
    shapes: Sequence[tuple[int, ...]],
    motion: Mapping[str, Any],
    parameters: Iterable[Any],
    contiguous: bool,
) -> list[Any]:
    """The arrays or tensors of `out` in order, which an answer of these shapes a sample may be written to.

    fields: names of the results where there are several; motion: what is read, in one shape (..., n);
    contiguous: whether places must be so, in C's order.
    Raises ValueError or TypeError, which names what cannot be written to and why.
    """
    like = next(iter(motion.values()))
    if fields and (not isinstance(out, tuple | list) or len(out) != len(fields)):
        raise TypeError(f"out is {_kind(out)}; give {len(fields)} of them: {', '.join(fields)}")
    named = dict(zip((f"out.{f}" for f in fields), out, strict=True)) if fields else {"out": out}
    for (name, one), shape in zip(named.items(), shapes, strict=True):
        _check(name, one, (*like.shape[:-1], *shape), like)
        if contiguous and not _is_contiguous(one):
            raise ValueError(f"{name} is not contiguous; give what empty() makes, in C's order")
    if has_tensors([like]) and _recorded([*motion.values(), *parameters]):
        raise TypeError(
            "out keeps no gradient, which the motion or a parameter requires; leave it away, or call under "
            "torch.no_grad()"
        )
    pairs = [*((a, b) for a in named.items() for b in motion.items()), *combinations(named.items(), 2)]
    for (name, one), (other, read) in pairs:
        if _overlap(one, read):
            raise ValueError(f"{name} overlaps {other}; give it memory of its own")
    return list(named.values())


def _check(name: str, one: Any, shape: tuple[int, ...], like: Any) -> None:
    tensor = has_tensors([like])
    right = has_tensors([one]) if tensor else isinstance(one, np.ndarray)
    if not right or isinstance(one, np.ma.MaskedArray):
        raise TypeError(f"{name} is {_kind(one)}; the answer is {'a tensor' if tensor else 'an array'}")
    if one.dtype != like.dtype:
        raise TypeError(f"{name} has dtype {_word(one)}; the answer has {_word(like)}")
    if tensor and one.device != like.device:
        raise TypeError(f"{name} lies on {one.device}; the answer lies on {like.device}")
    if tuple(one.shape) != shape:
        raise ValueError(f"{name} has shape {tuple(one.shape)}; the answer has {shape}")
    if _overlaps_itself(one):
        raise ValueError(f"{name} overlaps itself; give it memory of its own")
    if tensor:
        if one.requires_grad:
            raise TypeError(f"{name} requires a gradient; give {name}.detach()")
    elif not one.flags.writeable:
        raise ValueError(f"{name} is read-only; give an array that may be written to")


def _overlaps_itself(one: Any) -> bool:
    """Whether steps along one axis are smaller than what the others cover, or nothing at all."""
    if 0 in one.shape:
        return False
    array = isinstance(one, np.ndarray)
    steps = one.strides if array else one.stride()
    covered = one.itemsize - 1 if array else 0
    for step, size in sorted((abs(step), size) for step, size in zip(steps, one.shape, strict=True)):
        if size > 1 and step <= covered:
            return True
        covered += (size - 1) * step
    return False


def _is_contiguous(one: Any) -> bool:
    if isinstance(one, np.ndarray):
        return one.flags.c_contiguous and one.flags.aligned
    return bool(one.is_contiguous()) and not one.is_neg()


def _recorded(tensors: Iterable[Any]) -> bool:
    torch: Any = sys.modules["torch"]
    return torch.is_grad_enabled() and any(getattr(t, "requires_grad", False) for t in tensors)


def _overlap(a: Any, b: Any) -> bool:
    """Whether two arrays, or two tensors, lie in the same stretch of memory."""
    if isinstance(a, np.ndarray):
        return np.may_share_memory(a, b)
    (a_first, a_end), (b_first, b_end) = _stretch(a), _stretch(b)
    return a.device == b.device and a_first < b_end and b_first < a_end


def _stretch(tensor: Any) -> tuple[int, int]:
    """Where in memory a tensor's numbers begin and end."""
    first = tensor.data_ptr()
    if not tensor.numel():
        return first, first
    steps = sum((size - 1) * step for size, step in zip(tensor.shape, tensor.stride(), strict=True))
    return first, first + (steps + 1) * tensor.element_size()


def _kind(value: Any) -> str:
    return f"a {type(value).__name__}" + (f" of {len(value)}" if isinstance(value, tuple | list) else "")


def _word(a: Any) -> str:
    return str(a.dtype).removeprefix("torch.")
