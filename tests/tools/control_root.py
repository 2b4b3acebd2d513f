"""The arm of Table 2 with link 3 thrown about, and its effect on the root cancelled: docs/control-root.png.

    python tests/tools/control_root.py [--out docs]

Joints 2 and 3 move as they are told, link 3 alone for a while and then link 2 as well. Nobody drives the
root: its motor bears the arm's weight and, in the second run, cancels what link 3's motion does to it.
"""

import argparse
import importlib
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise.plotstyle import INK, PALE, PURPLE, colour, saved, styled

START = np.array([1.2, -0.6, -0.9])
LINK_3_MOVES, LINK_2_MOVES, END = 0.25, 1.75, 3.5
"""s; link 2 rests before LINK_2_MOVES."""
THROW = 0.75
"""s, of link 3's throw and its return."""
CANCELLED = {("joint1", "link3", None, None)}
"""Torques of link 3 on joint 1, whichever joint's motion moves it, by acceleration and by velocity."""
SHOWN = (0.0, 0.62, 1.0, 2.12, 2.5, 2.88, 3.4)
"""s, of the drawings."""
FELT, FREED = "Nothing cancelled", "Link 3's effect on joint 1 cancelled"
TONES = {FELT: "#444444", FREED: PURPLE}
SAID = {
    FELT: "The links' torques balance: the root gives way",
    FREED: "The motor answers link 3: links 1 and 2 are by themselves",
}
EVERY, STEP = 0.02, 0.005
"""s, of samples and of RK4's steps."""
STIFFNESS, DAMPING = 400.0, 40.0
"""1/s^2 and 1/s, by which joints 2 and 3 are kept on their motion."""


def led(t: float) -> tuple[Any, Any, Any]:
    """Angle, velocity and acceleration that joints 2 and 3 are told, (2,) each."""

    def swing(t: float, size: float, seconds: float, times: int) -> Any:
        if not 0.0 <= t <= times * seconds:
            return np.zeros(3)
        w = np.pi / seconds  # size * sin^4, which begins and ends without a jerk
        s, c = np.sin(w * t), np.cos(w * t)
        return size * np.array([s**4, 4 * w * s**3 * c, 4 * w * w * s * s * (3 * c * c - s * s)])

    second = swing(t - LINK_2_MOVES, 1.0, END - 0.25 - LINK_2_MOVES, 1)
    third = swing(t - LINK_3_MOVES, 2.0, THROW, 4)
    q, qd, qdd = np.transpose([second, third])
    return START[1:] + q, qd, qdd


def task(robot: Any, kept: Any, t: float, q: Any, qd: Any) -> Any:
    """Torques (3,) that keep joints 2 and 3 on their motion and leave the root alone.

    kept: (3, 3, 3), 0 for the propagation torques that are cancelled besides
    """
    c2, c1, _ = robot.coefficients(q, qd)
    mass, force = (kept * c2).sum(1), (kept * c1).sum(1) @ qd
    at, rate, wanted = led(t)
    wanted = wanted + DAMPING * (rate - qd[1:]) + STIFFNESS * (at - q[1:])
    root = -(mass[0, 1:] @ wanted + force[0]) / mass[0, 0]
    return mass @ np.r_[root, wanted] + force


@dataclass(frozen=True)
class Run:
    """One of the two motions; torques without what bears the weight, in N m."""

    title: str
    time: Any
    q: Any
    through: Any
    """(samples, 3): on joint 1 by the motion of each link."""
    motor: Any
    """(samples,): what the root's motor gives beyond the arm's weight."""
    joints: Any
    """(samples, 4, 2): where the joints and the tip are, in m."""


def moved(robot: Any, title: str, cancelled: Any) -> Run:
    """The motion with some propagation torques cancelled, or None."""
    controller = None if cancelled is None else robot.cancel(cancelled)
    kept = np.ones((3, 3, 3))
    for entry in controller.entries if controller else ():
        kept[robot.joint_index(entry[0]), robot.link_index(entry[1])] = 0.0

    def tau(t: float, q: Any, qd: Any) -> Any:
        asked = task(robot, kept, t, q, qd)
        return robot.gravity_torque(q) + asked if controller is None else controller(q, qd, asked)

    motion = robot.simulate(START, np.zeros(3), np.arange(0.0, END + EVERY / 2, EVERY), tau, step=STEP)
    q, qd = motion.q, motion.qd
    weight = robot.gravity_torque(q)
    share = robot.propagation(q, qd, robot.forward_dynamics(q, qd, motion.tau))
    through = (share.acceleration + share.velocity)[:, 0].sum(-1)
    ends = [*(robot.kinematics.pose(q, f"link{k}")[:, :2, 3] for k in (1, 2, 3))]
    tip = robot.kinematics.pose(q, "link3") @ np.array([0.25, 0.0, 0.0, 1.0])
    return Run(title, motion.time, q, through, (motion.tau - weight)[:, 0], np.stack([*ends, tip[:, :2]], 1))


def both(robot: Any) -> tuple[Run, Run]:
    """Without cancelling, and with."""
    return (
        moved(robot, FELT, None),
        moved(robot, FREED, CANCELLED),
    )


def picture(runs: Sequence[Run]) -> bytes:
    """PNG."""
    with styled() as matplotlib:
        matplotlib.rcParams["axes.titlesize"] = 11
        figure = importlib.import_module("matplotlib.figure").Figure(
            figsize=(10.5, 9.6), layout="constrained"
        )
        strips, angle, torques = figure.subfigures(3, 1, height_ratios=(4.2, 2.5, 3.4))
        for strip, run in zip(strips.subfigures(2, 1), runs, strict=True):
            _strip(strip, run)
        _angle(angle.subplots(), runs)
        panels = torques.subplots(1, 2, sharey=True)
        for panel, run in zip(panels, runs, strict=True):
            _torque(panel, run)
        panels[0].set_ylabel("torque on joint 1 (N m)")
        torques.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        figure.suptitle(
            "What link 3, thrown about, does to the root of the arm, which nobody drives",
            x=0.012,
            ha="left",
            fontsize=14,
            fontweight="bold",
        )
        return saved(figure, "png", 130)


def _strip(figure: Any, run: Run) -> None:
    """The arm at some instants, beside where its root began."""
    figure.suptitle(run.title, x=0.012, ha="left", fontsize=11, fontweight="bold", color=TONES[run.title])
    for panel, t in zip(figure.subplots(1, len(SHOWN)), SHOWN, strict=True):
        k = round(t / EVERY)
        began, now = run.joints[0], run.joints[k]
        reach = 2.6 * began[1]
        panel.plot(*np.transpose([0.0 * reach, reach]), color="#9AA1AA", linestyle=(0, (3, 2)), linewidth=1.2)
        for link in range(3):
            ends = now[link : link + 2].T
            panel.plot(*ends, color=colour(link), linewidth=5.0, solid_capstyle="round")
        if not k and run.title == FELT:
            for link, (x, y) in enumerate((now[:-1] + now[1:]) / 2):
                place = (x + 0.05, y - 0.06) if link < 2 else (x + 0.02, y + 0.05)
                panel.text(*place, f"link {link + 1}", color=colour(link), fontsize=8)
        panel.plot(*now[:3].T, "o", color="white", markeredgecolor=INK, markersize=5.5, zorder=5)
        turned = np.degrees(run.q[k, 0] - run.q[0, 0])
        panel.set_title(f"{t:.2f} s", fontsize=9, loc="center", pad=2)
        # a root that has not moved says 0, not -0
        panel.set_xlabel(
            f"root {round(turned) + 0:+d}\N{DEGREE SIGN}" if round(turned) else "root 0\N{DEGREE SIGN}"
        )
        panel.set(xlim=(-0.2, 0.72), ylim=(-0.06, 0.72), aspect="equal", xticks=[], yticks=[])
        panel.grid(False)
        for side in panel.spines.values():
            side.set_visible(False)


def _angle(panel: Any, runs: Sequence[Run]) -> None:
    for run in runs:
        turned = np.degrees(run.q[:, 0] - run.q[0, 0])
        panel.plot(run.time, turned, color=TONES[run.title], label=run.title, linewidth=2.2)
    panel.set(xlim=(0.0, END), ylabel="root has turned by (deg)", xlabel="time (s)")
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + 0.3 * (high - low))
    _phases(panel, True)
    panel.legend(loc="lower left")


def _torque(panel: Any, run: Run) -> None:
    for link in range(3):
        panel.plot(
            run.time, run.through[:, link], color=colour(link), label=f"by the motion of link {link + 1}"
        )
    panel.plot(run.time, run.motor, color=INK, linestyle=(0, (4, 2)), label="of the motor, beyond the weight")
    panel.set_title(SAID[run.title], color=TONES[run.title])
    panel.set(xlim=(0.0, END), xlabel="time (s)")
    _phases(panel, False)


def _phases(panel: Any, named: bool) -> None:
    """Shade the time in which link 2 moves as well."""
    panel.axvspan(LINK_2_MOVES, END - 0.25, color=PALE, alpha=0.6, linewidth=0, zorder=0)
    if named:
        top = {"transform": panel.get_xaxis_transform(), "va": "top", "ha": "center"}
        panel.text((LINK_3_MOVES + LINK_2_MOVES) / 2, 0.97, "only link 3 moves", **top)
        panel.text(
            (LINK_2_MOVES + END - 0.25) / 2, 0.97, "link 2 moves as well: its effect is left alone", **top
        )


def main() -> None:
    """Draw the figure into the folder that --out names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs"))
    out = parser.parse_args().out / "control-root.png"
    with tempfile.TemporaryDirectory() as folder:
        write_package(generate(read_system("planar3"), ["numpy"]), Path(folder) / "planar3")
        runs = both(import_package(Path(folder) / "planar3").load("numpy"))
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(picture(runs))
    print(f"drawn into {out}")


if __name__ == "__main__":
    main()
