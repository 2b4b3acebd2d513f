"""Closed forms beside the vectorised rule: which is quicker, by robot and batch, in NumPy and in torch.

    python tests/benchmarks/kernel_crossing.py             # some ten minutes
    python tests/benchmarks/kernel_crossing.py --batches 1 64 1024 --robots planar3 panda

Prints the seconds of every pair, interleaved, the shortest of several rounds, and at its end the tables that
`numpy_backend.py` and `torch_backend.py` keep: for each call and robot the largest batch up to which the
rule was quicker in every one, one thread. What is kept is the least of the robots of a size: a planar arm
has so few operations that its closed forms win early.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
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
CALLS = ("packed", "packed_torque", "position_gradient")
TABLES = {"packed": "decomposition", "packed_torque": "torque", "position_gradient": "position_gradient"}
BATCHES = (1, 4, 16, 64, 256, 1024, 4096)
LEAST = 0.02
"""Seconds that a round takes at least."""


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


def crossing(package: ModuleType, backend: str, call: str, batches: Sequence[int], rounds: int) -> int:
    """Largest batch up to which the rule is quicker, 0 for none; prints every pair."""
    robots = [package.load(backend, kernel=kernel) for kernel in ("straight", "rule")]
    most, ahead = 0, True
    for batch in batches:
        motion: Any = np.random.default_rng(0).uniform(-2.0, 2.0, (3, batch, robots[0].n))
        motion = [torch.from_numpy(a) for a in motion] if backend == "torch" else list(motion)
        timed = [partial(getattr(robot, call), *motion) for robot in robots]
        straight, rule = shortest(timed, rounds)
        print(
            f"{backend:6} {call:18} {batch:6}  {straight:9.2e} {rule:9.2e}  {straight / rule:6.2f}",
            flush=True,
        )
        ahead = ahead and rule < straight
        most = batch if ahead else most
    return most


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), choices=list(ROBOTS))
    parser.add_argument("--batches", nargs="+", type=int, default=BATCHES)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    rows: dict[tuple[str, str], list[tuple[int, int]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.robots:
            make, options = ROBOTS[name]
            directory = Path(folder) / name
            write_package(
                generate(read_system(make(Path(folder)), options), ["numpy", "torch"], name, kernel="straight"),
                directory,
            )
            package = import_package(directory)
            numbers = sum(package.load("numpy").backend.structure.sizes)
            print(
                f"{name}: {numbers} packed numbers; seconds of closed forms and of the rule, and their ratio"
            )
            for backend in ("numpy", "torch"):
                for call in CALLS:
                    most = crossing(package, backend, call, arguments.batches, arguments.rounds)
                    rows.setdefault((backend, TABLES[call]), []).append((numbers, most))
    for (backend, call), found in rows.items():
        rows_of = ", ".join(f"({numbers}, {most})" for numbers, most in sorted(found))
        print(f'{backend} "{call}": ({rows_of}),')


if __name__ == "__main__":
    main()
