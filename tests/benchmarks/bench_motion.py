"""Time and memory of `linkwise analyze` on long logs; each run is a process of its own.

    python tests/benchmarks/bench_motion.py million ROBOT_DIRECTORY [--samples N]
    python tests/benchmarks/bench_motion.py ten-hours ROBOT_DIRECTORY

The first writes a smooth synthetic log of N samples (1,000,000) as CSV and analyses it to Parquet, with
the page and the five-panel figure; the second does so for 10 h at 100 Hz, filtered. Prints seconds, samples
a second, the largest resident memory and the size of what was written.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

BLOCK = 100_000
RATE = 100.0


def write_log(path: Path, joints: list[str], samples: int) -> None:
    """A log of sines of unlike frequencies, CSV, a column a joint."""
    pace = 0.3 + 0.17 * np.arange(len(joints))
    with path.open("w", encoding="utf-8") as handle:
        handle.write(",".join(["time", *joints]) + "\n")
        for start in range(0, samples, BLOCK):
            t = np.arange(start, min(start + BLOCK, samples)) / RATE
            rows = np.column_stack([t, np.sin(2 * np.pi * pace * t[:, None])])
            np.savetxt(handle, rows, fmt=["%.2f"] + ["%.9f"] * len(joints), delimiter=",")


def measure(robot: Path, samples: int, options: list[str]) -> None:
    """Analyse a synthetic log in a process of its own and print what it took."""
    manifest = json.loads((robot / "manifest.json").read_text(encoding="utf-8"))
    joints = [joint["name"] for joint in manifest["joints"]]
    with tempfile.TemporaryDirectory() as place:
        log, out = Path(place, "log.csv"), Path(place, "out")
        write_log(log, joints, samples)
        command = [sys.executable, "-m", "linkwise", "analyze", str(log), "--robot", str(robot)]
        start = time.perf_counter()
        done = subprocess.run(
            [*command, "--out", str(out), *options], check=True, capture_output=True, text=True
        )
        seconds = time.perf_counter() - start
        memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
        size = sum(file.stat().st_size for file in out.iterdir()) / 1e6
        print(done.stdout.splitlines()[0])
        print(
            f"{manifest['name']}: {samples:,} samples, {seconds:.1f} s, {samples / seconds:,.0f}"
            f" samples/s, {memory:,.0f} MiB resident at most, {size:,.0f} MB written"
        )


def main() -> None:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("million", "ten-hours"))
    parser.add_argument("robot", type=Path)
    parser.add_argument("--samples", type=int)
    arguments = parser.parse_args()
    if arguments.what == "million":
        measure(arguments.robot, arguments.samples or 1_000_000, ["--figure", "paper"])
    else:
        samples = arguments.samples or int(10 * 3600 * RATE)
        measure(arguments.robot, samples, ["--cutoff", "6", "--no-page"])


if __name__ == "__main__":
    main()
