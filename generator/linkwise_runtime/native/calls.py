"""Calls of the compiled C on arrays; large batches run on several threads."""

import ctypes
import math
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..answers.answers import answer_shapes
from ..arguments import has_tensors, shape_of
from ..call_table import CALLS
from ..interface import Numbers
from ..structure import Structure
from .build import loaded
from .library import OneSampleCall, OneSamplePool, function, one_sample_call, start_of
from .memory import NumberArray, NumberType, address, memory, place

if TYPE_CHECKING:
    from ctypes import _NamedFuncPointer as CFunction

    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]

PER_THREAD = 1 << 20
"""Bytes of results below which another thread costs more than it saves."""

PACKED_GRADIENT = "packed_position_gradient"
"""Packed derivatives by position; no row of the call table, as no call of Python answers with them."""
SHARE_VARIANCES = "share_variances"
"""Variances of packed values by uncertain bodies, which `uncertainty` takes the roots of; no row either."""
LINK_WRENCHES = "link_wrenches"
"""Wrenches of links by cause, of which `reactions` are made; they too are no row."""
FUNCTIONS = {key: row.c for key, row in CALLS.items() if row.c and not row.one and row.ties != "kept"} | {
    PACKED_GRADIENT: "position_gradient",
    LINK_WRENCHES: "reactions",
    SHARE_VARIANCES: SHARE_VARIANCES,
}
"""Names in C of the calls for many samples; constraints.py has those of tied joints."""

AT_REST = ("coefficients", "coefficient_regressors", LINK_WRENCHES)
"""Calls that take no qdd."""


@cache
def pool(threads: int) -> ThreadPoolExecutor:
    """Return worker threads, shared by all robots; ctypes releases Python's lock while C runs."""
    return ThreadPoolExecutor(threads, thread_name_prefix="linkwise")


# Threads do not survive a fork; the child process starts its own.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=pool.cache_clear)


def checked_threads(count: object) -> int:
    """Return a number of threads; raise TypeError or ValueError unless it is a whole number from 1 on."""
    if isinstance(count, bool) or not isinstance(count, int | np.integer):
        raise TypeError(f"threads is a {type(count).__name__}; give a whole number from 1 on")
    if count < 1:
        raise ValueError(f"threads is {count}; give a whole number from 1 on")
    return int(count)


class NativeCalls:
    """The C functions of a package for given parameters; each parameter is one number for all samples.

    `threads` is how many threads a large batch may use.
    """

    def __init__(
        self,
        structure: Structure,
        sources: Path,
        parameters: Mapping[str, float | Numbers],
        threads: int | None = None,
        changing: bool = False,
    ) -> None:
        """Compile at the first call for this package; raise RuntimeError where that is not possible.

        threads: the number of cores unless given; changing: whether parameters change from call to call
        """
        self.structure, self.parameters = structure, dict(parameters)
        self.sources = loaded(structure, sources)
        self.threads_set, self._cores = threads, os.cpu_count() or 1
        wrenches = (structure.sizes.tau, 6), (structure.sizes.tau, 6), (structure.N, 6)
        packed = tuple((size,) for size in structure.sizes[:4])
        beside = {PACKED_GRADIENT: ((structure.sizes.c1,),), LINK_WRENCHES: wrenches, SHARE_VARIANCES: packed}
        self.shapes = answer_shapes(structure) | beside
        self.sizes = {call: [math.prod(shape) for shape in shapes] for call, shapes in self.shapes.items()}
        self._complete = {call: all(sizes) for call, sizes in self.sizes.items()}
        self._widths = {call: sum(sizes) for call, sizes in self.sizes.items()}
        self.learned = changing or has_tensors(parameters.values())
        self._constants = {kind: self._numbers(kind) for kind in map(np.dtype, ("f4", "f8"))}
        self._of_one, self._shape = OneSamplePool(self._one_sample), (structure.n,)
        self._functions: dict[tuple[str, NumberType], CFunction] = {}
        self._function("packed", np.dtype("f8"))

    def separate(self) -> "NativeCalls":
        """Return the same functions for parameters that change from call to call."""
        return NativeCalls(
            self.structure, self.sources.directory, self.parameters, self.threads_set, changing=True
        )

    @property
    def threads(self) -> int:
        """Number of threads that a large batch may use."""
        return self.threads_set or self._cores

    def at_once(self, call: str, motion: Sequence[object]) -> list[NumberArray] | None:
        """Return the results for one plain sample of a call made before; None for anything else."""
        kind, shape = getattr(motion[0], "dtype", None), self._shape
        for a in motion:
            if type(a) is not np.ndarray or a.dtype is not kind or a.shape != shape:
                return None
        key: Any = call, kind
        if key not in self._of_one.free:
            return None
        arrays: Any = motion
        try:
            numbers = b"".join(arrays)
        except TypeError:  # one of the arrays is not contiguous
            return None
        return self._of_one.results(key, numbers)

    def run(
        self,
        call: str,
        motion: Sequence[NumberArray],
        into: Sequence[NumberArray] | None = None,
        told: Sequence[NumberArray] = (),
    ) -> Sequence[NumberArray]:
        """Return a call's results for arrays of one shape (..., n), written to `into`, or to new memory.

        told: arrays that are the same for all samples
        """
        q = motion[0]
        kind, batch = q.dtype, q.shape[:-1]
        count = q.size // q.shape[-1]
        if count == 1 and into is None and not self.learned and not told:
            results = self._of_one.results((call, kind), b"".join(a.tobytes() for a in motion))
            return [a.reshape(*batch, *a.shape) for a in results] if batch else results
        shapes = self.shapes[call]
        if into is None:
            into = [memory((*batch, *shape), kind) for shape in shapes]
        if not count:
            return into
        compute = self._functions.get((call, kind)) or self._function(call, kind, len(told))
        read = [plain(a) for a in motion]
        if self.parameters:
            read.append(self.constants(kind))
        read += told
        sizes = self.sizes[call]
        # A robot may lack entries of some kind; its functions then take no array for them.
        written = into if self._complete[call] else [a for a, size in zip(into, sizes, strict=True) if size]
        parts = self.parts(count * self._widths[call] * kind.itemsize)
        if parts == 1:
            compute(count, *[place(a) for a in read], *[place(a) for a in written])
            return into
        width = kind.itemsize
        arrays = [
            *((address(a), q.shape[-1] * width) for a in read[: len(motion)]),
            *((address(a), 0) for a in read[len(motion) :]),
            *((address(a), size * width) for a, size in zip(written, filter(None, sizes), strict=True)),
        ]
        self.share(compute, count, arrays, parts, (read, into))
        return into

    def _one_sample(self, key: tuple[str, NumberType]) -> OneSampleCall:
        """Return a call for one sample of a dtype, with memory of its own."""
        call, kind = key
        compute = self._functions.get(key) or self._function(call, kind)
        motion = np.empty((2 if call in AT_REST else 3, self.structure.n), kind)
        constants = [self._constants[kind]] if self.parameters else []
        results = [np.empty(shape, kind) for shape in self.shapes[call]]
        given = (ctypes.c_size_t(1), *motion, *constants)
        return one_sample_call(compute, False, given, motion, results)

    def constants(self, kind: NumberType) -> NumberArray:
        """Return the present values of the parameters in the order of the structure."""
        return self._numbers(kind) if self.learned else self._constants[kind]

    def address(self, call: str, kind: NumberType) -> int:
        """Return the address of the C function of a call that has been made before."""
        return start_of(self._functions[call, kind])

    def _function(self, call: str, kind: NumberType, told: int = 0) -> "CFunction":
        """Return the C function of a call for a dtype, compiled if it is not there yet; told: see `run`."""
        reads = told + (2 if call in AT_REST else 3)
        arrays = reads + bool(self.parameters) + sum(size > 0 for size in self.sizes[call])
        found = self._functions[call, kind] = function(self.sources, FUNCTIONS[call], kind.str[1:], arrays)
        return found

    def parts(self, size: int) -> int:
        """Return the number of threads that results of so many bytes are worth."""
        return max(1, min(self.threads, size // PER_THREAD))

    def share(
        self,
        compute: "CFunction",
        count: int,
        arrays: Sequence[tuple[int, int]],
        parts: int,
        held: object,
    ) -> None:
        """Call a C function in several parts, on several threads; return when all have ended.

        Each thread takes a share of the samples; shares of a multiple of 16 fill blocks of either number
        type. `arrays` are pairs of an address and the bytes from one sample to the next. Each part holds
        `held`, the arrays themselves, so that their memory lasts as long as it runs.
        """
        share = -(-count // parts // 16) * 16

        def run(first: int, held: object = held) -> None:
            compute(min(share, count - first), *(start + first * step for start, step in arrays))

        first, *others = range(0, count, share)
        waiting: list[Future[None]] = []
        try:
            for start in others:
                try:
                    waiting.append(pool(self.threads).submit(run, start))
                except RuntimeError:  # Python is ending, and starts no threads any more
                    run(start)
            run(first)
        except BaseException:  # a signal, say
            for future in waiting:
                future.cancel()
            raise
        finally:
            wait(waiting)  # no part may write to memory that has been freed
        for future in waiting:
            future.result()

    def values(self, kind: NumberType) -> dict[str, Numbers]:
        """Return the parameters by name, as numbers of this dtype."""
        numbers = cast("Sequence[Numbers]", self.constants(kind))
        return dict(zip(self.structure.parameters, numbers, strict=True))

    def _numbers(self, kind: NumberType) -> NumberArray:
        """Return the parameters in the order of the structure; a tensor counts with its present value."""
        for name in self.structure.parameters:
            if shape_of(self.parameters[name]) != ():
                raise ValueError(
                    f"parameter {name!r} must be one number here; "
                    "the numpy and torch back ends take one per sample"
                )
        return np.array([_number(self.parameters[name]) for name in self.structure.parameters], dtype=kind)


def plain(a: NumberArray) -> NumberArray:
    """Return an array, or a copy of it that is contiguous and aligned, as C reads it."""
    return a if a.flags.c_contiguous and a.flags.aligned else np.array(a, order="C")


def _number(value: float | Numbers) -> float:
    """Return a parameter's present value, without its gradient."""
    return float(cast("Tensor", value).detach() if has_tensors([value]) else value)
