"""Term counts against their limits: planar arms to 30 joints, and the Panda arm with symbolic inertias."""

import resource
import time
from importlib.metadata import files
from pathlib import Path

from linkwise.pipeline import read_system
from linkwise.progress import silent
from linkwise.report import RunningCount, link_torques
from linkwise.robot import Options

BUDGET = 10**7


def panda() -> Path:
    """URDF of the arm, out of the package example-robot-data."""
    listed = files("example-robot-data") or []
    return Path(str(next(f for f in listed if f.name == "panda.urdf").locate())).resolve()


def count(robot: str | Path, joints: int, tip: str | None = None) -> int:
    """Terms of the first joints' torques, every link expanded."""
    system = read_system(robot, Options(parameters="nonzero", tip=tip))
    sums = [RunningCount(len(system.coordinates)) for _ in range(joints)]
    for found in link_torques(system, tuple(range(joints)), BUDGET, silent):
        for i, torque in found.torques.items():
            sums[i].add(torque, found.variables)
    return sum(running.count.total for running in sums)


def main() -> None:
    """Print one line a figure: what, terms, seconds, limit."""
    arm = panda()
    for what, limit, arguments in (
        ("planar 1..10, all tau_1j", 5.0, ("planar10", 1)),
        ("planar 1..30, all tau_1j", 60.0, ("planar30", 1)),
        ("panda, all tau_1j", 10.0, (arm, 1, "panda_link7")),
        ("panda, all tau_ij", 60.0, (arm, 7, "panda_link7")),
    ):
        started = time.perf_counter()
        terms = count(*arguments)
        seconds = time.perf_counter() - started
        print(f"{what:<28} {terms:>9,} terms {seconds:7.2f} s (limit {limit:g} s)")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{'peak memory of all':<28} {peak:15.2f} GB (limit 2 GB)")


if __name__ == "__main__":
    main()
