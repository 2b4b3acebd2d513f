"""Time of induced accelerations beside OpenSim's analysis of the same log, in one process, one by one.

    python tests/benchmarks/bench_induced.py [--samples N] [--actuators N]

The model is the one of tests/helpers/induced_setup.py, ten coordinates and four bodies, with as many path
actuators as OpenSim's Gait2392 has muscles; 0 stands for one torque at each coordinate. Nothing is held, for
OpenSim loses the constraints of a setup. Both read the same setup, and write a storage file for each
coordinate and the centre of mass. OpenSim solves once for each actuator, linkwise for each coordinate. Prints
seconds, microseconds a sample, and their ratio.
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
from helpers.induced_setup import COORDINATES, MODEL, SETUP, motion, write_storage
from linkwise import kept_package
from linkwise.analysis.choices import AnalysisChoices
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.opensim.setup import read_setup
from linkwise.analysis.run import analyze_to
from linkwise.option import chosen
from linkwise.progress import silent

FORCES = '<OpenSimDocument Version="40500"><ForceSet><objects>{}</objects></ForceSet></OpenSimDocument>'
TORQUE = (
    '<CoordinateActuator name="motor_{0}"><coordinate>{0}</coordinate><optimal_force>1</optimal_force>'
    "</CoordinateActuator>"
)
POINT = (
    '<PathPoint name="on_{1}"><socket_parent_frame>/bodyset/body{1}</socket_parent_frame>'
    "<location>0.1 0.0{0} 0.2</location></PathPoint>"
)
PATH = (
    '<PathActuator name="muscle_{0}"><GeometryPath name="path"><PathPointSet><objects>{1}</objects>'
    "</PathPointSet></GeometryPath><optimal_force>1</optimal_force></PathActuator>"
)
MUSCLES = 92
WARM = 500
"""Samples of a log that is analysed before, so that libraries are there."""


def forces(count: int) -> str:
    """Return a force set of path actuators, each over one joint; or of torques, for none."""
    if not count:
        return FORCES.format("".join(map(TORQUE.format, COORDINATES)))
    ends = ((number, number % 3) for number in range(count))
    return FORCES.format(
        "".join(PATH.format(n, POINT.format(n, k) + POINT.format(n, k + 1)) for n, k in ends)
    )


def write_case(folder: Path, samples: int, actuators: int) -> Path:
    """Write the model, a motion of it, actuators and the setup into a folder."""
    folder.mkdir()
    (folder / "leg.osim").write_text(MODEL)
    write_storage(folder / "walk.sto", motion(samples), COORDINATES)
    (folder / "forces.xml").write_text(forces(actuators))
    text = SETUP.format(constraints="", loads="", bodies="")
    for old, new in (
        ("0.2</initial", "0</initial"),
        ("1.2</final", "1e9</final"),
        ("<states_file/>", "<force_set_files>forces.xml</force_set_files>"),
    ):
        text = text.replace(old, new)
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
    """Return the seconds of OpenSim's tool, which reads the log, computes and writes."""
    osim.Logger.setLevelString("Off")
    osim.Logger.removeFileSink()
    with contextlib.chdir(setup.parent), quiet():
        tool = osim.AnalyzeTool(str(setup))
        start = time.perf_counter()
        tool.run()
        seconds = time.perf_counter() - start
    written = len(list((setup.parent / "results").glob("*.sto")))
    assert written == len(COORDINATES) + 1
    return seconds


def by_linkwise(setup: Path) -> float:
    """Return the seconds of an analysis, which reads the log, computes and writes; the package is there."""
    asked = read_setup(setup)
    robot = load_robot(kept_package(asked.robot).directory)
    request = chosen(AnalysisChoices, {**asked.options, "page": False, "format": "none"}).request(robot)
    start = time.perf_counter()
    analyze_to(setup.parent / "out", asked.log, robot, request, silent)
    return time.perf_counter() - start


def main() -> None:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--samples", type=int, default=1_000)
    parser.add_argument("--actuators", type=int, default=MUSCLES)
    given = parser.parse_args()
    tools = {"OpenSim": by_opensim, "linkwise": by_linkwise}
    with tempfile.TemporaryDirectory() as folder:
        warm, setup = (
            write_case(Path(folder, name), samples, given.actuators)
            for name, samples in (("warm", WARM), ("timed", given.samples))
        )
        for tool in tools.values():
            tool(warm)
        taken = {name: tool(setup) for name, tool in tools.items()}
    for name, seconds in taken.items():
        each = 1e6 * seconds / given.samples
        print(f"{name:9} {given.samples:,} samples in {seconds:.2f} s, {each:.1f} µs a sample")
    print(f"{np.divide(*taken.values()):.0f} times as fast")


if __name__ == "__main__":
    main()
