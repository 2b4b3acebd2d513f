"""Calls of the compiled C: arrays in, arrays out, large batches on several threads."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .arguments import has_tensors
from .native_build import Sources
from .native_library import NumberArray, address, function, memory
from .structure import Structure

PER_THREAD = 1 << 20
"""Bytes of results below which another thread costs more than it saves."""


@cache
def pool(threads: int) -> ThreadPoolExecutor:
    """Worker threads, shared by all robots; ctypes lets go of Python's lock while C runs."""
    return ThreadPoolExecutor(threads, thread_name_prefix="linkwise")


# Threads don't survive a fork; the child starts its own.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=pool.cache_clear)


class NativeCalls:
    """The C functions of a package for given parameters; each parameter is one number for all samples.

    `threads` is how many a large batch may use.
    """

    def __init__(self, structure: Structure, sources: Path, parameters: Mapping[str, Any]) -> None:
        """Compile at the first call for this package; raises RuntimeError where that cannot be."""
        self.structure, self.parameters = structure, dict(parameters)
        self.sources = Sources(structure.name, sources)
        self.threads = os.cpu_count() or 1
        self.sizes = result_sizes(structure)
        self._learned = has_tensors(parameters.values())
        self._constants = {kind: self._numbers(kind) for kind in map(np.dtype, ("f4", "f8"))}
        self._functions: dict[tuple[str, np.dtype[Any]], Any] = {}
        self._function("decomposition", np.dtype("f8"))

    def run(self, call: str, q: NumberArray, qd: NumberArray, qdd: NumberArray) -> list[NumberArray]:
        """Results (..., size) of a C function for arrays of one shape (..., n), in one piece of memory."""
        sizes = self.sizes[call]
        kind, shape, n = q.dtype, q.shape[:-1], q.shape[-1]
        count, width = q.size // n, kind.itemsize
        buffer = memory(count * sum(sizes), kind)
        motion = [
            a if a.flags.c_contiguous and a.flags.aligned else np.array(a, order="C") for a in (q, qd, qdd)
        ]
        inputs = [(address(a), n * width) for a in motion]
        results, outputs, at, start = [], [], 0, address(buffer)
        for size in sizes:
            end = at + count * size
            results.append(buffer[at:end].reshape(*shape, size) if shape else buffer[at:end])
            if size:  # for what a robot has none of, its functions take no array
                outputs.append((start + at * width, size * width))
            at = end
        values = self._numbers(kind) if self._learned else self._constants[kind]
        p = [(address(values), 0)] if self.parameters else []
        parts = min(self.threads, buffer.nbytes // PER_THREAD)
        if count:
            self._call(self._function(call, kind), count, [*inputs, *p, *outputs], parts)
        return results

    def _function(self, call: str, kind: "np.dtype[Any]") -> Any:
        """C function of a call for a dtype, compiled if it is not there yet."""
        found = self._functions.get((call, kind))
        if found is None:
            outputs = sum(size > 0 for size in self.sizes[call])
            arrays = 3 + bool(self.parameters) + outputs
            found = self._functions[call, kind] = function(self.sources, call, kind.str[1:], arrays)
        return found

    def _call(self, compute: Any, count: int, arrays: Sequence[tuple[int, int]], parts: int) -> None:
        """Call a C function; `arrays` are addresses, and bytes from one sample to the next.

        In several `parts`, threads take shares of the samples; shares of 16 fill blocks of either type.
        """
        if parts <= 1:
            compute(count, *(start for start, _ in arrays))
            return
        share = -(-count // parts // 16) * 16

        def run(first: int) -> None:
            compute(min(share, count - first), *(start + first * step for start, step in arrays))

        first, *others = range(0, count, share)
        waiting = [pool(self.threads).submit(run, start) for start in others]
        run(first)
        for future in waiting:
            future.result()

    def _numbers(self, kind: "np.dtype[Any]") -> NumberArray:
        """Parameters in the order of the structure; a tensor's value is the one it has now."""
        for name in self.structure.parameters:
            if np.shape(self.parameters[name]) != ():
                raise ValueError(
                    f"parameter {name!r} must be one number here; "
                    "the numpy and torch back ends take one per sample"
                )
        return np.array([_number(self.parameters[name]) for name in self.structure.parameters], dtype=kind)


def result_sizes(structure: Structure) -> dict[str, tuple[int, ...]]:
    """Values of one sample in each array that a C function answers with."""
    sizes = structure.sizes
    return {
        "decomposition": tuple(sizes),
        "torque": (sizes.tau,),
        "position_gradient": (sizes.c1,),
    }


def _number(value: Any) -> float:
    """A parameter's value as it is now, without its gradient."""
    return float(value.detach() if has_tensors([value]) else value)
