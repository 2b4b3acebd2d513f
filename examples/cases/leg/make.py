"""Make step.csv, ground.csv and torques.csv anew: two steps of a leg of four bars in MuJoCo, held at the hip.

`python make.py FOLDER`, with MuJoCo and NumPy. The leg of leg.toml is written once more, for MuJoCo.
In stance the ground pushes the foot by a force that is given; the motors follow the path all the same.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).parent
STEP, RATE, SECONDS = 0.0001, 200, 1.0
"""Step of the simulation in s, samples of the log a second, and its length in s."""
PERIOD, STANCE = 0.5, 0.5
"""Time of a step in s, one of which goes before the log, and the part of it on the ground."""
LENGTH, LIFT, HEIGHT = 0.09, 0.05, 0.26
"""Length of a step, how high the foot is lifted, and height of the hip above the ground, in m."""
WEIGHT, SLOPE = 36.0, 0.12
"""Mean force of the ground in stance in N, and how far it leans, first back and then forwards."""
THIGH, SHIN = 0.12, 0.22
HIP, KNEE = 0.9, 1.3415
"""Angles that leg.toml calls zero, in rad: a leg that stands, one knee forwards and one back."""

MODEL = f"""
<mujoco>
  <compiler angle="radian"/>
  <option gravity="0 -9.81 0" timestep="{STEP}" integrator="implicitfast"/>
  <default><joint type="hinge" axis="0 0 1"/></default>
  <worldbody>
    <body name="thigh_front" euler="0 0 {HIP}"><joint name="front"/>
      <inertial mass="0.22" pos="0 -0.05 0" diaginertia="3.6e-4 4e-5 3.6e-4"/>
      <body name="shin_front" pos="0 -0.12 0" euler="0 0 {-KNEE}"><joint name="front_shin"/>
        <inertial mass="0.11" pos="0 -0.10 0" diaginertia="4.2e-4 1e-5 4.2e-4"/>
        <site name="foot" pos="0 -0.22 0"/>
      </body>
    </body>
    <body name="thigh_back" euler="0 0 {-HIP}"><joint name="back"/>
      <inertial mass="0.22" pos="0 -0.05 0" diaginertia="3.6e-4 4e-5 3.6e-4"/>
      <body name="shin_back" pos="0 -0.12 0" euler="0 0 {KNEE}"><joint name="back_shin"/>
        <inertial mass="0.08" pos="0 -0.09 0" diaginertia="3.0e-4 1e-5 3.0e-4"/>
        <site name="foot_back" pos="0 -0.22 0"/>
      </body>
    </body>
  </worldbody>
  <equality><connect site1="foot" site2="foot_back" solref="0.0008 1" solimp="0.999 0.9999 0.001"/></equality>
</mujoco>
"""


def foot_path(time: float) -> np.ndarray:
    """Return the foot's place from the hip (2,) in m: on the ground in stance, a loop above it in swing."""
    part = (time / PERIOD) % 1.0
    if part < STANCE:
        u = part / STANCE
        return np.array([LENGTH * (0.5 - u), -HEIGHT])
    u = (part - STANCE) / (1 - STANCE)
    forth = -u + u**2 * (6 - 4 * u)  # leaves and lands as fast as the stance goes
    return np.array([LENGTH * (forth - 0.5), -HEIGHT + LIFT * (16 * u**2 * (1 - u) ** 2)])


def push(time: float) -> np.ndarray:
    """Return the ground's force on the foot (2,) in N."""
    part = (time / PERIOD) % 1.0
    if part >= STANCE:
        return np.zeros(2)
    u = part / STANCE
    up = WEIGHT * np.pi / 2 * np.sin(np.pi * u)
    return np.array([-SLOPE * up * np.cos(np.pi * u), up])


def joints(foot: np.ndarray) -> np.ndarray:
    """Return hip, knee, hip, knee (4,) in rad that bring the foot there: one knee forwards, one back."""
    reach, lean = np.hypot(*foot), np.arctan2(foot[0], -foot[1])
    hip = np.arccos((THIGH**2 + reach**2 - SHIN**2) / (2 * THIGH * reach))
    knee = np.arccos((reach**2 - THIGH**2 - SHIN**2) / (2 * THIGH * SHIN))
    return np.array([lean + hip - HIP, KNEE - knee, lean - hip + HIP, knee - KNEE])


def stepped() -> np.ndarray:
    """Return time, four angles, two torques and the foot's place and force (samples, 11)."""
    leg = mujoco.MjModel.from_xml_string(MODEL)
    now = mujoco.MjData(leg)
    dofs = [leg.joint(name).dofadr[0] for name in ("front", "back")]
    body = leg.body("shin_front").id
    h = 1e-3
    now.qpos = joints(foot_path(0.0))
    now.qvel = (joints(foot_path(h)) - joints(foot_path(-h))) / (2 * h)
    rows, every = [], round(1 / (RATE * STEP))
    for step in range(round(-RATE * PERIOD) * every, round(RATE * SECONDS) * every + 1):
        time = step * STEP
        mujoco.mj_forward(leg, now)
        force, spot = np.array([*push(time), 0.0]), now.site("foot").xpos.copy()
        now.qfrc_applied = 0
        mujoco.mj_applyFT(leg, now, force, np.zeros(3), spot, body, now.qfrc_applied)
        want, after, before = (joints(foot_path(time + shift)) for shift in (0, h, -h))
        torque = 250 * (want - now.qpos) + 1.5 * ((after - before) / (2 * h) - now.qvel)
        now.qfrc_applied[dofs] += torque[dofs]
        if step >= 0 and step % every == 0:
            rows.append([time, *now.qpos, *torque[dofs], *spot[:2], *force[:2]])
        mujoco.mj_step(leg, now)
    return np.array(rows)


def main() -> None:
    """Write the files to the folder that is named, or to this one."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    made = stepped()
    tables = {
        "step.csv": ("time,front,front_shin,back,back_shin", "%.6f", made[:, 1:5]),
        "torques.csv": ("time,front,back", "%.4f", made[:, 5:7]),
        "ground.csv": (
            "time,"
            + ",".join(f"ground:shin_front/{what}_{axis}" for what in ("point", "force") for axis in "xyz"),
            "%.5f",
            np.insert(made[:, 7:11], [2, 4], 0.0, axis=1),
        ),
    }
    for name, (head, form, table) in tables.items():
        rows = np.column_stack([made[:, 0], table])
        np.savetxt(folder / name, rows, ["%.3f", *[form] * table.shape[1]], ",", header=head, comments="")


if __name__ == "__main__":
    main()
