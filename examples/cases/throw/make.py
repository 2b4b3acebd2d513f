"""Make throw.csv and torques.csv anew: an arm in MuJoCo that throws a ball.

`python make.py FOLDER`, with MuJoCo and NumPy. Muscles are motors here: they follow a swing of each joint,
from the shoulder to the wrist, and hold the ball until RELEASE. Nothing of linkwise takes part.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).parent
STEP, RATE, SECONDS = 0.00025, 250, 0.7
"""Step of the simulation in s, samples of the log a second, and its length in s."""
BALL, GRIP, RELEASE = 0.145, (0.0, 0.0, -0.1), 0.348
"""Mass in kg, its place in the hand's axes in m, and the instant in s from which it flies."""
SWINGS = ((2.9, 1.7, 0.10, 0.46), (1.9, 0.2, 0.244, 0.46), (0.9, -0.6, 0.28, 0.478))
"""Shoulder, elbow and wrist: first and last angle in rad, begin and end in s."""
NOISE, SEED = 3e-5, 11
"""Standard deviation of an angle in rad, as of good encoders."""


def model(ball: float) -> mujoco.MjModel:
    """Return the arm with something of `ball` kg in its hand."""
    spec = mujoco.MjSpec.from_file(str(HERE / "arm.urdf"))
    spec.option.timestep = STEP
    thing = spec.body("hand").add_body(
        name="ball", pos=GRIP, ipos=(0, 0, 0), mass=ball, explicitinertial=True
    )
    thing.inertia = [1e-9] * 3  # a point, nearly
    return spec.compile()


def wanted(time: float) -> np.ndarray:
    """Return angles, velocities and accelerations (3, 3) to follow: quintics, at rest before and after."""
    first, last, begin, end = np.array(SWINGS).T
    u, turn, span = np.clip((time - begin) / (end - begin), 0.0, 1.0), last - first, end - begin
    q = first + turn * u**3 * (10 - 15 * u + 6 * u**2)
    qd = turn * u**2 * (30 - 60 * u + 30 * u**2) / span
    return np.array([q, qd, turn * u * (60 - 180 * u + 120 * u**2) / span**2])


def thrown() -> np.ndarray:
    """Return time, angles and the motors' torques (samples, 7)."""
    holding, empty = model(BALL), model(1e-9)
    now = mujoco.MjData(holding)
    now.qpos, now.qvel, _ = wanted(0.0)
    rows, every = [], round(1 / (RATE * STEP))
    for step in range(round(RATE * SECONDS) * every + 1):
        arm = holding if now.time < RELEASE else empty
        now.qfrc_applied = 0
        mujoco.mj_forward(arm, now)
        q, qd, qdd = wanted(now.time)
        torque = np.empty(3)
        mujoco.mj_mulM(arm, now, torque, qdd + 2500 * (q - now.qpos) + 100 * (qd - now.qvel))
        now.qfrc_applied = torque + now.qfrc_bias
        if step % every == 0:
            rows.append([now.time, *now.qpos, *now.qfrc_applied])
        mujoco.mj_step(arm, now)
    return np.array(rows)


def main() -> None:
    """Write both files to the folder that is named, or to this one."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    made = thrown()
    seen = made[:, 1:4] + np.random.default_rng(SEED).normal(0, NOISE, (len(made), 3))
    tables = {"throw.csv": ("%.5f", seen), "torques.csv": ("%.4f", made[:, 4:])}
    for name, (form, table) in tables.items():
        rows = np.column_stack([made[:, 0], table])
        head = "time,shoulder,elbow,wrist"
        np.savetxt(folder / name, rows, ["%.3f", *[form] * 3], ",", header=head, comments="")


if __name__ == "__main__":
    main()
