"""The generated package, called from Python beside Pinocchio: what each back end and call costs."""

import inspect
from collections.abc import Callable, Iterator
from copy import copy
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np

from speed import pinocchio_peer
from speed.emitted import MOST_BYTES, Figure
from speed.package import Package
from speed.rounds import by_turns

DENSE = ("partial_torque", "coefficients", "propagation")
"""Calls whose answers are written with their zeros."""
Key = tuple[str, str, int, int, str]
"""Through what, number type, batch, threads, call."""


def measure(
    package: Package, largest: int, seconds: float, everything: bool
) -> tuple[list[Figure], dict[str, float]]:
    """Time the back ends, and for one sample Pinocchio's own calls, by turns; of these, nanoseconds by name.

    everything: the slow back ends at the largest batch, too
    """
    import torch

    torch.set_num_threads(1)
    figures: list[Figure] = []
    peers: dict[str, float] = {}
    for batch in sorted({1, min(1024, largest), largest}):
        slow = batch <= 1024 or everything
        calls = {key: call for robots in loaded(package) for key, call in timed(package, robots, batch, slow)}
        theirs: dict[str, Callable[[], Any]] = {}
        if batch == 1:
            try:
                theirs = pinocchio_peer.calls_from_python(package)
            except (ImportError, ValueError):
                theirs = {}
        named = {str(key): call for key, call in calls.items()}
        # Quick calls and slow ones apart: these would leave no cache to the quick ones.
        quick = {str(key): call for key, call in calls.items() if key[0].startswith("native")}
        others = {name: call for name, call in named.items() if name not in quick}
        found = by_turns({**quick, **theirs}, seconds) | by_turns(others, seconds)
        peers |= {name: found[name] for name in theirs}
        for (through, dtype, size, threads, call), name in zip(calls, named, strict=True):
            ns = found[name] / size
            figures.append(Figure(package.name, through, dtype, "rows", size, threads, ns, call))
    return figures, peers


def loaded(package: Package) -> Iterator[tuple[str, Any]]:
    """Back ends by what they are called here, those with a choice of kernels once for each."""
    module = package.module()
    choice = "kernel" in inspect.signature(module.load).parameters
    for backend in module.BACKENDS:
        if choice and backend in ("numpy", "torch"):
            for kernel in ("straight", "rule"):
                try:
                    robot = module.load(backend, kernel=kernel)
                except ValueError:  # a package may have one of them only
                    continue
                yield (backend if kernel == "straight" else f"{backend} {kernel}"), robot
        else:
            yield backend, module.load(backend)
    if "native" in module.BACKENDS:
        yield "native ctypes", without_compiled_module(module)


def without_compiled_module(module: ModuleType) -> Any:
    """`native` as it is where Python's headers are missing."""
    binding = import_module("linkwise_runtime.native.compiled_calls")
    with patch.object(binding, "headers", tuple):
        binding.compiled_calls.cache_clear()
        robot = module.load("native")
    binding.compiled_calls.cache_clear()
    return robot


def timed(
    package: Package, named: tuple[str, Any], batch: int, slow: bool
) -> Iterator[tuple[Key, Callable[[], Any]]]:
    """Calls of one back end at a batch: all on `native`, `packed` on the others."""
    through, robot = named
    native = through.startswith("native")
    if through == "native ctypes" and batch > 1:
        return
    if not native and (not slow or (through == "autograd" and batch > 1024)):
        return
    for dtype, width in (("float64", 8), ("float32", 4)):
        motion = sample(package, batch, dtype, robot.backend.takes_tensors)
        for call in ("packed", *DENSE) if native else ("packed",):
            if batch * width * values(package, call) > MOST_BYTES or (call in DENSE and dtype == "float32"):
                continue
            given = motion[: 2 if call == "coefficients" else 3]
            for threads in (1, 2) if native and batch > 1 and call == "packed" else (1,):
                method = getattr(on_threads(robot, threads) if native else robot, call)
                yield (through, dtype, batch, threads, call), partial(method, *given)
            if "out" in inspect.signature(method).parameters and call in DENSE and batch > 1:
                yield (through, dtype, batch, 1, f"{call} out"), partial(method, *given, out=method(*given))


def on_threads(robot: Any, threads: int) -> Any:
    """The native back end on so many threads, another robot where they are several."""
    robot = robot if threads == 1 else copy(robot)
    robot.backend.threads = threads
    return robot


def values(package: Package, call: str) -> int:
    """Numbers of one sample that a call writes."""
    n, links = package.sizes["JOINTS"], len(package.manifest["links"])
    dense = n * links * (2 * n + 1)
    return {"packed": package.outputs, "partial_torque": n * links}.get(call, dense)


def sample(package: Package, batch: int, dtype: str, tensors: bool) -> list[Any]:
    """A random motion; one sample is rows of no batch."""
    draw = np.random.default_rng(1)
    shape = (batch, package.sizes["JOINTS"]) if batch > 1 else (package.sizes["JOINTS"],)
    motion = [draw.uniform(-2, 2, shape).astype(dtype) for _ in range(3)]
    if not tensors:
        return motion
    import torch

    return [torch.from_numpy(a) for a in motion]
