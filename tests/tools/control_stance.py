"""Solo 12 on three feet in MuJoCo, its fourth leg thrown about and its trunk pushed.

    python tests/tools/control_stance.py [--out docs/pictures]

Draws control-stance.png. MuJoCo integrates, with its own soft contacts and friction. The trunk hangs on a
virtual spring, and the raised leg follows its swing by a spring of its own, in both runs; in the second run,
what the leg's motion does to the trunk is cancelled by the legs that stand.
"""

import argparse
import importlib
import re
import shutil
import sys
import tempfile
import xml.etree.ElementTree as tree
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise.plotstyle import INK, PALE, PURPLE, VERMILION, saved, styled

from tools.corpus import ROBOTS

SOLO = ROBOTS / "solo_description" / "robots" / "solo12.urdf"
STANDS, SWINGS = ("FL", "HL", "HR"), "FR"
RADIUS, FRICTION = 0.016, 0.8
"""m, of the balls that feet are in MuJoCo."""
STANCE, RAISED = np.array([0.0, 0.75, -1.5]), np.array([0.0, 1.0, -2.2])
SWING, RATE = np.array([0.0, 0.9, 0.0]), 2.5
"""rad and Hz of the swing of the raised leg, which comes and goes."""
THROWN, PUSHED, END = (0.3, 1.9), (2.2, 2.35), 3.0
"""s: from when to when the leg swings, and the trunk is pushed; the end."""
PUSH = np.array([0.0, 4.0, 0.0])
"""N at the trunk's origin."""
SPRING, TURNS, RATIO = 120.0, 2.5, 0.7
"""N/m and N m/rad of the trunk's virtual spring, and its damping in a ratio to critical."""
LEG, LEG_DAMPING = 6.0, 0.15
"""N m/rad and N m s/rad of the raised leg's joints."""
PERIOD, WITHIN = 1e-3, 5
"""s, for which torques are held, and MuJoCo's steps within."""
PARTS = ("SHOULDER", "UPPER_LEG", "LOWER_LEG", "FOOT")
ASIDE = np.array([[0.9, 0.45, 0.0], [0.12, 0.3, 1.0]])
"""Projection of the drawing."""
FELT, FREED = "Nothing cancelled", "The leg's effect on the trunk cancelled"
TONES = {FELT: "#444444", FREED: PURPLE}


@dataclass(frozen=True)
class Run:
    """A run: instants, motion (samples, n), and how far feet slipped at most, in m."""

    title: str
    time: Any
    q: Any
    slipped: float


class Plant:
    """Solo 12 over a plane, in MuJoCo."""

    def __init__(self) -> None:
        import mujoco

        text = SOLO.read_text(encoding="utf-8")
        spec = mujoco.MjSpec.from_string(_without_meshes(text))
        spec.option.timestep = PERIOD / WITHIN
        spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 50.0
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        floor = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1])
        floor.friction = [FRICTION, 0.0, 0.0]
        self._mujoco, self._spec = mujoco, spec
        for body in spec.bodies:
            if body.name.endswith("_LOWER_LEG"):
                ball = body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[RADIUS, 0, 0])
                ball.pos, ball.friction = _foot(text, body.name), [FRICTION, 0.0, 0.0]
                ball.contype, ball.conaffinity = 1, 1
        spec.body("base_link").add_freejoint()
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)

    def start(self, robot: Any, q: Any) -> None:
        """Begin at rest."""
        self._mujoco.mj_resetData(self.model, self.data)
        turn = robot.kinematics.pose(q, "base_link")[:3, :3].ravel()
        self.data.qpos[:3], self.data.qpos[7:] = q[:3], q[6:]
        self._mujoco.mju_mat2Quat(self.data.qpos[3:7], turn)

    def hold(self, tau: Any, push: Any) -> None:
        """Go on for a period, under torques of the joints and a push at the trunk."""
        self.data.qfrc_applied[6:] = tau[6:]
        self.data.qfrc_applied[:3] = push
        for _ in range(WITHIN):
            self._mujoco.mj_step(self.model, self.data)


def _without_meshes(text: str) -> str:
    return re.sub(r"<(visual|collision)>.*?</\1>", "", text, flags=re.DOTALL)


def _foot(text: str, shank: str) -> Any:
    """Return where the foot of a shank is, in its axes."""
    for joint in tree.fromstring(text).iter("joint"):
        if joint.find("parent") is not None and joint.find("parent").get("link") == shank:
            return [float(x) for x in joint.find("origin").get("xyz").split()]
    raise ValueError(shank)


def solo(folder: Path) -> tuple[Any, Any]:
    """Return the robot and its package."""
    made = generate(read_system(SOLO, Options(base="floating")), ["numpy", "native"], "solo", kernel="loops")
    write_package(made, folder / "solo")
    package = import_package(folder / "solo")
    return package.load("native" if shutil.which("gcc") else "numpy"), package


def swing(t: float) -> Any:
    """Return where the raised leg's joints are told to be, (3,)."""
    begin, end = THROWN
    if not begin <= t <= end:
        return RAISED
    return RAISED + SWING * np.sin(np.pi * (t - begin) / (end - begin)) ** 2 * np.sin(
        2.0 * np.pi * RATE * (t - begin)
    )


def start(robot: Any, package: Any) -> tuple[Any, Any]:
    """Return the constraints of three feet, and the stance; the trunk leans to where these carry it."""
    legs = [RAISED if name == SWINGS else STANCE for name in ("FL", "FR", "HL", "HR")]
    q = np.concatenate([np.zeros(6), *legs])
    contacts = [package.Contact(f"{name}_FOOT", "point") for name in STANDS]
    own = [*robot.joint_names[:6], *(name for name in robot.joint_names if name.startswith(SWINGS))]
    standing = robot.constrained(independent=own, contacts=contacts, at=q)
    feet = np.mean([robot.kinematics.pose(q, f"{name}_FOOT")[:3, 3] for name in STANDS], 0)
    leaning = q.copy()
    leaning[:2] += 0.8 * (feet - robot.kinematics.centre_of_mass(q))[:2]
    q = standing.closed(leaning, held_at=q)
    q[2] -= robot.kinematics.pose(q, f"{STANDS[0]}_FOOT")[2, 3] - RADIUS
    return standing, q


def run(title: str, robot: Any, package: Any, plant: Plant) -> Run:
    """Return one run."""
    standing, home = start(robot, package)
    leg = [k for k, name in enumerate(robot.joint_names) if name.startswith(SWINGS)]
    links = [name for name in robot.link_names if name.startswith(SWINGS)]
    effect = {(base, link, None, None) for base in range(6) for link in links}
    spring, damper = np.zeros((2, robot.n))
    spring[:6], spring[leg] = np.repeat([SPRING, TURNS], 3), LEG
    damper[:6] = 2.0 * RATIO * np.sqrt(spring[:6] * np.diag(robot.mass_matrix(home))[:6])
    damper[leg] = LEG_DAMPING
    soft = robot.partial_impedance(
        stiffness=spring, damping=package.Natural(plus=damper), constraints=standing
    )
    freed = robot.cancel(effect, constraints=standing)
    data = plant.data
    plant.start(robot, home)
    states = []
    for k in range(round(END / PERIOD) + 1):
        t = k * PERIOD
        q, qd = robot.from_qpos(data.qpos, data.qvel)
        states.append(q)
        wanted = home.copy()
        wanted[leg] = swing(t)
        tau = soft(q, qd, wanted) if title == FELT else freed(q, qd, spring * (wanted - q) - damper * qd)
        push = PUSH if PUSHED[0] <= t < PUSHED[1] else 0.0 * PUSH
        plant.hold(tau, push)
    q = np.array(states)
    places = np.array([robot.kinematics.pose(q, f"{name}_FOOT")[:, :2, 3] for name in STANDS])
    return Run(title, PERIOD * np.arange(len(q)), q, float(np.abs(places - places[:, :1]).max()))


def both(robot: Any, package: Any) -> tuple[Run, Run]:
    """Without cancelling, and with."""
    plant = Plant()
    return run(FELT, robot, package, plant), run(FREED, robot, package, plant)


def turned(robot: Any, run: Run) -> Any:
    """Return how far the trunk has turned from where it began, (samples,), in degrees."""
    turn = robot.kinematics.pose(run.q, "base_link")[:, :3, :3]
    cosine = (np.trace(turn[0].T @ turn, axis1=1, axis2=2) - 1.0) / 2.0
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def picture(robot: Any, runs: Sequence[Run]) -> bytes:
    """PNG."""
    with styled():
        figure = importlib.import_module("matplotlib.figure").Figure(
            figsize=(10.5, 6.0), layout="constrained"
        )
        drawing, curves = figure.subfigures(1, 2, width_ratios=(3.4, 7.0))
        _draw(drawing.subplots(), robot, runs[0])
        panels = curves.subplots(3, 1, sharex=True, height_ratios=(1.6, 3.0, 2.6))
        hip = robot.joint_names.index(f"{SWINGS}_HFE")
        for one in runs:
            look = {"color": TONES[one.title], "label": one.title, "linewidth": 2.0}
            panels[0].plot(one.time, np.degrees(one.q[:, hip]), **look)
            panels[1].plot(one.time, turned(robot, one), **look)
            away = np.linalg.norm(one.q[:, :3] - one.q[0, :3], axis=1)
            panels[2].plot(one.time, 1e3 * away, **look)
        panels[0].set_ylabel("raised thigh\n(deg)")
        panels[1].set_ylabel("trunk has turned by\n(deg)")
        panels[2].set(ylabel="trunk has moved by\n(mm)", xlabel="time (s)", xlim=(0.0, END))
        for panel in panels:
            for begin, end in (THROWN, PUSHED):
                panel.axvspan(begin, end, color=PALE, alpha=0.6, linewidth=0, zorder=0)
        top = {"transform": panels[0].get_xaxis_transform(), "va": "bottom", "ha": "center", "fontsize": 9}
        panels[0].text(sum(THROWN) / 2, 1.02, "the raised leg is thrown about", **top)
        panels[0].text(sum(PUSHED) / 2, 1.02, f"the trunk is pushed: {PUSH[1]:g} N", **top)
        panels[1].legend(loc="upper right")
        figure.suptitle(
            "Solo 12 on three feet in MuJoCo: its trunk gives way to a hand, and no longer to its own leg",
            x=0.012,
            ha="left",
            fontsize=13,
            fontweight="bold",
        )
        return saved(figure, "png", 130)


def _draw(panel: Any, robot: Any, run: Run) -> None:
    """The robot from aside, with the raised leg where it began and at its widest."""
    hip = robot.joint_names.index(f"{SWINGS}_HFE")
    widest = [int(run.q[:, hip].argmin()), int(run.q[:, hip].argmax())]
    for k, alpha in ((0, 1.0), (widest[0], 0.35), (widest[1], 0.35)):
        for leg in ("HR", "HL", "FL", SWINGS):
            if alpha < 1.0 and leg != SWINGS:
                continue
            ends = np.array([_seen(robot, run.q[k], f"{leg}_{part}") for part in PARTS])
            tone = PURPLE if leg == SWINGS else INK
            panel.plot(*ends.T, color=tone, alpha=alpha, linewidth=4.0, solid_capstyle="round")
            if leg != SWINGS:
                panel.plot(*ends[-1], "o", color=INK, markersize=7)
    corners = np.array([_seen(robot, run.q[0], f"{leg}_SHOULDER") for leg in ("FL", "FR", "HR", "HL", "FL")])
    panel.fill(*corners.T, facecolor="#C9CED6", edgecolor=INK, linewidth=2.0, zorder=3)
    middle, tip = corners[:4].mean(0), corners[:4].mean(0) - 0.16 * ASIDE[:, 1] / np.linalg.norm(ASIDE[:, 1])
    panel.annotate("", middle, tip, arrowprops={"arrowstyle": "-|>", "color": VERMILION, "lw": 2.5}, zorder=4)
    panel.text(tip[0], tip[1] - 0.01, "push", color=VERMILION, ha="center", va="top")
    foot = _seen(robot, run.q[widest[1]], f"{SWINGS}_FOOT")
    panel.text(foot[0], foot[1] - 0.02, "raised leg", color=PURPLE, ha="center", va="top")
    panel.set(aspect="equal", xticks=[], yticks=[])
    panel.margins(0.12)
    panel.grid(False)
    for side in panel.spines.values():
        side.set_visible(False)


def _seen(robot: Any, q: Any, frame: str) -> Any:
    """Return where a frame is seen from aside, (2,)."""
    return ASIDE @ robot.kinematics.pose(q, frame)[:3, 3]


def main() -> None:
    """Draw the figure into the folder that --out names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    out = parser.parse_args().out / "control-stance.png"
    with tempfile.TemporaryDirectory() as folder:
        robot, package = solo(Path(folder))
        runs = both(robot, package)
        drawn = picture(robot, runs)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(drawn)
    print(f"drawn into {out}; feet moved by {1e3 * max(one.slipped for one in runs):.1f} mm at most")


if __name__ == "__main__":
    main()
