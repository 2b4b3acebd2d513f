"""Cost of a part of a torque when only its graph runs, beside the whole torque's graph.

    python tests/benchmarks/graph_cost.py DIR/NAME [JOINT LINK]

One thread, batch 1,024, float64, least of some rounds by turns; joint and link count from 1.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import torch
from linkwise.package.load import import_package

ROUNDS, BATCH = 20, 1024


def main() -> None:
    """Print a row for each part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("package", type=Path)
    parser.add_argument("joint", type=int, nargs="?", default=1)
    parser.add_argument("link", type=int, nargs="?", default=0)
    given = parser.parse_args()
    torch.set_num_threads(1)
    robot = import_package(given.package).load("autograd")
    i, j = given.joint - 1, (given.link or robot.N) - 1
    motion = torch.randn(3, BATCH, robot.n, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    graphs = {"torque": robot.graph(i, j)}
    graphs |= {f"order {part.order} of {part.coordinate}": part for part in robot.graph_parts(i, j)}
    best = dict.fromkeys(graphs, float("inf"))
    for _ in range(ROUNDS):
        for name, graph in graphs.items():
            best[name] = min(best[name], seconds(graph, motion))
    whole = graphs["torque"]
    print(f"{'part':<28} {'operations':>10} {'share':>6} {'us':>8} {'share':>6}")
    for name, graph in graphs.items():
        operations, time_of = len(graph.operations), best[name]
        share, of_time = operations / len(whole.operations), time_of / best["torque"]
        print(f"{name:<28} {operations:>10} {share:>6.2f} {1e6 * time_of:>8.0f} {of_time:>6.2f}")


def seconds(graph: Any, motion: torch.Tensor) -> float:
    """Time of one evaluation."""
    start = time.perf_counter()
    graph.evaluate(*motion)
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
