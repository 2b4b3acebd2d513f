"""Speed of `linkwise analyze` beside its own kernel and pyarrow, which it cannot do without.

    python tests/benchmarks/bench_analysis.py [URDF ...] [--samples N] [--rounds R] [--threads T]

Of each robot, Panda as example-robot-data has it unless given, with and without its fingers: the floor is the
kernel's full decomposition of all samples, on one thread, and pyarrow writing a table of as many columns from
memory, one after the other. Beside it stand analyses with all columns, with causes and with joint sums only,
in this process, from a log in Parquet and one in CSV, with a low-pass, by turns. Prints medians of rounds.
"""

import argparse
import os
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from bench_motion import write_log
from linkwise import Options, generate, read_system, write_package
from linkwise.analysis.contacts import Contacts
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.loads import Loads
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.outputs import open_table
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.result_rows import Column
from linkwise.analysis.run import analyze_to
from linkwise.analysis.settings import Lowpass, Processing, Reading
from linkwise.analysis.worker_threads import LIMIT
from linkwise.progress import silent

AT_ONCE = 4096
"""Samples of a call of the kernel."""
GROUP = 8192
"""Samples of a row group."""
PANDA = "cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf"
FINGERS = {"panda_finger_joint1": 0.02}
Timed = dict[str, Callable[[], None]]


def panda() -> Path:
    """Return the file of example-robot-data, beside where numpy is installed."""
    return Path(np.__file__).parents[1] / PANDA


def asked(columns: tuple[str, ...]) -> Request:
    """Return what is asked of a log: a low-pass and a table, no page."""
    outputs = replace(Outputs(), page=False, columns=columns)
    return Request(Reading(), Processing(lowpass=Lowpass(6.0)), outputs, Loads.of((), None), Contacts.of(()))


def floor_of(robot: OpenedRobot, columns: tuple[Column, ...], samples: int, place: Path) -> Timed:
    """Return the kernel and the writing of a table of these columns."""
    draw = np.random.default_rng(0)
    q, qd, qdd = draw.normal(size=(3, samples, len(robot.joints)))
    block = draw.normal(size=(len(columns), GROUP))

    def kernel() -> None:
        for at in range(0, samples, AT_ONCE):
            robot.model.packed(*(a[at : at + AT_ONCE] for a in (q, qd, qdd)))

    def writing() -> None:
        with open_table(place / "floor.parquet", columns, "{}") as write:
            for at in range(0, samples, GROUP):
                write(block[:, : samples - at])

    return {"kernel": kernel, "pyarrow": writing}


def runs(name: str, robot: OpenedRobot, samples: int, place: Path) -> tuple[Timed, int, float]:
    """Return all that is timed of a robot, the number of its columns, and bytes of the table."""
    log = place / f"{name}.csv"
    write_log(log, list(robot.joints), samples)
    names = ["time", *robot.joints]
    table = np.loadtxt(log, delimiter=",", skiprows=1)
    pq.write_table(pa.table(dict(zip(names, table.T, strict=True))), place / f"{name}.parquet")

    def analysis(suffix: str, *columns: str) -> Callable[[], None]:
        def run() -> None:
            analyze_to(place / "out", place / f"{name}{suffix}", robot, asked(columns), silent)

        return run

    analysis(".parquet")()
    written = (place / "out" / "analysis.parquet").stat().st_size
    every, _ = analyze_to(place / "out", log, robot, asked(()), silent)
    timed = floor_of(robot, every.columns, samples, place)
    for suffix in (".parquet", ".csv"):
        for preset in ("all", "causes", "sums"):
            timed[f"{preset} of {suffix}"] = analysis(suffix, preset)
    return timed, len(every.columns), written


def measured(timed: Timed, rounds: int, place: Path) -> dict[str, float]:
    """Return the median time of each in s, by turns; a former result is removed before."""
    found: dict[str, list[float]] = {name: [] for name in timed}
    for _ in range(rounds):
        for name, run in timed.items():
            shutil.rmtree(place / "out", ignore_errors=True)
            start = time.perf_counter()
            run()
            found[name].append(time.perf_counter() - start)
    return {name: statistics.median(times) for name, times in found.items()}


def main() -> None:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robots", type=Path, nargs="*")
    parser.add_argument("--samples", type=int, default=200_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument(
        "--threads", type=int, help="most threads that compute; one for each core if not given"
    )
    given = parser.parse_args()
    if given.threads:
        os.environ[LIMIT] = str(given.threads)
    made = [(file, Options()) for file in given.robots] or [
        (panda(), Options(lock=FINGERS)),
        (panda(), Options()),
    ]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for number, (file, options) in enumerate(made):
            package = place / f"robot{number}"
            write_package(generate(read_system(file, options), ["numpy", "native"]), package)
            robot = load_robot(package, "native")
            robot.model.backend.threads = 1
            timed, columns, written = runs(f"log{number}", robot, given.samples, place)
            took = measured(timed, given.rounds, place)
            floor = took["kernel"] + took["pyarrow"]
            print(f"{file.stem}: {len(robot.joints)} joints, {columns} columns, {written / 1e6:,.0f} MB")
            for name, seconds in took.items():
                speed = f"{given.samples / seconds:>12,.0f} samples/s"
                print(f"  {name:20} {seconds:7.2f} s {speed} {seconds / floor:6.2f} of kernel and pyarrow")


if __name__ == "__main__":
    main()
