"""The two motions of the paper's Fig. 5 and Fig. 10, made of minimum-jerk moves."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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
class Motion:
    """Joint angles over time, in rad: `start`, then moves; read with noise and in steps."""

    name: str
    start: tuple[float, ...]
    moves: tuple[Move, ...]
    duration: float
    noise: float = 0.0
    step: float = 0.0
    seed: int = 5

    def samples(self, rate: float = RATE) -> tuple[Array, Array]:
        """Time (S,) in s and angles (S, joints) in rad."""
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
    """10 s³ - 15 s⁴ + 6 s⁵, held before 0 and after 1: from rest to rest with the least jerk."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


RECORDED = Motion(
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
"""Like Fig. 5: link 3 moves until about 4 s, then link 2; an encoder of 4096 steps a turn."""

# Link 2's move begins two samples after 3 s: the five-point formula looks two samples ahead, and so
# sees rest up to and including 3 s.
SIMULATED = Motion(
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
"""Like Fig. 10: only link 3 moves until 3 s, links 2 and 3 after."""

MOTIONS = {motion.name: motion for motion in (RECORDED, SIMULATED)}


def write_csv(path: Path, motion: Motion, joints: Sequence[str] = JOINTS) -> int:
    """Write a motion as CSV, exactly; returns how many samples."""
    time, q = motion.samples()
    lines = [",".join(["time", *joints])]
    lines += [",".join(map(repr, [t, *angles])) for t, angles in zip(time.tolist(), q.tolist(), strict=True)]
    draft = path.with_name(f".{path.name}.draft")
    draft.write_text("\n".join(lines) + "\n", encoding="utf-8")
    draft.replace(path)
    return len(time)
