"""The generated package, called from Python: what each back end costs."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from speed.emitted import MOST_BYTES, Figure
from speed.package import Package

SLOW = {"numpy": 1024, "torch": 1024, "autograd": 1024}
"""Largest batch of the back ends that walk through the operations one by one."""


def best(call: Callable[[], Any], seconds: float) -> float:
    """Least time of one call, in nanoseconds: of a few calls, or of as many as the seconds hold."""
    call()
    start = time.perf_counter_ns()
    call()
    least = time.perf_counter_ns() - start
    inner = max(1, int(2e5 / least))
    left = max(2, int(1e9 * seconds / (inner * least)))
    for _ in range(min(left, 2000)):
        start = time.perf_counter_ns()
        for _ in range(inner):
            call()
        least = min(least, (time.perf_counter_ns() - start) // inner)
    return float(least)


def measure(
    package: Package, largest: int, seconds: float, everything: bool
) -> tuple[list[Figure], list[str]]:
    """Time `packed` on every back end; also returns notes about those that are not there."""
    import torch

    figures, notes = [], []
    module = package.module()
    for backend in ("native", "numpy", "torch", "autograd"):
        if backend not in module.BACKENDS:
            notes.append(f"{package.name}: no back end {backend} in this package")
            continue
        robot = module.load(backend)
        top = largest if backend == "native" or (everything and backend != "autograd") else SLOW[backend]
        for dtype in ("float64", "float32"):
            for batch in sorted({1, min(1024, top), top}):
                if batch * package.outputs * 8 > MOST_BYTES:
                    continue
                for threads in (1, 2) if backend == "native" and batch > 1 else (1,):
                    torch.set_num_threads(threads)
                    if backend == "native":
                        robot.backend.threads = threads
                    motion = sample(package, batch, dtype)
                    if robot.backend.takes_tensors:
                        motion = [torch.from_numpy(a) for a in motion]
                    ns = best(lambda robot=robot, motion=motion: robot.packed(*motion), seconds) / batch
                    figures.append(Figure(package.name, backend, dtype, "rows", batch, threads, ns))
    return figures, notes


def sample(package: Package, batch: int, dtype: str) -> list[Any]:
    """A random motion."""
    draw = np.random.default_rng(1)
    return [draw.uniform(-2, 2, (batch, package.sizes["JOINTS"])).astype(dtype) for _ in range(3)]
