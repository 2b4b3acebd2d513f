"""Figures of contacts and of accelerations: their lines and areas are the result's columns."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.motion_logs import LEG, PLANAR3, smooth, write_csv
from linkwise import Contact, Load, generate, read_system, write_package
from linkwise.analysis import Analysis, analyze
from linkwise.analysis.contacts import Contacts
from linkwise.plotstyle import GRAVITY

JOINTS = ("pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r")
LINKS = ("pelvis", "thigh", "shank", "foot")


@pytest.fixture(scope="module")
def stance(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    """A leg that kneels on shank and foot, with plates below both and a push at its pelvis."""
    folder = tmp_path_factory.mktemp("stance")
    write_package(generate(read_system(LEG), ["numpy"]), folder / "leg")
    log = write_csv(folder / "log.csv", smooth(80, 6) * [1, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3], JOINTS)
    time = np.arange(81) / 100
    plates = [
        Load(body, body, np.stack([40 * np.sin(9 * time), size * (time > 0.2), 0 * time], 1), time=time)
        for body, size in (("foot", 500.0), ("shank", 300.0))
    ]
    held = Contact("shank", "point", name="knee"), Contact("foot", "held", (0.1, -0.06, 0.0), name="sole")
    push = Load("push", "pelvis", (50.0, -80.0, 0.0))
    return analyze(log, folder / "leg", contacts=Contacts(held, loads=tuple(plates)), loads=[push])


def heights(area: Any, time: Any) -> Any:
    """Return how far an area reaches from its foot at each instant."""
    corners = area.get_paths()[0].vertices
    return np.array([np.ptp(corners[np.isclose(corners[:, 0], t), 1]) for t in time])


def has_zero_line(panel: Any) -> bool:
    return any(list(line.get_ydata()) == [0, 0] for line in panel.get_lines())


def test_the_ground_bears_areas_of_links_and_lines_of_all(stance: Analysis) -> None:
    panels = stance.figure("contacts").axes
    time, on = stance.time, stance["contact/sole"] > 0
    assert 0 < on.sum() < len(on)
    below = {
        "knee": ("y", "x", "knee_angle_r", "hip_flexion_r"),
        "sole": ("y", "x", "ankle_angle_r", "knee_angle_r", "hip_flexion_r"),
    }
    for c, name in enumerate(below):
        for row, what in enumerate(below[name]):
            panel = panels[2 * row + c]
            lines = {line.get_label(): line.get_ydata() for line in panel.get_lines()}
            if what not in "xy":
                word = {"ankle_angle_r": "ankle", "knee_angle_r": "knee", "hip_flexion_r": "hip"}[what]
                assert panel.get_title(loc="left") == f"torque of right {word} (N·m)"
                np.testing.assert_array_equal(lines["found from the motion"], stance[f"tau/{what}"])
                np.testing.assert_array_equal(lines["by what was measured"], stance[f"tau_as_loads/{what}"])
                assert has_zero_line(panel)
                continue
            whole = stance[f"force/{name} force_{what}"]
            scale = np.abs(whole).max()
            np.testing.assert_allclose(lines["found from the motion"], whole, rtol=0, atol=1e-9 * scale)
            np.testing.assert_array_equal(lines["measured"], stance[f"force_measured/{name} force_{what}"])
            parts = {link: stance[f"force/{name} force_{what}/{link}"] for link in LINKS}
            parts["all else"] = whole - sum(parts.values())
            areas = [area for area in panel.collections if area.get_label() in parts]
            assert len(areas) == 2 * len(parts)
            for at, area in enumerate(areas):
                side = np.maximum if at < len(parts) else np.minimum
                expected = np.abs(side(parts[area.get_label()], 0.0))
                np.testing.assert_allclose(heights(area, time), expected, rtol=0, atol=1e-9 * scale)


def test_torques_without_a_line_of_their_own_are_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("linkwise.analysis.show.induced_figure.MOST", 1)
    result = analyze(write_csv(tmp_path / "log.csv", smooth(60, 3)), PLANAR3, induced=["joints"])
    for panel in result.figure("induced:joints").axes:
        lines = {line.get_label(): line.get_ydata() for line in panel.get_lines()}
        assert "torques of 2 others" in lines
        whole = lines.pop("all together")
        parts = [values for label, values in lines.items() if not label.startswith("_")]
        np.testing.assert_allclose(sum(parts), whole, rtol=0, atol=1e-9 * np.abs(whole).max())


@pytest.mark.parametrize("point", ["joints", "link3,0.25,0.1,0"])
def test_accelerations_are_drawn_source_by_source(point: str, tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(60, 3))
    pull = Load("pull", "link2", (3.0, -5.0, 0.0), point=(0.1, 0.0, 0.0))
    result = analyze(log, PLANAR3, loads=[pull], induced=["centre-of-mass", point])
    joints = ("joint1", "joint2", "joint3")
    shown = joints if point == "joints" else ("x", "y")
    panels = result.figure(f"induced:{point}").axes
    assert len(panels) >= len(shown)
    for component, panel in zip(shown, panels, strict=False):
        assert panel.get_ylabel() == f"{component} ({'rad' if point == 'joints' else 'm'}/s²)"

        def column(kind: str, component: str = component) -> Any:
            """All columns of a kind, by what comes last in their names."""
            head = f"acc{kind}/{point}/{component}"
            return {
                name.rpartition("/")[2]: sum(
                    values
                    for other, values in result.table.items()
                    if other.startswith(f"{head}/") and other.endswith(f"/{name.rpartition('/')[2]}")
                )
                for name in result.table
                if name.startswith(f"{head}/")
            }

        lines = {line.get_label(): line.get_ydata() for line in panel.get_lines()}
        assert has_zero_line(panel)
        (grey,) = (line.get_color() for line in panel.get_lines() if line.get_label() == "gravity")
        assert grey == GRAVITY
        expected = {f"torque of {joint}": values for joint, values in column("_tau").items()}
        expected["gravity"] = sum(column("_gravity").values())
        expected["velocities"] = sum(column("_qd").values()) + sum(column("_kinematic").values())
        expected["load pull"] = column("_load")["pull"]
        expected["all together"] = result[f"acc/{point}/{component}"]
        assert expected.keys() <= lines.keys()
        for label, values in expected.items():
            scale = np.abs(expected["all together"]).max()
            np.testing.assert_allclose(lines[label], values, rtol=0, atol=1e-9 * scale, err_msg=label)
