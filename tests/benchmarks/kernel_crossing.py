"""The kernels of NumPy and torch beside each other: which is quicker, by robot and batch.

    python tests/benchmarks/kernel_crossing.py             # some fifteen minutes
    python tests/benchmarks/kernel_crossing.py --batches 1 64 1024 --robots planar3 panda

Prints the seconds of every pair, interleaved, the shortest of several rounds, one thread: closed forms and
the rule, for one sample without an axis of samples (batch 0) and for batches; and the rule in spatial
matrices and with its samples innermost. At its end stand the tables that `numpy_backend.py` and
`torch_backend.py` keep: for robots of so many operations or more the largest batch up to which the rule was
quicker in every one, and the links times samples up to which its matrices were.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import torch
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from speed.cases import built_in, chain_file, shipped

FINGERS = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
ROBOTS: dict[str, tuple[Callable[[Path], str], Options]] = {
    "planar2": (built_in("planar2"), Options()),
    "planar3": (built_in("planar3"), Options()),
    "planar10": (built_in("planar10"), Options()),
    "planar20": (built_in("planar20"), Options()),
    "puma560": (built_in("puma560"), Options()),
    "panda": (shipped("panda.urdf"), Options(lock=FINGERS)),
    **{f"chain{n}": (chain_file(n), Options()) for n in (4, 10, 14, 20)},
}
TABLES = {"packed": "decomposition", "packed_torque": "torque", "position_gradient": "position_gradient"}
BATCHES = (1, 4, 16, 32, 64, 128, 256, 512, 1024)
LEAST = 0.02
"""Seconds that a round takes at least."""
Pair = tuple[int, Callable[[], Any], Callable[[], Any]]
"""A batch and two calls for it."""


def shortest(calls: Sequence[Callable[[], Any]], rounds: int) -> list[float]:
    """Seconds of each call, the shortest of some rounds in which they take turns."""
    best = [float("inf")] * len(calls)
    for _ in range(rounds):
        for number, call in enumerate(calls):
            start, count = time.perf_counter(), 0
            while not count or time.perf_counter() - start < LEAST / 4:
                call()
                count += 1
            best[number] = min(best[number], (time.perf_counter() - start) / count)
    return best


def motion_of(backend: str, batch: int, n: int) -> list[Any]:
    """Random motion; batch 0 is one sample without an axis of samples."""
    motion = np.random.default_rng(0).uniform(-2.0, 2.0, (3, batch, n) if batch else (3, n))
    return [torch.from_numpy(a) for a in motion] if backend == "torch" else list(motion)


def quicker(name: str, backend: str, pairs: Sequence[Pair], rounds: int) -> dict[int, bool]:
    """Return whether the second of each pair of calls is quicker, by batch, and print them."""
    found = {}
    for batch, first, second in pairs:
        one, other = shortest((first, second), rounds)
        print(f"{backend:6} {name:18} {batch:6}  {one:9.2e} {other:9.2e}  {one / other:6.2f}", flush=True)
        found[batch] = other < one
    return found


def kernels(package: ModuleType, backend: str, call: str, batches: Sequence[int]) -> Iterator[Pair]:
    """Closed forms and the rule."""
    robots = [package.load(backend, kernel=kernel) for kernel in ("straight", "rule")]
    for batch in (0, *batches):
        motion = motion_of(backend, batch, robots[0].n)
        first, second = (partial(getattr(robot, call), *motion) for robot in robots)
        yield batch, first, second


def forms_of_the_rule(package: ModuleType, backend: str, batches: Sequence[int]) -> Iterator[Pair]:
    """The rule with samples innermost and in spatial matrices."""
    robot = package.load(backend, kernel="rule")

    def told(few: bool, motion: Sequence[Any]) -> Any:
        type(robot.backend).few = lambda self, samples, links: few
        return robot.packed(*motion)

    for batch in batches:
        motion = motion_of(backend, batch, robot.n)
        yield batch, partial(told, False, motion), partial(told, True, motion)


def largest(found: Mapping[int, bool]) -> int:
    """The largest batch up to which all are quicker, 0 for none."""
    most = 0
    for batch in sorted(set(found) - {0}):
        if not found[batch]:
            break
        most = batch
    return most


def rows(found: Sequence[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    """(size, batch) of robots as rows that hold for all larger ones, too."""
    kept: list[tuple[int, int]] = []
    ordered = sorted(found)
    for at, (size, _) in enumerate(ordered):
        least = min(most for _, most in ordered[at:])
        if least > (kept[-1][1] if kept else 0):
            kept.append((size, least))
    return tuple(kept)


def alone(found: Sequence[tuple[int, bool]]) -> int:
    """Operations from which on the rule was quicker for one sample."""
    slower = [size for size, quick in found if not quick]
    return min(size for size, quick in [*found, (10**9, True)] if quick and size > max(slower, default=0))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), choices=list(ROBOTS))
    parser.add_argument("--batches", nargs="+", type=int, default=BATCHES)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    straight: dict[tuple[str, str], list[tuple[int, dict[int, bool]]]] = {}
    matrices: dict[str, dict[int, bool]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.robots:
            make, options = ROBOTS[name]
            system = read_system(make(Path(folder)), options)
            directory = Path(folder) / name
            write_package(generate(system, ["numpy", "torch"], name, kernel="straight"), directory)
            package = import_package(directory)
            loaded = package.load("numpy").backend
            operations, links = loaded.operations, loaded.structure.N
            print(f"{name}: {dict(operations)} operations; seconds of the first, of the second, their ratio")
            for backend in ("numpy", "torch"):
                for call, table in TABLES.items():
                    pairs = list(kernels(package, backend, call, arguments.batches))
                    found = quicker(call, backend, pairs, arguments.rounds)
                    straight.setdefault((backend, table), []).append((operations[table], found))
                pairs = list(forms_of_the_rule(package, backend, arguments.batches))
                found = quicker("packed, matrices", backend, pairs, arguments.rounds)
                sizes = matrices.setdefault(backend, {})
                for batch, quick in found.items():
                    sizes[links * batch] = quick and sizes.get(links * batch, True)
    for (backend, table), robots in straight.items():
        least = alone([(size, found[0]) for size, found in robots])
        print(f'{backend} "{table}": Crossing({least}, {rows([(n, largest(f)) for n, f in robots])}),')
    for backend, sizes in matrices.items():
        print(f"{backend} MATRICES = {largest(sizes)}")


if __name__ == "__main__":
    main()
