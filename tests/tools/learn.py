"""Masses and centres of mass of an arm from noisy torques, by gradients, in three ways; README.md names it.

    python tests/tools/learn.py [--samples 2000] [--noise 0.05]

The arm is Panda. Torques of random motions are those of the robot as it is, with noise in N m; the search
begins at masses that are off by up to a third, and centres of mass by 3 cm. Inertias are taken as known.

Torques tell combinations of these numbers apart, not each number: a shoulder that turns about the vertical
says nothing of the height of its centre of mass, and a link's mass stands in for what the link before it
carries. The Jacobian of the torques finds these combinations. It sets the scale of the descent, and along
what it does not tell apart the search stays where it began.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import torch

sys.path.insert(0, str(Path(__file__).parents[1]))

from conftest import LOCKED_FINGERS, PANDA
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

Motion = Sequence[torch.Tensor]
WAYS = ("autograd", "torch", "native")
ROUNDS, STEPS = 12, 14
"""Times that the scale is set, and that torques are asked for by each scale."""
FAINT, UNSEEN = 1e-3, 1e-9
"""Combinations that torques depend on less than on the strongest, by these ratios: small steps, and none."""


@dataclass(frozen=True)
class Numbers:
    """A way from masses and centres of mass, as one vector, to joint torques (samples, n)."""

    true: torch.Tensor
    torque: Callable[[torch.Tensor, Motion], torch.Tensor]
    followed: Callable[[torch.Tensor, Motion], torch.Tensor]
    """Torques by the vectorised rule, which torch.func may go through quickly."""


@dataclass(frozen=True)
class Learned:
    """Combinations told apart, of so many numbers, and how far torques of other motions are off, in N m.

    Root mean squares, without noise, where the search began and where it ended.
    """

    told_apart: int
    of: int
    began: float
    ended: float


def by_links(package: ModuleType) -> Numbers:
    """Through the modules of the links."""
    robot = package.load("autograd", requires_grad=("mass", "com"))
    named = dict(robot.named_parameters())
    sizes = [number.numel() for number in named.values()]

    def torque(numbers: torch.Tensor, motion: Motion) -> torch.Tensor:
        parts = zip(named, numbers.split(sizes), strict=True)
        given = {name: part.reshape(named[name].shape) for name, part in parts}
        return torch.func.functional_call(robot, given, tuple(motion)).sum(-1)

    def followed(numbers: torch.Tensor, motion: Motion) -> torch.Tensor:
        rows = numbers.reshape(-1, 4)
        return _by_rule(package, rows[:, 0], rows[:, 1:], motion)

    return Numbers(torch.cat([number.detach().reshape(-1) for number in named.values()]), torque, followed)


def by_bodies(package: ModuleType) -> Numbers:
    """Through the vectorised rule, with masses and centres as arguments."""
    masses, centres, _ = map(torch.from_numpy, package.bodies())

    def torque(numbers: torch.Tensor, motion: Motion) -> torch.Tensor:
        count = len(masses)
        return _by_rule(package, numbers[:count], numbers[count:].reshape(-1, 3), motion)

    return Numbers(torch.cat([masses, centres.reshape(-1)]), torque, torque)


def by_parameters(package: ModuleType) -> Numbers:
    """Through compiled C, in a package whose numbers are run-time parameters."""
    names = [name for name in package.parameters if name.startswith(("m_", "c_"))]

    def by(backend: str) -> Callable[[torch.Tensor, Motion], torch.Tensor]:
        def torque(numbers: torch.Tensor, motion: Motion) -> torch.Tensor:
            given = dict(zip(names, numbers.unbind(), strict=True))
            robot = package.load(backend, given, allow_unphysical=True)
            return robot.inverse_dynamics(*motion)

        return torque

    own = [package.parameters[name] for name in names]
    return Numbers(torch.tensor(own, dtype=torch.float64), by("native"), by("torch"))


def _by_rule(
    package: ModuleType, masses: torch.Tensor, centres: torch.Tensor, motion: Motion
) -> torch.Tensor:
    bodies = package.Bodies(masses, centres, torch.from_numpy(package.bodies().inertias))
    return package.load("torch", bodies=bodies).inverse_dynamics(*motion)


def motions(n: int, samples: int, seed: int) -> Motion:
    """q, qd and qdd (samples, n) of random motions."""
    draw = torch.Generator().manual_seed(seed)
    largest = torch.tensor([3.0, 2.0, 4.0])[:, None, None]
    return tuple(largest * (2.0 * torch.rand((3, samples, n), generator=draw, dtype=torch.float64) - 1.0))


def learn(numbers: Numbers, n: int, samples: int, noise: float) -> Learned:
    """Descend to the numbers of the torques."""
    draw, motion = torch.Generator().manual_seed(5), motions(n, samples, 1)
    measured = numbers.torque(numbers.true, motion).detach()
    measured += noise * torch.randn(measured.shape, generator=draw, dtype=torch.float64)
    off = 2.0 * torch.rand(numbers.true.shape, generator=draw, dtype=torch.float64) - 1.0
    start = numbers.true + torch.where(numbers.true.abs() > 0.3, numbers.true / 3.0, 0.03) * off
    found = start
    for _ in range(ROUNDS):
        scale = steps_alike(numbers, found, n)
        found = descended(numbers, found, scale, motion, measured)
    unseen = motions(n, samples, 3)
    wrong = [numbers.torque(x, unseen) - numbers.torque(numbers.true, unseen) for x in (start, found)]
    began, ended = (error.detach().square().mean().sqrt().item() for error in wrong)
    return Learned(scale.shape[1], len(start), began, ended)


def steps_alike(numbers: Numbers, at: torch.Tensor, n: int) -> torch.Tensor:
    """Columns of combinations that torques tell apart; a step along each changes torques about alike."""
    few = motions(n, 200, 2)
    jacobian = torch.func.jacfwd(lambda x: numbers.followed(x, few).reshape(-1))(at)
    _, size, rows = torch.linalg.svd(jacobian, full_matrices=False)
    kept = size > UNSEEN * size[0]
    return (rows[kept].T / (size[kept] + FAINT * size[0])) * len(jacobian) ** 0.5


def descended(
    numbers: Numbers, start: torch.Tensor, scale: torch.Tensor, motion: Motion, measured: torch.Tensor
) -> torch.Tensor:
    """Numbers after some steps down the gradient of the squared error."""
    at = torch.zeros(scale.shape[1], dtype=torch.float64, requires_grad=True)
    descent = torch.optim.LBFGS([at], max_iter=STEPS, max_eval=STEPS, line_search_fn="strong_wolfe")

    def loss() -> torch.Tensor:
        descent.zero_grad()
        value = (numbers.torque(start + scale @ at, motion) - measured).square().mean()
        value.backward()
        return value

    descent.step(loss)
    return (start + scale @ at).detach()


def packages(folder: Path) -> dict[str, Numbers]:
    """The ways by name, through two packages of Panda: with numbers, and with run-time parameters."""
    made = {}
    for name, parameters, kernel in (
        ("arm", "numeric", "straight"),
        ("arm_of_parameters", "symbolic", "loops"),
    ):
        system = read_system(PANDA, Options(parameters, lock=LOCKED_FINGERS))  # type: ignore[arg-type]
        backends = ["torch", "autograd"] if parameters == "numeric" else ["torch", "native"]
        write_package(generate(system, backends, name, kernel=kernel), folder / name)  # type: ignore[arg-type]
        made[name] = import_package(folder / name)
    ways = (by_links(made["arm"]), by_bodies(made["arm"]), by_parameters(made["arm_of_parameters"]))
    return dict(zip(WAYS, ways, strict=True))


def main() -> None:
    """Learn in each way, and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=2000)
    parser.add_argument("--noise", type=float, default=0.05, help="in N m")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        for way, numbers in packages(Path(folder)).items():
            started = time.perf_counter()
            found = learn(numbers, 7, arguments.samples, arguments.noise)
            print(
                f"{way}: {found.told_apart} of {found.of} combinations told apart; torques of other motions "
                f"{found.began:.2f} N m off, then {found.ended:.4f}; {time.perf_counter() - started:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
