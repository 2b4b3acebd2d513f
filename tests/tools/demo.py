"""The end of `make demo`: τ_ij of the generated packages below a directory, and where everything lies."""

import importlib
import sys
from pathlib import Path

import numpy as np

PACKAGES = ("planar3", "puma560")


def table(name: str) -> str:
    """τ_ij at one state, joints down, links across."""
    robot = importlib.import_module(name).load("numpy")
    q, qd, qdd = (scale * np.ones(robot.n) for scale in (0.5, 1.0, 2.0))
    tau = robot.partial_torque(q, qd, qdd)
    width = max(map(len, robot.joint_names))
    head = "".join(f"{link:>10}" for link in (*robot.link_names, "sum"))
    lines = [f"{name}: torque in N m on each joint through each link", f"{'':{width}}{head}"]
    for joint, row in zip(robot.joint_names, tau, strict=True):
        lines.append(f"{joint:{width}}" + "".join(f"{value:10.4f}" for value in (*row, row.sum())))
    return "\n".join(lines)


def main() -> None:
    """Print the tables of all packages below the directory named on the command line."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    sys.path.insert(0, str(out))
    for name in PACKAGES:
        print(table(name), end="\n\n")
    print("Every joint at q = 0.5 rad, qd = 1 rad/s, qdd = 2 rad/s^2.")
    for name in PACKAGES:
        print(f"{out / name}: import it as `{name}` with {out} on PYTHONPATH; C in {out / name / 'c'}")
    print(f"{out / 'planar3' / 'formulas.txt'}: the same torques of planar3 as formulas to read")


if __name__ == "__main__":
    main()
