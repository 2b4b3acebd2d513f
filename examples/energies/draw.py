"""Draw each system of this folder as it moves, and what loads its first coordinate: NAME.png beside NAME.py.

    python examples/energies/draw.py [NAME ...]

Each file is a robot for linkwise: linkwise generate examples/energies/spherical_pendulum.py --out out
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from matplotlib import pyplot as plt

FOLDER = Path(__file__).parent
STARTS = {
    "spherical_pendulum": ([0.9, 0.0], [0.0, 2.5]),
    "bead_on_hoop": ([0.1], [0.0]),
    "elastic_joint": ([1.2, 120.0], [0.0, 0.0]),
    "telescopic_link": ([0.8, 0.6], [0.0, 0.0]),
    "charged_particle": ([0.1, 0.0, 0.05], [0.0, 0.6, 0.0]),
    "two_mode_beam": ([0.0, 0.05, -0.02], [2.0, 0.0, 0.0]),
    "furuta_pendulum": ([0.0, 2.6], [0.0, 0.0]),
    "double_pendulum_cart": ([0.0, 1.4, 1.9], [0.0, 0.0, 0.0]),
    "rolling_disc": ([0.0, 0.0, 0.0, 0.3, 0.0], [1.0, 0.0, 9.0]),
    "rattleback": ([0.0, 0.0, 0.0, 0.01, 0.003], [-0.6, 0.0, 0.0]),
}
"""Positions that motions start from, and velocities, of what constraints leave free, in rad and m."""
LONG = {"spherical_pendulum": 5.0, "charged_particle": 6.0, "double_pendulum_cart": 4.0, "rattleback": 4.0}
"""Lengths of motions in s, where they are not 3 s."""


def causes(robot: Any, q: Any, qd: Any) -> dict[str, Any]:
    """Return what loads the first coordinate that is free, by cause (S,); links are summed."""
    shares = robot.named_shares(q, qd).sum(2)
    if tied := constraints_of(robot):
        qdd, joints = tied.forward_dynamics(q, qd, 0.0 * q).qdd, tied.independent
        parts, shares = tied.propagation(q, qd, qdd), tied.projected(q, shares, by_link=True)
    else:
        qdd, joints = robot.forward_dynamics(q, qd, 0.0 * q), robot.joint_names
        parts = robot.propagation(q, qd, qdd)
    found = {
        f"{joint} motion": (parts.acceleration + parts.velocity)[:, 0, :, k].sum(-1)
        for k, joint in enumerate(joints)
    }
    return found | {name: shares[:, 0, m] for m, name in enumerate(robot.share_names)}


def constraints_of(robot: Any) -> Any:
    """Return the robot's constraints; None where each coordinate is free."""
    return robot.constraints if "constraints" in dir(robot) else None


def draw(name: str) -> None:
    """Draw one system."""
    with tempfile.TemporaryDirectory() as folder:
        write_package(generate(read_system(FOLDER / f"{name}.py"), ["numpy"]), Path(folder) / name)
        robot = import_package(Path(folder) / name).load()
    time = np.linspace(0.0, LONG.get(name, 3.0), 601)
    start, rate = (np.array(values) for values in STARTS[name])
    tied = constraints_of(robot)
    rate = tied.velocity(start, rate) if tied else rate
    motion = robot.simulate(start, rate, time, method="DOP853", rtol=1e-6)
    figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7.2, 5.2), layout="constrained")
    for k, joint in enumerate(robot.joint_names):
        size = 1.0 if np.ptp(motion.q[:, k]) < 10.0 else 100.0
        scaled = f" / {size:.0f}" if size > 1.0 else ""
        above.plot(time, motion.q[:, k] / size, label=f"{joint}{scaled} ({robot.joint_units[k]})")
    for cause, torque in causes(robot, motion.q, motion.qd).items():
        if np.abs(torque).max() > 0.0:
            below.plot(time, torque, label=cause)
    first = (tied.independent if tied else robot.joint_names)[0]
    unit = {"rad": "N m", "m": "N"}[robot.joint_units[robot.joint_names.index(first)]]
    above.set_title(f"{name.replace('_', ' ')}: how it moves", loc="left")
    below.set_title(f"what loads {first}; it sums to nothing, as nothing holds it", loc="left")
    below.set_ylabel(unit)
    below.set_xlabel("time (s)")
    for panel in (above, below):
        panel.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
        panel.spines[["top", "right"]].set_visible(False)
        panel.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    figure.savefig(FOLDER / f"{name}.png", dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    for asked in sys.argv[1:] or STARTS:
        draw(asked)
