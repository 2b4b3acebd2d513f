"""Two motions modelled on those of the paper's Fig. 5 and Fig. 10, made of minimum-jerk moves.

Which link moves when follows the paper; how far and how fast is chosen here.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linkwise.arrays import Array
from linkwise.output import write_files
from linkwise.package.write import refuse_inside_package

RATE = 100.0
"""Sampling rate in Hz."""

JOINTS = ("joint1", "joint2", "joint3")
"""Joints of the arm of Table 2, as the built-in robot `planar3` names them."""


@dataclass(frozen=True)
class Move:
    """A joint's move by `by` rad, from `start` to `stop` in s."""

    joint: int
    start: float
    stop: float
    by: float


@dataclass(frozen=True)
class PaperMotion:
    """Joint angles over time, in rad: `start`, then moves, for `duration` s.

    Angles are read with normal noise of standard deviation `noise` from `seed`, and in steps of `step`.
    """

    name: str
    start: tuple[float, ...]
    moves: tuple[Move, ...]
    duration: float
    noise: float = 0.0
    step: float = 0.0
    seed: int = 5

    @property
    def count(self) -> int:
        """Number of samples at the rate of `write_motions`."""
        return len(self.samples()[0])

    def samples(self, rate: float = RATE) -> tuple[Array, Array]:
        """Return time (S,) in s and angles (S, joints) in rad, at `rate` Hz."""
        time = np.arange(round(self.duration * rate) + 1) / rate
        q = np.tile(np.array(self.start), (len(time), 1))
        for move in self.moves:
            q[:, move.joint] += move.by * minimum_jerk((time - move.start) / (move.stop - move.start))
        if self.noise:
            q += np.random.default_rng(self.seed).normal(scale=self.noise, size=q.shape)
        if self.step:
            q = np.round(q / self.step) * self.step
        return time, q


def minimum_jerk(s: Array) -> Array:
    """Return 10 s³ - 15 s⁴ + 6 s⁵, held before 0 and after 1: from rest to rest with the least jerk."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


RECORDED = PaperMotion(
    "recorded",
    (0.30, 0.60, 0.40),
    (
        Move(2, 0.5, 2.2, 0.9),
        Move(2, 2.4, 3.9, -0.7),
        Move(1, 4.2, 5.9, 0.8),
        Move(1, 6.1, 7.6, -0.6),
    ),
    8.0,
    noise=5e-4,
    step=2 * np.pi / 4096,
)
"""Motion as in Fig. 5: link 3 moves until about 4 s, then link 2; read by an encoder of 4096 steps a turn."""

# Link 2's move begins two samples after 3 s: the five-point formula looks two samples ahead, and so
# sees rest up to and including 3 s.
SIMULATED = PaperMotion(
    "simulated",
    (0.30, 0.60, 0.40),
    (
        Move(2, 0.2, 1.5, 1.0),
        Move(2, 1.6, 2.9, -0.8),
        Move(2, 3.0 + 2 / RATE, 5.5, 0.9),
        Move(1, 3.0 + 2 / RATE, 5.5, -0.7),
    ),
    6.0,
)
"""Motion as in Fig. 10: only link 3 moves until 3 s, links 2 and 3 after."""

MOTIONS = {motion.name: motion for motion in (RECORDED, SIMULATED)}


def write_motions(
    directory: Path, motions: Sequence[PaperMotion], joints: Sequence[str] = JOINTS
) -> tuple[Path, ...]:
    """Write each motion to `directory`/NAME.csv with all digits, and return the paths.

    Writes all files, or none and raises LinkwiseError.
    """
    refuse_inside_package(directory)
    return write_files(directory, {f"{motion.name}.csv": _csv(motion, joints) for motion in motions})


def _csv(motion: PaperMotion, joints: Sequence[str]) -> bytes:
    time, q = motion.samples()
    lines = [",".join(["time", *joints])]
    lines += [",".join(map(repr, [t, *angles])) for t, angles in zip(time.tolist(), q.tolist(), strict=True)]
    return ("\n".join(lines) + "\n").encode()
