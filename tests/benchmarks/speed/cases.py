"""The robots that are timed."""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import files
from pathlib import Path


@dataclass(frozen=True)
class Case:
    """A robot: where its description comes from and the options to read it with."""

    name: str
    robot: Callable[[Path], str]
    options: tuple[str, ...] = ()
    kernel: str | None = None
    """Kernel that `generate --kernel` is told; where there is no such choice, the robot is left out."""
    casadi: bool = True
    peers: bool = True
    every_backend: bool = False
    """Time the slow back ends at the largest batch, too."""
    control: bool = False
    """Time control steps, of robots whose last frame can move along all six axes."""


def shipped(name: str) -> Callable[[Path], str]:
    """Return a URDF out of the package example-robot-data."""

    def locate(_: Path) -> str:
        listed = files("example-robot-data") or []
        return str(Path(str(next(f for f in listed if f.name == name).locate())).resolve())

    return locate


def built_in(name: str) -> Callable[[Path], str]:
    """Return a robot that linkwise brings along."""
    return lambda _: name


def chain(joints: int) -> str:
    """URDF of a serial arm: axes twisted by ±90° in turn, a mass with a full inertia tensor at each link."""
    draw = random.Random(joints).uniform
    lines = [f'<robot name="chain{joints}">', '<link name="base"/>']
    parent = "base"
    for j in range(1, joints + 1):
        centre = " ".join(f"{draw(-0.1, 0.1):.3f}" for _ in range(3))
        inertia = (
            'ixx="%.4f" iyy="%.4f" izz="%.4f" ixy="%.4f" ixz="%.4f" iyz="%.4f"'  # noqa: UP031
            % (*(draw(0.02, 0.03) for _ in range(3)), *(draw(-0.002, 0.002) for _ in range(3)))
        )
        twist = math.copysign(math.pi / 2, 1 if j % 2 else -1)
        lines += [
            f'<link name="link{j}"><inertial><origin xyz="{centre}"/><mass value="{draw(0.5, 2):.3f}"/>',
            f"<inertia {inertia}/></inertial></link>",
            f'<joint name="joint{j}" type="continuous"><parent link="{parent}"/><child link="link{j}"/>',
            f'<origin rpy="{twist!r} 0 0" xyz="0.1 0 0.2"/><axis xyz="0 0 1"/></joint>',
        ]
        parent = f"link{j}"
    return "\n".join([*lines, "</robot>", ""])


def chain_file(joints: int) -> Callable[[Path], str]:
    """Return that chain as a file under the given directory."""

    def write(directory: Path) -> str:
        path = directory / f"chain{joints}.urdf"
        path.write_text(chain(joints), encoding="utf-8")
        return str(path)

    return write


FINGERS = ("--lock", "panda_finger_joint1=0", "--lock", "panda_finger_joint2=0")

CASES = (
    Case("planar3", built_in("planar3"), every_backend=True),
    Case("panda", shipped("panda.urdf"), FINGERS, every_backend=True, control=True),
    Case("panda_loops", shipped("panda.urdf"), FINGERS, kernel="loops", peers=False),
    Case("puma560", built_in("puma560")),
    Case("planar10", built_in("planar10")),
    Case("chain20", chain_file(20)),
    Case("chain20_straight", chain_file(20), kernel="straight", peers=False),
    Case("talos", shipped("talos_reduced.urdf")),
    Case("chain60", chain_file(60), kernel="auto", casadi=False),
)
