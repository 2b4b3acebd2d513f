"""Panda pushed at its hand, limp, soft and stiff, as MuJoCo moves it: `make demo-control`.

    python tests/tools/demo_control.py [--out out/control] [--sticks]

Writes control-panda.png. Torques are held over 1 ms, and no force is measured, as inertia stays natural.
Where MuJoCo cannot render, or with --sticks, the arm is drawn in lines.
"""

import argparse
import importlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from conftest import LOCKED_FINGERS, PANDA
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise.plotstyle import BLUE, GREEN, INK, PALE, VERMILION, saved, styled

PUSH, BEGIN, STOP, END = 12.0, 0.1, 1.1, 2.0
"""N along y, from when to when, and the end of the record; s."""
SOFT, STIFF = 120.0, 1200.0
"""N/m, along x, y and z."""
SLACK = 2.0
"""N m s/rad of each joint where nothing else holds it."""
TURNS, RATIO = 10.0, 0.9
"""N m/rad of the hand's turns, and damping in a ratio to critical."""
PERIOD = 1e-3
SHOWN = (0.0, 0.5, 1.0, 1.4)
"""s, of the pictures."""
WIDTH, HEIGHT = 600, 440
HAND = "panda_hand_tcp"
ROWS = {
    "Before: no impedance; the arm bears its weight, and each joint is damped a little": VERMILION,
    f"Soft: {SOFT:.0f} N/m at the hand": BLUE,
    f"Stiff: {STIFF:.0f} N/m at the hand": GREEN,
}


@dataclass(frozen=True)
class Pushed:
    """One run."""

    title: str
    stiffness: float
    time: Any
    q: Any
    """(samples, 7)"""
    hand: Any
    """(samples, 3), from where it was, in m."""


def controllers(package: Any, robot: Any, start: Any) -> list[tuple[float, Callable[..., Any]]]:
    """Stiffness along y and torque of (q, qd), for each of ROWS."""
    pose = robot.kinematics.pose(start, HAND)
    jacobian = robot.kinematics.jacobian(start, HAND)
    felt = np.diag(np.linalg.inv(jacobian @ np.linalg.inv(robot.mass_matrix(start)) @ jacobian.T))

    def held(stiffness: float) -> tuple[float, Callable[..., Any]]:
        spring = np.repeat([TURNS, stiffness], 3)
        damper = 2 * RATIO * np.sqrt(spring * felt)
        frame = package.FrameImpedance(HAND, damping=package.Natural(plus=damper), stiffness=spring)
        # What six springs leave free, the elbow's swing, is damped.
        elbow = package.Natural(plus=5.0 * robot.mass_matrix(start))
        controller = robot.partial_impedance(damping=elbow, frame=frame)
        target = package.Target(pose=pose)
        return stiffness, lambda q, qd: controller(q, qd, target)

    limp = robot.partial_impedance(damping=package.Natural(plus=SLACK))
    return [(0.0, limp), held(SOFT), held(STIFF)]


def pushed(package: Any, model: Any, start: Any) -> list[Pushed]:
    """The three runs."""
    from numeric.mujoco_plant import MujocoPlant

    robot = package.load("native" if shutil.which("gcc") else "numpy")
    home, runs = robot.kinematics.pose(start, HAND)[:3, 3], []
    for title, (stiffness, torque) in zip(ROWS, controllers(package, robot, start), strict=True):
        plant, states = MujocoPlant([model], HAND), []
        plant.start(start)
        for _ in range(round(END / PERIOD) + 1):
            states.append(plant.q[0])
            plant.hold(torque(plant.q[0], plant.qd[0])[None], PERIOD, body=_wrench)
        q = np.array(states)
        hand = robot.kinematics.pose(q, HAND)[:, :3, 3] - home
        runs.append(Pushed(title, stiffness, PERIOD * np.arange(len(q)), q, hand))
    return runs


def _wrench(t: float) -> Any:
    return np.array([[0.0, 0.0, 0.0, 0.0, _force(t), 0.0]])


class Camera:
    """Pictures of Panda by MuJoCo."""

    def __init__(self, start: Any) -> None:
        import mujoco
        from numeric.mujoco_plant import panda_spec

        self._mujoco, spec = mujoco, panda_spec(PANDA)
        spec.visual.global_.offwidth, spec.visual.global_.offheight = WIDTH, HEIGHT
        spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.4] * 3, [0.35] * 3
        spec.worldbody.add_light(pos=[1.5, -1.5, 3.0], dir=[-0.5, 0.5, -1.0], diffuse=[0.5] * 3)
        for geom in spec.geoms:
            geom.rgba = [0.93, 0.94, 0.96, 1.0]
        disc = mujoco.mjtGeom.mjGEOM_CYLINDER
        spec.worldbody.add_geom(type=disc, name="floor", size=[0.95, 0.004, 0.0], rgba=[0.8, 0.82, 0.85, 1.0])
        self._model = spec.compile()
        self._floor = self._model.geom("floor").id
        self._renderer = mujoco.Renderer(self._model, HEIGHT, WIDTH)
        self._view = mujoco.MjvCamera()
        self._view.lookat, self._view.distance = [0.27, 0.17, 0.4], 1.42
        self._view.azimuth, self._view.elevation = 205, -24
        self._began = self._seen(start)

    def picture(self, q: Any, force: float) -> Any:
        """The arm, its outline where it began, and an arrow where it is pushed; (height, width, 3)."""
        image, arm = self._seen(q)
        began, where = self._began
        left = where & ~arm
        image[left] = 0.5 * image[left] + 0.5 * (0.4 * began[left] + 0.6 * np.array([70.0, 120.0, 200.0]))
        if force:
            without, with_arrow = self._renderer.render(), self._with_arrow(force)
            drawn = (without != with_arrow).any(-1)
            image[drawn] = with_arrow[drawn]
        return image

    def _seen(self, q: Any) -> tuple[Any, Any]:
        """An image on white, and which pixels are the arm's."""
        self._data = self._mujoco.MjData(self._model)
        self._data.qpos[:] = q
        self._mujoco.mj_forward(self._model, self._data)
        self._renderer.update_scene(self._data, self._view)
        image = self._renderer.render()
        self._renderer.enable_segmentation_rendering()
        shapes = self._renderer.render()[..., 0]
        self._renderer.disable_segmentation_rendering()
        image[shapes < 0] = 255
        return image, (shapes >= 0) & (shapes != self._floor)

    def _with_arrow(self, force: float) -> Any:
        mujoco, scene = self._mujoco, self._renderer.scene
        tip = self._data.body(HAND).xpos - [0.0, 0.05, 0.0]
        arrow, red = mujoco.mjtGeom.mjGEOM_ARROW, np.array([0.85, 0.1, 0.05, 1.0], np.float32)
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, arrow, np.zeros(3), np.zeros(3), np.eye(3).ravel(), red)
        mujoco.mjv_connector(geom, arrow, 0.016, tip - [0.0, 0.018 * force, 0.0], tip)
        scene.ngeom += 1
        return self._renderer.render()


def photographed(runs: Sequence[Pushed], folder: Path) -> Any:
    """Pictures (runs, instants, height, width, 3) by MuJoCo, or None where it cannot render.

    In a process of its own: what MuJoCo renders with is chosen as it is imported, and one that is not there
    may end the process.
    """
    asked, made = folder / "asked.npy", folder / "made.npy"
    np.save(asked, [[run.q[round(t / PERIOD)] for t in SHOWN] for run in runs])
    for way in [os.environ["MUJOCO_GL"]] if "MUJOCO_GL" in os.environ else ["egl", "osmesa"]:
        call = [sys.executable, __file__, "--photograph", str(asked), str(made)]
        done = subprocess.run(call, env=os.environ | {"MUJOCO_GL": way}, capture_output=True, text=True)
        if not done.returncode:
            return np.load(made)
    return None


def photograph(asked: Path, made: Path) -> None:
    """Write the pictures that `photographed` asks of its process."""
    camera = Camera(np.load(asked)[0, 0])
    rows = [[camera.picture(q, _force(t)) for q, t in zip(row, SHOWN, strict=True)] for row in np.load(asked)]
    np.save(made, np.array(rows))


def _force(t: float) -> float:
    return PUSH if BEGIN <= t < STOP else 0.0


def picture(runs: Sequence[Pushed], photographs: Any, robot: Any) -> bytes:
    """PNG of a film strip of each run, and of how far the hand goes."""
    with styled():
        figure = importlib.import_module("matplotlib.figure").Figure(
            figsize=(11.0, 11.6), layout="constrained"
        )
        strips, chart = figure.subfigures(2, 1, height_ratios=(8.6, 3.0))
        for row, (strip, run) in enumerate(zip(strips.subfigures(3, 1), runs, strict=True)):
            strip.suptitle(
                run.title, x=0.012, ha="left", fontsize=12, fontweight="bold", color=ROWS[run.title]
            )
            for column, panel in enumerate(strip.subplots(1, len(SHOWN))):
                if photographs is None:
                    _sticks(
                        panel, robot, run.q[0], run.q[round(SHOWN[column] / PERIOD)], _force(SHOWN[column])
                    )
                else:
                    panel.imshow(photographs[row, column])
                _named(panel, run, SHOWN[column])
        _chart(chart.subplots(), runs)
        figure.suptitle(
            f"A robot's hand is pushed by {PUSH:g} N for {STOP - BEGIN:g} s (arrow); blue is where it began",
            x=0.012,
            ha="left",
            fontsize=14,
            fontweight="bold",
        )
        return saved(figure, "png", 100)


def _named(panel: Any, run: Pushed, t: float) -> None:
    moved = 1e3 * np.linalg.norm(run.hand[round(t / PERIOD)])
    pushed_now = ", pushed" if _force(t) else ", let go" if t >= STOP else ""
    panel.set_title(f"{t:.2f} s{pushed_now}", loc="center", fontsize=9, pad=2)
    panel.set_xlabel(f"hand moved by {moved:.0f} mm")
    panel.set(xticks=[], yticks=[])
    panel.grid(False)
    for side in panel.spines.values():
        side.set_visible(False)


def _sticks(panel: Any, robot: Any, start: Any, now: Any, force: float) -> None:
    """The arm in lines, seen from above its front."""
    for q, tone, width in ((start, "#9DB8DE", 3.0), (now, INK, 4.0)):
        frames = robot.kinematics.poses(q)[:, :3, 3]
        chain = [robot.kinematics.frames.index(f"panda_link{k}") for k in range(8)]
        points = np.array([*frames[chain], frames[robot.kinematics.frames.index(HAND)]])
        turn = np.radians(205.0)
        across = points @ [np.sin(turn), -np.cos(turn), 0.0]
        up = points @ [0.4 * np.cos(turn), 0.4 * np.sin(turn), 0.92]
        panel.plot(across, up, color=tone, linewidth=width, solid_capstyle="round", marker="o", markersize=4)
    if force:
        panel.annotate(
            "",
            (across[-1] - 0.03, up[-1]),
            (across[-1] - 0.3, up[-1]),
            arrowprops={"arrowstyle": "-|>", "color": VERMILION, "linewidth": 3},
        )
    panel.set(xlim=(-0.6, 0.75), ylim=(-0.08, 0.86), aspect="equal")


def _chart(panel: Any, runs: Sequence[Pushed]) -> None:
    most = 1.7e3 * PUSH / SOFT
    for run in runs:
        panel.plot(run.time, 1e3 * run.hand[:, 1], color=ROWS[run.title], label=run.title, linewidth=2.2)
        if run.stiffness:
            settled = 1e3 * PUSH / run.stiffness
            panel.axhline(settled, color=ROWS[run.title], linestyle=(0, (2, 2)), linewidth=1.2)
            panel.text(
                (BEGIN + STOP) / 2,
                settled,
                f"{PUSH:g} N / {run.stiffness:g} N/m = {settled:.0f} mm",
                color=ROWS[run.title],
                ha="center",
                va="bottom",
            )
    panel.axvspan(BEGIN, STOP, color=PALE, alpha=0.7, linewidth=0, zorder=0)
    panel.text((BEGIN + STOP) / 2, 0.97 * most, "pushed", ha="center", va="top")
    panel.set(
        xlim=(0.0, END), ylim=(-0.05 * most, most), xlabel="time (s)", ylabel="hand along the push (mm)"
    )
    panel.legend(loc="upper right", handlelength=2.5)


def main() -> None:
    """Draw the strip into the folder that --out names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/control"))
    parser.add_argument("--sticks", action="store_true", help="draw lines, even where MuJoCo could render")
    parser.add_argument("--photograph", nargs=2, type=Path, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.photograph:
        return photograph(*chosen.photograph)
    from numeric.mujoco_plant import PANDA_AT_WORK, panda_model

    with tempfile.TemporaryDirectory() as folder:
        system = read_system(PANDA, Options(lock=LOCKED_FINGERS))
        write_package(generate(system), Path(folder) / "panda")
        package = import_package(Path(folder) / "panda")
        runs = pushed(package, panda_model(PANDA), PANDA_AT_WORK)
        photographs = None if chosen.sticks else photographed(runs, Path(folder))
        if photographs is None and not chosen.sticks:
            print("MuJoCo cannot render here (neither EGL nor OSMesa): the arm is drawn in lines")
        png = picture(runs, photographs, package.load("numpy"))
    for run in runs:
        settled = 1e3 * run.hand[round(STOP / PERIOD) - 1, 1]
        print(f"{run.title}: {settled:.1f} mm along the push at its end")
    chosen.out.mkdir(parents=True, exist_ok=True)
    (chosen.out / "control-panda.png").write_bytes(png)
    print(f"drawn into {chosen.out / 'control-panda.png'}")


if __name__ == "__main__":
    main()
