"""Make arm-log.csv anew: Panda in MuJoCo, with friction, a thing in its hand, and noise of its sensors.

`python make.py FOLDER`, with MuJoCo and NumPy. The file of the robot, panda.urdf, knows nothing of the
thing in the hand and of the friction of joints. Nothing of linkwise takes part.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).parent
STEP, RATE, SECONDS = 0.0005, 100, 16
"""Step of the simulation in s, samples of the log a second, and its length in s."""
THING, WHERE = 1.2, (0.0, 0.0, 0.15)
"""Mass in kg, and centre in the hand's axes in m: a bottle that the fingers hold."""
BOTTLE = (0.006, 0.006, 0.0012)
"""Principal moments of inertia of it in kg m²."""
COULOMB = (0.55, 0.6, 0.4, 0.5, 0.3, 0.25, 0.2)
VISCOUS = (0.9, 1.1, 0.7, 0.8, 0.35, 0.3, 0.25)
"""Friction of the joints: N m, and N m s/rad."""
ANGLE, TORQUE = 1e-5, (0.12, 0.12, 0.1, 0.1, 0.04, 0.04, 0.03)
"""Noise: standard deviations of an angle in rad, and of the torques in N m."""
CENTRE = (0.0, -0.2, 0.0, -1.6, 0.0, 1.8, 0.0)
REACH = (1.1, 0.7, 1.1, 0.8, 1.3, 1.0, 1.4)
"""Middle and half range of each joint's motion in rad."""
TONES, BASE, SEED = 4, 2 * np.pi * 0.125, 5


def model() -> mujoco.MjModel:
    """Return Panda with what its file does not say."""
    spec = mujoco.MjSpec.from_file(str(HERE / "panda.urdf"))
    spec.compiler.fusestatic = False
    spec.option.timestep, spec.option.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.body("panda_hand").add_body(
        name="thing", pos=WHERE, mass=THING, inertia=BOTTLE, ipos=(0, 0, 0), explicitinertial=True
    )
    robot = spec.compile()
    robot.dof_frictionloss[:], robot.dof_damping[:] = COULOMB, VISCOUS
    return robot


def wanted(time: float) -> np.ndarray:
    """Return angles, velocities and accelerations (3, 7) to follow: sums of sines, from rest."""
    draw = np.random.default_rng(SEED)
    size, shift = draw.uniform(0.3, 1.0, (7, TONES)), draw.uniform(0, 2 * np.pi, (7, TONES))
    rate = BASE * np.arange(1, TONES + 1)
    scale = np.array(REACH)[:, None] * size / size.sum(-1, keepdims=True)
    phase = rate * time + shift
    q = np.array(CENTRE) + (scale * np.sin(phase)).sum(-1)
    return np.array([q, (scale * rate * np.cos(phase)).sum(-1), -(scale * rate**2 * np.sin(phase)).sum(-1)])


def motors(robot: mujoco.MjModel, now: mujoco.MjData, time: float) -> np.ndarray:
    """Return what a controller asks of the motors (7,) in N m: a model of the arm, springs to the path."""
    q, qd, qdd = wanted(time)
    spring = 400 * (q - now.qpos) + 40 * (qd - now.qvel)
    torque = np.empty(7)
    mujoco.mj_mulM(robot, now, torque, qdd + spring)
    return torque + now.qfrc_bias + np.array(VISCOUS) * qd + np.array(COULOMB) * np.tanh(qd / 0.02)


def log() -> np.ndarray:
    """Return the log: time, angles, torques (samples, 15)."""
    robot = model()
    now = mujoco.MjData(robot)
    now.qpos, now.qvel, _ = wanted(0.0)
    mujoco.mj_forward(robot, now)
    rows, every = [], round(1 / (RATE * STEP))
    for step in range(RATE * SECONDS * every + 1):
        now.qfrc_applied = motors(robot, now, now.time)
        if step % every == 0:
            rows.append([now.time, *now.qpos, *now.qfrc_applied])
        mujoco.mj_step(robot, now)
    draw = np.random.default_rng(SEED)
    made = np.array(rows)
    made[:, 1:8] += draw.normal(0, ANGLE, (len(rows), 7))
    made[:, 8:] += draw.normal(0, TORQUE, (len(rows), 7))
    return made


def main() -> None:
    """Write the log to the folder that is named, or to this one."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    joints = [f"panda_joint{k}" for k in range(1, 8)]
    head = ",".join(["time", *joints, *(f"tau/{joint}" for joint in joints)])
    form = ["%.2f", *["%.5f"] * 7, *["%.2f"] * 7]
    np.savetxt(folder / "arm-log.csv", log(), fmt=form, delimiter=",", header=head, comments="")


if __name__ == "__main__":
    main()
