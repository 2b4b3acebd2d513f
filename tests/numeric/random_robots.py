"""Random robots, each link beside a Pinocchio model of it alone: `make random`.

A robot is named by its seed; `--first SEED --count 1 --show` runs one again and prints its file.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from random import Random
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from fuzz.valid_robots import RobotData, random_robot
from helpers.answers import random_states
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

from numeric.random_pinocchio import RandomOracle

LIMIT = 1e-10
"""Largest error allowed, relative to the largest number of its kind."""
STATES = 5
MOST_JOINTS = 15
REDUNDANT = Options(allow_unphysical=True)
"""Some robots can move coordinates together without moving a mass, which is refused else."""


def largest_error(robot: RobotData, folder: Path) -> float:
    """Error of c2, c1, g and τ of every link by both kernels, relative to the largest of the robot's of the
    kind.

    A kind that is all but zero, gravity of a level slide say, is measured by the largest of every kind, and
    a robot whose numbers are all but zero, a mass that only turns about itself say, by its mass.
    """
    path = folder / f"robot.{robot.form}"
    path.write_text(robot.text, encoding="utf-8")
    package = generate(read_system(path, REDUNDANT), ["numpy"], "robot", kernel="straight")
    write_package(package, folder / "robot")
    package = import_package(folder / "robot")
    oracle = RandomOracle(robot, package.joint_names)
    states = q, qd, qdd = random_states(len(package.joint_names), STATES)
    expected = oracle.decomposition(package.link_names, *states)
    largest = max(float(np.abs(value).max()) for value in expected.values())
    scale = 1e-3 * max(largest, sum(link.mass for link in robot.links))
    errors = []
    for kernel in ("straight", "rule"):
        dynamics = package.load("numpy", kernel=kernel)
        given = dynamics.coefficients(q, qd)._asdict() | {"torque": dynamics.partial_torque(q, qd, qdd)}
        errors += [
            float(np.abs(given[field] - value).max() / max(np.abs(value).max(), scale))
            for field, value in expected.items()
        ]
    return max(errors)


def drawn(seed: int) -> RobotData:
    """The robot of a seed: 1 to 15 joints."""
    return random_robot(Random(seed), 1 + seed % MOST_JOINTS)


def features(robot: RobotData) -> Counter[str]:
    """Return what a robot has: its joint types, branches, mimic joints, massless links."""
    parents = Counter(joint.parent for joint in robot.joints)
    there = {joint.type for joint in robot.joints} | {robot.form}
    there |= {"branch"} if max(parents.values()) > 1 else set()
    there |= {"mimic"} if any(joint.mimic for joint in robot.joints) else set()
    there |= {"massless link"} if any(not link.mass for link in robot.links[1:]) else set()
    return Counter(there)


def main() -> int:
    """Run the robots; exit status 1 if one is off by more than the limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="seed of the first robot")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--show", action="store_true", help="print each robot's file")
    arguments = parser.parse_args()
    errors: dict[int, float] = {}
    seen: Counter[str] = Counter()
    start = time.perf_counter()
    for seed in range(arguments.first, arguments.first + arguments.count):
        robot = drawn(seed)
        seen += features(robot)
        if arguments.show:
            print(robot.text)
        with tempfile.TemporaryDirectory() as folder:
            errors[seed] = largest_error(robot, Path(folder))
        if errors[seed] > LIMIT:
            print(f"seed {seed}: {len(robot.joints)} joints, error {errors[seed]:.1e}", flush=True)
    worst: Any = max(errors, key=lambda seed: errors[seed])
    bad = sum(error > LIMIT for error in errors.values())
    print(", ".join(f"{what} in {count}" for what, count in sorted(seen.items())))
    print(
        f"{len(errors)} robots in {time.perf_counter() - start:.0f} s: {bad} off by more than {LIMIT:g}; "
        f"largest error {errors[worst]:.1e}, seed {worst}"
    )
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
