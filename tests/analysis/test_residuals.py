"""Residuals stand apart from joints: what nothing drives is told, held to limits, and never the largest."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import LEG, PLANAR3, smooth, write_csv
from linkwise import LinkwiseError, Load, Lowpass, Processing, generate, read_system, write_package
from linkwise.analysis import Analysis, analyze
from linkwise.analysis.contacts import Contacts
from linkwise.analysis.show.page import page_data

LEGS = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]
SHOWN = ["pelvis forward", "pelvis up", "pelvis posterior tilt", "right hip", "right knee", "right ankle"]
"""Names of these in figures."""
FORCE = np.array([30.0, 600.0, 0.0])


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A leg whose pelvis floats in a plane, and a log of it."""
    made = tmp_path_factory.mktemp("leg")
    write_package(generate(read_system(LEG), ["numpy"]), made / "leg")
    moving = smooth(80, 6)
    moving[:, 1:] *= 0.2
    moving[:, 2] += 1.0
    write_csv(made / "log.csv", moving, LEGS)
    return made


@pytest.fixture(scope="module")
def pushed(leg: Path) -> Analysis:
    """A push of the ground whose size varies over the movement."""
    time = np.arange(80) / 100
    push = Load("right", "foot", FORCE * (0.5 + 0.5 * np.sin(3 * time))[:, None], time=time)
    return analyze(leg / "log.csv", leg / "leg", loads=[push])


def test_peaks_and_root_mean_squares_are_numpys_and_held_to_external_forces(pushed: Analysis) -> None:
    report = pushed.residual_report
    assert [one.joint for one in report.residuals] == LEGS[:3]
    for i, one in enumerate(report.residuals):
        assert one.peak == pytest.approx(np.abs(pushed.torque[:, i]).max(), rel=1e-12)
        assert one.time == pushed.time[np.abs(pushed.torque[:, i]).argmax()]
        assert one.rms == pytest.approx(np.sqrt((pushed.torque[:, i] ** 2).mean()), rel=1e-12)
    force = np.linalg.norm(FORCE) * (0.5 + 0.5 * np.sin(3 * pushed.time)).max()
    assert report.force == pytest.approx(force, rel=1e-9)
    assert report.height == pytest.approx(height_of(*pushed.q[:, 1:].T).mean(), rel=1e-9)
    assert [one.limit for one in report.residuals] == pytest.approx(
        [0.05 * force, 0.05 * force, 0.01 * force * report.height]
    )
    assert pushed.record()["residuals"]["of"][0]["joint"] == "pelvis_tx"
    assert any("doi:10.1115/1.4029304" in line for line in report.lines)


def height_of(y: Any, tilt: Any, hip: Any, knee: Any, ankle: Any) -> Any:
    """Height of the centre of mass, link by link in the plane."""

    def raised(angle: Any, forward: float, upward: float) -> Any:
        return forward * np.sin(angle) + upward * np.cos(angle)

    thigh, shank, foot = tilt + hip, tilt + hip + knee, tilt + hip + knee + ankle
    hip_at = y + raised(tilt, 0, -0.07)
    knee_at = hip_at + raised(thigh, 0, -0.429)
    ankle_at = knee_at + raised(shank, 0, -0.43)
    heights = {
        50.85: y + raised(tilt, 0, 0.245),
        7.5: hip_at + raised(thigh, 0, -0.186),
        3.49: knee_at + raised(shank, 0, -0.186),
        1.09: ankle_at + raised(foot, 0.09, -0.04),
    }
    return sum(mass * height for mass, height in heights.items()) / sum(heights)


def test_figures_begin_with_a_joint_and_draw_residuals_below_the_others(pushed: Analysis) -> None:
    pytest.importorskip("matplotlib")
    assert "What loads the right hip" in pushed.figure("causes").get_suptitle()
    shares = pushed.figure("shares")
    names = [text.get_text() for text in shares.axes[0].get_yticklabels()]
    assert names == [*SHOWN[3:], *(f"residual {name}" for name in SHOWN[:3])]
    widths = [bar.patches[0].get_width() for bar in shares.axes[0].containers]
    hip = np.abs(pushed.gravity[:, 3].sum(axis=1)).mean()
    every = [np.abs((pushed.acceleration + pushed.velocity)[:, 3, :, k].sum(1)).mean() for k in range(6)]
    whole = hip + np.abs(pushed.load_torque[:, 3, 0]).mean() + sum(every)
    assert widths[0] == pytest.approx(100 * hip / whole)
    power = pushed.figure("power")
    shown = [text.get_text() for text in power.axes[1].get_yticklabels()]
    assert shown == SHOWN[3:]
    assert "Left out, as nothing drives these: pelvis forward" in power.get_supxlabel()
    data = json.loads(page_data(pushed))
    assert [joint["residual"] for joint in data["joints"]] == [True] * 3 + [False] * 3
    assert len(data["residuals"]) == 2
    assert "pelvis_tx (residual)" in pushed._repr_html_()


def test_motors_are_said_to_drive_a_base_and_other_joints_to_be_driven_by_nothing(leg: Path) -> None:
    log, robot = leg / "log.csv", leg / "leg"
    driven = analyze(log, robot, contacts=Contacts(unactuated=("none",)))
    assert driven.residual_report.residuals == ()
    assert driven.robot.moving_itself == tuple(range(6))
    other = analyze(log, robot, contacts=Contacts(unactuated=("ankle_angle_r",)))
    assert [one.joint for one in other.residual_report.residuals] == ["ankle_angle_r"]
    assert other.residual_report.residuals[0].limit is None
    with pytest.raises(LinkwiseError, match="--unactuated toe: leg has no such joint that moves by itself"):
        analyze(log, robot, contacts=Contacts(unactuated=("toe",)))


def test_an_arm_on_the_ground_has_no_residuals(tmp_path: Path) -> None:
    result = analyze(write_csv(tmp_path / "log.csv", smooth(40, 3)), PLANAR3)
    assert result.residual_report.residuals == ()
    assert "residuals" not in result.record()
    assert not list(result.residual_report.lines)


def test_the_command_tells_residuals_and_how_to_say_otherwise(leg: Path, tmp_path: Path) -> None:
    given = ["analyze", leg / "log.csv", "--robot", leg / "leg", "--no-page", "--columns", "sums"]
    told = run_linkwise(*given, "--out", "out", folder=tmp_path).stdout
    assert "residuals, as nothing drives these: peaks of pelvis_tx" in told
    assert "where motors do, add --unactuated none" in told
    driven = run_linkwise(*given, "--out", "driven", "--unactuated", "none", folder=tmp_path).stdout
    assert "residuals" not in driven


def test_cutoffs_name_joints_and_list_residuals_last(leg: Path) -> None:
    pytest.importorskip("matplotlib")
    filtered = Processing(lowpass=Lowpass(6.0))
    result = analyze(leg / "log.csv", leg / "leg", processing=filtered, cutoff_sweep=(4.0, 12.0, 3))
    sweep = result.cutoff_sweep
    assert sweep is not None
    every = [sweep.columns[row].joint in (0, 1, 2) for row in sweep.listed.tolist()]
    assert 0 < sum(every) < len(every)
    assert every == sorted(every)
    at = [next(row for row, one in enumerate(sweep.columns) if one.name == f"tau/{name}") for name in LEGS]
    changes = dict(zip(LEGS, np.abs(sweep.change[at]), strict=True))
    largest = max(LEGS[3:], key=changes.__getitem__)
    assert f"joint torques by up to {100 * changes[largest]:.3g} % ({largest})" in sweep.sentence
    figure = result.figure("cutoff")
    titles = [axis.get_title("left") for axis in figure.axes[::2]]
    assert titles == [
        f"{name}:\nroot mean square" for name in [*SHOWN[3:], *(f"residual {one}" for one in SHOWN[:3])]
    ]
    assert [axis.lines[0].get_label() for axis in figure.axes[::2]] == ["joint torque"] * 3 + ["residual"] * 3
    assert "Residuals stand last" in figure.get_supxlabel()


def test_shares_without_a_certain_sign_begin_with_joints(leg: Path) -> None:
    (leg / "bodies.toml").write_text('schema = 1\n[all]\nmass = "20 %"\ncentre = "20 mm"\n', encoding="utf-8")
    signs = analyze(leg / "log.csv", leg / "leg", uncertain=leg / "bodies.toml").signs
    every = [share.column.joint in (0, 1, 2) for share in signs.uncertain]
    assert 0 < sum(every) < len(every)
    assert every == sorted(every)
    sizes = [abs(share.value) for share in signs.uncertain[: every.count(False)]]
    assert sizes == sorted(sizes, reverse=True)
    assert any(f"asked {name} for" in signs.sentence for name in LEGS[3:])


def test_the_energy_figure_calls_a_base_s_coordinates_residuals(leg: Path) -> None:
    pytest.importorskip("matplotlib")
    result = analyze(leg / "log.csv", leg / "leg", induced_power=True)
    figure = result.figure("energy")
    told = [text.get_text() for axis in figure.axes for text in axis.texts]
    assert "through residuals" in told
    note = figure.get_supxlabel().replace("\n", " ")
    assert "residuals: pelvis forward, pelvis up, pelvis posterior tilt, which nothing drives" in note
    paper = result.figure("paper").get_supxlabel().replace("\n", " ")
    assert "Torques of pelvis forward, pelvis up, pelvis posterior tilt are residuals" in paper
