"""Damping learned through time: gradients flow through controller, robot and RK4 back to the gains.

    python tests/tools/learn_damping.py [--steps 5]

The arm of Table 2 is let go beside its target, and shall come back with the least of the squared error over
time, joint by joint. With a constant inertia M and stiffness K that is known: B = sqrt(K M), half of what is
critical; the search begins at four times as much.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import torch
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

INERTIA = (0.3, 0.1, 0.02)
"""kg m^2, of each joint alone."""
FREQUENCY = 10.0
"""rad/s: stiffness is inertia times its square."""
BEGIN = 4.0
"""Damping at the start, in a ratio to the best."""
RATE, SECONDS, STEP = 0.7, 1.2, 0.04
"""Rate of the descent; seconds of the motion, and of RK4's steps."""
TARGET, AWAY = (-1.0, 0.8, 0.6), (0.3, -0.2, 0.4)


@dataclass(frozen=True)
class Learnt:
    """After some steps of the descent."""

    loss: float
    """Squared error over time, summed over the joints, each in a ratio to the least that there is."""
    ratio: tuple[float, ...]
    """Damping of each joint in a ratio to the best."""


def descent(robot: Any, steps: int) -> Iterator[Learnt]:
    """Yield the gains at the beginning, and after each step."""
    numbers = {"dtype": torch.float64}
    inertia, target = torch.tensor(INERTIA, **numbers), torch.tensor(TARGET, **numbers)
    away, stiffness = torch.tensor(AWAY, **numbers), FREQUENCY**2 * inertia
    best = FREQUENCY * inertia
    time = torch.arange(0.0, SECONDS + STEP / 2, STEP, **numbers)
    # In logarithms damping stays positive, and joints of any size learn alike.
    learned = torch.full((len(INERTIA),), BEGIN, **numbers).log().requires_grad_()
    for step in range(steps + 1):
        controller = robot.partial_impedance(inertia, best * learned.exp(), stiffness)
        motion = robot.simulate(
            target + away, 0.0 * away, time.tolist(), lambda t, q, qd, c=controller: c(q, qd, target)
        )
        error = ((motion.q - target) / away) ** 2
        loss = FREQUENCY * torch.trapezoid(error, time, dim=0).sum() / len(INERTIA)
        yield Learnt(loss.item(), tuple(learned.detach().exp().tolist()))
        if step < steps:
            (slope,) = torch.autograd.grad(loss, learned)
            learned = (learned - RATE * len(INERTIA) * slope).detach().requires_grad_()


def main() -> None:
    """Print each step of the descent."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=5)
    steps = parser.parse_args().steps
    with tempfile.TemporaryDirectory() as folder:
        write_package(generate(read_system("planar3"), ["torch"]), Path(folder) / "planar3")
        robot = import_package(Path(folder) / "planar3").load("torch")
        for step, learnt in enumerate(descent(robot, steps)):
            ratios = ", ".join(f"{ratio:.3f}" for ratio in learnt.ratio)
            print(f"step {step:2}: squared error {learnt.loss:.4f}, damping {ratios} of the best")


if __name__ == "__main__":
    main()
