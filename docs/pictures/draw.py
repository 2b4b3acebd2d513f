"""Pictures that explain: `python docs/pictures/draw.py` draws them anew, beside this file.

who-loads-whom   the throw of docs/tutorial-robot.md at one instant: the arm, and what loads its joints
kinetic-chain    the same throw over time: segments that peak one after the other, and what drives the wrist
indices          joint i, link j and coordinate k of a partial torque
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from linkwise import Payload, analyze
from linkwise.plotstyle import BLUE, GRAVITY, GREEN, INK, PALE, VERMILION, saved, styled
from matplotlib.figure import Figure

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "tests"))

from tools.pages import run_page  # noqa: E402  # in the folder that the line above adds

LENGTHS = (0.30, 0.26, 0.17)
COLOUR_OF = {"shoulder": VERMILION, "elbow": BLUE, "wrist": GREEN}
COLOUR_OF_SEGMENT = {"upper arm": VERMILION, "forearm": BLUE, "hand": GREEN}
INSTANT, BEGIN, RELEASE = 0.3, 0.1, 0.4
"""Seconds of the log: what is drawn, when the shoulder begins to swing, and when the hand is fastest."""


def places(q: np.ndarray) -> np.ndarray:
    """Shoulder, elbow, wrist and ball (4, 2) in the plane of the throw: x forward, z up."""
    angles = np.cumsum(q)
    steps = np.array(LENGTHS)[:, None] * np.column_stack([np.sin(angles), -np.cos(angles)])
    return np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])


def who_loads_whom(throw: Any) -> Any:
    """The arm over the throw, left; what loads each joint at one instant, right."""
    now = int(np.argmin(abs(throw.time - INSTANT)))
    with styled():
        figure = Figure(figsize=(9.2, 3.9), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(0.95, 2))
        _arm(left, throw, now)
        _loads(right, throw, now)
    return figure


def _arm(axis: Any, throw: Any, now: int) -> None:
    for at in range(now - 36, now + 37, 6):
        xz = places(throw.q[at])
        axis.plot(*xz.T, color=PALE, linewidth=2.2, solid_capstyle="round", zorder=1)
    ball = np.array([places(q)[-1] for q in throw.q])
    axis.plot(*ball.T, color="#B8BEC6", linewidth=0.9, linestyle=(0, (2, 2)), zorder=1)
    xz = places(throw.q[now])
    axis.plot(*xz.T, color=INK, linewidth=4.5, solid_capstyle="round", zorder=2)
    axis.plot(*xz[-1], "o", color="white", markeredgecolor=INK, markersize=9, zorder=3)
    for (joint, colour), place in zip(COLOUR_OF.items(), xz, strict=False):
        axis.plot(*place, "o", color=colour, markeredgecolor="white", markersize=10, zorder=4)
        axis.annotate(joint, place, (11, -3), textcoords="offset points", color=colour, weight="bold")
    axis.plot([0, 0], [0, -0.33], color=PALE, linewidth=14, solid_capstyle="round", zorder=0)
    axis.set_aspect("equal")
    axis.set_xlim(-0.42, 0.74)
    axis.axis("off")
    axis.set_title(f"a throw, {INSTANT - BEGIN:.1g} s after it began")


def _loads(axis: Any, throw: Any, now: int) -> None:
    for row in range(len(COLOUR_OF)):
        ends = {1: 0.0, -1: 0.0}
        for value, colour, hatch, label in _parts(throw, now, row):
            side = 1 if value > 0 else -1
            axis.barh(
                row, value, 0.36, ends[side], color=colour, hatch=hatch, edgecolor="white", linewidth=0.6
            )
            if abs(value) > 1.9:
                middle = ends[side] + value / 2
                axis.annotate(label, (middle, row + 0.2), ha="center", va="top", color=colour, fontsize=7.5)
                axis.text(
                    middle, row, f"{value:.1f}", ha="center", va="center", color="white", fontsize=8,
                    bbox={"boxstyle": "round,pad=0.15", "fc": colour, "ec": "none"},
                )  # fmt: skip
            ends[side] += value
        total = throw.torque[now, row]
        axis.plot([total, total], [row - 0.26, row + 0.2], color=INK, linewidth=2)
        axis.annotate(f"{total:.1f}", (total, row - 0.27), ha="center", va="bottom", weight="bold")
    axis.axvline(0, color=INK, linewidth=0.8)
    axis.set_ylim(2.45, -0.6)
    axis.set_yticks(range(3), COLOUR_OF, weight="bold")
    for label, colour in zip(axis.get_yticklabels(), COLOUR_OF.values(), strict=True):
        label.set_color(colour)
    axis.tick_params(axis="y", length=0)
    axis.spines["left"].set_visible(False)
    axis.grid(axis="y", visible=False)
    axis.set_xlabel("torque, N·m")
    axis.set_title("the torque that each joint gives (black), and whose motion asks for it (bars)")


def _parts(throw: Any, now: int, i: int) -> list[tuple[float, str, str, str]]:
    parts = [(throw.gravity[now, i].sum(), GRAVITY, "", "gravity")]
    for k, (joint, colour) in enumerate(COLOUR_OF.items()):
        parts.append((throw.acceleration[now, i, :, k].sum(), colour, "", f"{joint}'s\nacceleration"))
        parts.append((throw.velocity[now, i, :, k].sum(), colour, "////", f"{joint}'s\nvelocity"))
    return [part for part in parts if abs(part[0]) > 0.02]


def kinetic_chain(throw: Any) -> Any:
    """The speed at which each segment turns, left; what drives the wrist and what holds it back, right."""
    with styled():
        figure = Figure(figsize=(9.6, 3.1), layout="constrained")
        left, right = figure.subplots(1, 2)
        shown = (throw.time >= 2 * BEGIN) & (throw.time <= RELEASE + 0.02)
        time = throw.time[shown]
        turns = -np.cumsum(throw.qd, axis=1)[shown]
        for speed, (segment, colour) in zip(turns.T, COLOUR_OF_SEGMENT.items(), strict=True):
            left.plot(time, speed, color=colour, label=segment)
            left.plot(time[speed.argmax()], speed.max(), "o", color=colour, markersize=6)
        left.set_title("how fast each segment turns, rad/s")
        acceleration, velocity = (-part[shown, 2].sum(1) for part in (throw.acceleration, throw.velocity))
        others = -(acceleration + velocity)
        told = (
            ("by the shoulder's motion", others[:, 0], VERMILION),
            ("by the elbow's motion", others[:, 1], BLUE),
            ("gravity", throw.gravity[shown, 2].sum(1), GRAVITY),
            ("net", acceleration[:, 2], INK),
            ("its own muscles", -throw.torque[shown, 2], GREEN),
        )
        for label, value, colour in told:
            right.plot(time, value, color=colour)
            shift = {"gravity": 3, "net": -3}.get(label, 0)  # which end side by side
            place = (time[-1], value[-1])
            right.annotate(
                label, place, (5, shift), textcoords="offset points", color=colour, va="center", weight="bold"
            )
        right.axhline(0, color=INK, linewidth=0.8)
        right.set_title("torque at the wrist, N·m: above zero it drives the throw")
        left.legend(loc="upper left", handlelength=1.6)
        for axis in (left, right):
            axis.set_xlabel("time, s")
            axis.set_xlim(time[0], time[-1])
    return figure


def indices() -> Any:
    """A bent arm of three links: the torque on joint i through link j, by the motion of coordinate k."""
    with styled():
        figure = Figure(figsize=(7.4, 2.9), layout="constrained")
        axis = figure.subplots()
        xz = np.array([[0.0, 0.0], [1.5, 0.75], [3.1, 0.35], [4.4, 1.2]])
        for at, colour in enumerate((PALE, PALE, GREEN)):
            axis.plot(*xz[at : at + 2].T, color=colour, linewidth=13, solid_capstyle="round", zorder=1)
        for at, colour in enumerate((VERMILION, BLUE, "white")):
            axis.plot(*xz[at], "o", color=colour, markeredgecolor=INK, markersize=13, zorder=2)
        axis.plot([-0.22, 0.22], [-0.2, -0.2], color=INK, linewidth=3)
        told = (
            ((0.0, 0.32), (0.0, 0.85), VERMILION, "joint i = 1\nis loaded"),
            ((1.5, 1.0), (1.5, 1.45), BLUE, "coordinate k = 2\nmoves: $\\dot q_2$, $\\ddot q_2$"),
            ((3.75, 0.95), (3.4, 1.45), GREEN, "through link j = 3,\nwhich it carries along"),
        )
        for place, text, colour, words in told:
            axis.annotate(
                words, place, text, color=colour, ha="center", weight="bold", parse_math=True,
                arrowprops={"arrowstyle": "-", "color": colour},
            )  # fmt: skip
        formula = r"$\tau_{13} = \cdots + c2_{132}\,\ddot q_2 + c1_{132}\,\dot q_2 + \cdots + g_{13}$"
        axis.text(2.2, -0.55, formula, ha="center", fontsize=13, parse_math=True)
        axis.set_aspect("equal")
        axis.set_xlim(-0.7, 5.0)
        axis.set_ylim(-0.75, 1.95)
        axis.axis("off")
    return figure


def main() -> None:
    """Draw all, as SVG and PNG."""
    with tempfile.TemporaryDirectory() as folder:
        run_page(HERE.parent / "tutorial-robot.md", Path(folder))
        ball = Payload("hand", 0.145, (0, 0, -0.1), name="ball")
        throw = analyze(Path(folder, "throw.csv"), Path(folder, "out/arm"), payloads=[ball])
    figures = {
        "who-loads-whom": who_loads_whom(throw),
        "kinetic-chain": kinetic_chain(throw),
        "indices": indices(),
    }
    for name, figure in figures.items():
        (HERE / f"{name}.png").write_bytes(saved(figure, "png", 160))


if __name__ == "__main__":
    main()
