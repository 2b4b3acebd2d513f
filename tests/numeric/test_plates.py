"""Force plates of each type in C3D files, of which the channels are written by the format's own formulas."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import relative_error
from linkwise.analysis.markers.c3d import read_c3d

ezc3d: Any = pytest.importorskip("ezc3d")

LAB = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""From the model's axes, y up, to those of a laboratory, z up."""
PLATE = np.diag([1.0, -1.0, -1.0])
"""From the laboratory's axes to those of the plate, whose z points down, and back."""
MIDDLE = np.array([0.5, -0.1, 0.0])
DEEP = 0.04
"""Depth in m of the place about which a plate measures moments."""
ACROSS, ALONG = 120.0, 200.0
"""Distances in mm of the sensors from the middle of a plate with four of them."""
Channels = tuple[np.ndarray, list[str], list[float]]
"""Values (C, S), their units, and ORIGIN."""


def of_pressure(force: np.ndarray, moment: np.ndarray) -> Channels:
    """Type 1: the force, where it presses, and the free moment."""
    x, y = -moment[1] / force[2], moment[0] / force[2]
    free = moment[2] - (x * force[1] - y * force[0])
    return np.array([*force, 1000 * x, 1000 * y, 1000 * free]), ["N"] * 3 + ["mm"] * 2 + ["Nmm"], [0.0] * 3


def of_moments(force: np.ndarray, moment: np.ndarray) -> Channels:
    """Type 2: the force, and the moment about a place below the surface."""
    below = np.cross([0.0, 0.0, -DEEP], force, axisb=0).T
    return np.concatenate([force, 1000 * (moment + below)]), ["N"] * 3 + ["Nmm"] * 3, [0.0, 0.0, -1000 * DEEP]


def of_sensors(force: np.ndarray, moment: np.ndarray) -> Channels:
    """Type 3: parts of the force, at four sensors of Kistler's."""
    x, y, z = 1000 * (moment + np.cross([0.0, 0.0, -DEEP], force, axisb=0).T)
    pairs = (force[2] + x / ALONG) / 2, (force[2] + y / ACROSS) / 2
    second = pairs[0] / 2 + pairs[1] / 2 - force[2] / 4
    first, third = pairs[0] - second, pairs[1] - second
    back, left = force[0] / 2 + z / ALONG / 4, force[1] / 2 + z / ACROSS / 4
    parts = [force[0] - back, back, left, force[1] - left]
    parts += [first, second, third, force[2] - pairs[0] - third]
    return np.array(parts), ["N"] * 8, [ACROSS, ALONG, -1000 * DEEP]


MIXED = np.eye(6) + 0.05 * np.random.default_rng(0).normal(size=(6, 6))


def of_voltages(force: np.ndarray, moment: np.ndarray) -> Channels:
    """Type 4: six channels, which a matrix makes those of type 2."""
    wrench, _, origin = of_moments(force, moment)
    return np.linalg.solve(MIXED, wrench), ["V"] * 6, origin


@pytest.mark.parametrize(
    ("kind", "channels"), [(1, of_pressure), (2, of_moments), (3, of_sensors), (4, of_voltages)]
)
def test_a_plate_of_each_type_gives_the_wrench_about_its_middle(
    kind: int, channels: Callable[[np.ndarray, np.ndarray], Channels], tmp_path: Path
) -> None:
    time = np.arange(50) / 100
    force = np.column_stack([30 * np.sin(3 * time), 700 + 50 * np.sin(5 * time), 5 + 9 * time])
    moment = np.column_stack([10 * np.sin(4 * time), 3 + time, 20 * np.cos(2 * time)])
    values, units, origin = channels((force @ LAB.T @ PLATE).T, (moment @ LAB.T @ PLATE).T)
    file, count = ezc3d.c3d(), len(values)
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["heel"]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["data"]["points"] = np.ones((4, 1, len(time)))
    named = {"LABELS": [f"c{at}" for at in range(count)], "UNITS": units, "RATE": [100.0]}
    for name, value in {**named, "SCALE": [1.0] * count, "OFFSET": [0] * count}.items():
        file["parameters"]["ANALOG"][name]["value"] = value
    file["data"]["analogs"] = values[None]
    edges = np.array([[200.0, -200.0, -200.0, 200.0], [-100.0, -100.0, 100.0, 100.0], [0.0] * 4])
    for name, value in {
        "USED": np.array([1]),
        "TYPE": np.array([kind]),
        "ZERO": np.array([0, 0]),
        "CORNERS": (1000 * MIDDLE[:, None] + edges)[:, :, None],
        "ORIGIN": np.array(origin)[:, None],
        "CHANNEL": np.arange(1, 1 + count)[:, None],
    }.items():
        file["parameters"]["FORCE_PLATFORM"][name]["value"] = value
    if kind == 4:
        file.add_parameter("FORCE_PLATFORM", "CAL_MATRIX", MIXED[:, :, None])
    file.write(str(tmp_path / "plate.c3d"))
    (plate,) = read_c3d(tmp_path / "plate.c3d", "+X,+Z").plates
    assert relative_error(plate.force, force) < 1e-6
    assert relative_error(plate.moment, moment) < 1e-6
    assert plate.place == pytest.approx(LAB.T @ MIDDLE)
    assert not plate.is_turned
