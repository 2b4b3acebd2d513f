"""Time of induced accelerations beside OpenSim's analysis of the same log, both in this process, one by one.

    python tests/benchmarks/bench_induced.py [--samples N]

The model is the one of tests/helpers/induced_setup.py, ten coordinates and four bodies, each coordinate with
an actuator, nothing held: OpenSim loses constraints of a setup. Both write a storage file for each
coordinate, each body and the centre of mass. Prints seconds, microseconds a sample, and their ratio.
"""

import argparse
import contextlib
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import opensim as osim
from helpers.induced_setup import BODIES, COORDINATES, MODEL, SETUP, motion, write_storage
from linkwise import kept_package
from linkwise.analysis.choices import AnalysisChoices
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.opensim.setup import read_setup
from linkwise.analysis.run import analyze_to
from linkwise.option import chosen
from linkwise.progress import silent

ACTUATORS = "<OpenSimDocument Version='40000'><ForceSet><objects>{}</objects></ForceSet></OpenSimDocument>"
ACTUATOR = (
    '<CoordinateActuator name="motor_{0}"><coordinate>{0}</coordinate><optimal_force>1</optimal_force>'
    "</CoordinateActuator>"
)


def write_case(folder: Path, samples: int, bodies: int = 0) -> Path:
    """Write the model, a motion of it, actuators and the setup into a folder."""
    (folder / "leg.osim").write_text(MODEL)
    write_storage(folder / "walk.sto", motion(samples), COORDINATES)
    (folder / "motors.xml").write_text(ACTUATORS.format("".join(map(ACTUATOR.format, COORDINATES))))
    text = SETUP.format(constraints="", loads="", bodies=" ".join(BODIES[:bodies]))
    text = text.replace("1.2</final_time>", "1e9</final_time>").replace(
        "0.2</initial_time>", "0</initial_time>"
    )
    text = text.replace("<states_file/>", "<force_set_files>motors.xml</force_set_files>")
    (folder / "setup.xml").write_text(text)
    return folder / "setup.xml"


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Send what OpenSim prints of each sample nowhere."""
    kept = os.dup(1)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        yield
    os.dup2(kept, 1)


def by_opensim(setup: Path) -> float:
    """Return the seconds of OpenSim's tool, which reads, computes and writes."""
    osim.Logger.setLevelString("Off")
    osim.Logger.removeFileSink()
    with contextlib.chdir(setup.parent), quiet():
        tool = osim.AnalyzeTool(str(setup))
        start = time.perf_counter()
        tool.run()
        return time.perf_counter() - start


def by_linkwise(setup: Path) -> float:
    """Return the seconds of an analysis, which reads, computes and writes; the package is there."""
    asked = read_setup(setup)
    robot = load_robot(kept_package(asked.robot).directory)
    start = time.perf_counter()
    request = chosen(AnalysisChoices, {**asked.options, "page": False, "format": "none"}).request(robot)
    analyze_to(setup.parent / "out", asked.log, robot, request, silent)
    return time.perf_counter() - start


def main() -> None:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--samples", type=int, default=10_000)
    samples = parser.parse_args().samples
    with tempfile.TemporaryDirectory() as folder:
        setup = write_case(Path(folder), samples)
        taken = {"OpenSim": by_opensim(setup), "linkwise": by_linkwise(setup)}
        written = len(list((Path(folder) / "results").glob("*.sto")))
        assert written == len(COORDINATES) + 1
    for name, seconds in taken.items():
        print(f"{name:9} {samples:,} samples in {seconds:.2f} s, {1e6 * seconds / samples:.1f} µs a sample")
    print(f"{np.divide(*taken.values()):.0f} times as fast")


if __name__ == "__main__":
    main()
