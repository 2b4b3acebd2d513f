"""Rates of `linkwise study` beside plain `linkwise analyze`, of Panda, taken in turns.

    python tests/benchmarks/bench_study.py [--samples N] [--trials T] [--rounds R]

Writes T (4) logs of N (300,000) samples as Parquet. A round is: one log by `analyze`, which keeps all its
columns; a study of all logs with all columns by one worker; one that keeps joint torques only, by one worker
and by one for each core. Prints samples a second, median of R (3) rounds, and the largest resident memory of
a process. The first run of all, which compiles, is not counted.
"""

import argparse
import resource
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

JOINTS = [f"panda_joint{k}" for k in range(1, 8)]
CENTRE = np.array([0, 0, 0, -1.5, 0, 1.5, 0])
LINKWISE = (sys.executable, "-m", "linkwise")
PANDA = Path(sysconfig.get_path("purelib")) / (
    "cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf"
)
LOCK = ("panda_finger_joint1", "panda_finger_joint2")
STUDY = """schema = 1
pages = {pages}
columns = {columns}
[analysis]
units = "rad"
[[trial]]
name = "{{k}}"
log = "logs/{{k}}.parquet"
robot = "panda"
"""


def write_log(path: Path, samples: int, number: int) -> None:
    """Sines of unlike frequencies at 1 kHz."""
    t = np.arange(samples) / 1000
    q = CENTRE + 0.5 * np.sin((0.5 + 0.13 * np.arange(7) + 0.01 * number) * t[:, None] + np.arange(7))
    pq.write_table(pa.table({"time": t, **dict(zip(JOINTS, q.T, strict=True))}), path)


def seconds(*arguments: str, folder: Path) -> float:
    """Return the seconds of one command from beginning to end, and remove what it writes to `out`."""
    began = time.perf_counter()
    subprocess.run([*LINKWISE, *arguments, "--out", "out"], cwd=folder, check=True, capture_output=True)
    took = time.perf_counter() - began
    shutil.rmtree(folder / "out")
    return took


def runs(trials: int) -> dict[str, tuple[int, tuple[str, ...]]]:
    """Logs that each run is of, and its arguments."""
    one, cores = ("--workers", "1"), ()
    return {
        "analyze, one log, all columns": (1, ("analyze", "logs/0.parquet", "--robot", "panda")),
        "study, all columns, 1 worker": (trials, ("study", "all.toml", *one)),
        "study, all columns, all cores": (trials, ("study", "all.toml", *cores)),
        "study, torques, 1 worker": (trials, ("study", "torques.toml", *one)),
        "study, torques, all cores": (trials, ("study", "torques.toml", *cores)),
    }


def main() -> None:
    """Prepare, run in turns, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=300_000)
    parser.add_argument("--trials", type=int, default=4)
    parser.add_argument("--rounds", type=int, default=3)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "logs").mkdir()
        for number in range(chosen.trials):
            write_log(folder / f"logs/{number}.parquet", chosen.samples, number)
        locks = [text for joint in LOCK for text in ("--lock", f"{joint}=0")]
        command = (*LINKWISE, "generate", str(PANDA), *locks, "--name", "panda", "--out", ".")
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        (folder / "all.toml").write_text(STUDY.format(pages="true", columns='["**"]'))
        (folder / "torques.toml").write_text(STUDY.format(pages="false", columns='["tau/*"]'))
        seconds("analyze", "logs/0.parquet", "--robot", "panda", folder=folder)
        rates: dict[str, list[float]] = {name: [] for name in runs(chosen.trials)}
        for _ in range(chosen.rounds):
            for name, (logs, arguments) in runs(chosen.trials).items():
                rates[name].append(logs * chosen.samples / seconds(*arguments, folder=folder))
    plain = median(next(iter(rates.values())))
    print("| run | samples/s | of the plain analysis |\n|---|---|---|")
    for name, found in rates.items():
        print(f"| {name} | {median(found):,.0f} | {median(found) / plain:.2f} |")
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"largest resident memory of a process: {memory:,.0f} MiB")


if __name__ == "__main__":
    main()
