"""Force plates of each type in C3D files, of which the channels are written by the format's own formulas."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import relative_error
from linkwise.analysis.markers.c3d import read_c3d
from linkwise.analysis.markers.force_plates import PlateWrench, plate_wrenches
from linkwise.errors import LinkwiseError

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


@pytest.fixture
def wrench() -> tuple[np.ndarray, np.ndarray]:
    """A force and a moment about the plate's middle, (S, 3), in the model's axes."""
    time = np.arange(50) / 100
    force = np.column_stack([30 * np.sin(3 * time), 700 + 50 * np.sin(5 * time), 5 + 9 * time])
    return force, np.column_stack([10 * np.sin(4 * time), 3 + time, 20 * np.cos(2 * time)])


def plate_of(path: Path, kind: int, values: np.ndarray, units: list[str], origin: list[float]) -> PlateWrench:
    """Read a file with one plate, whose channels (C, S) are in these units."""
    file, (count, samples) = ezc3d.c3d(), values.shape
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["heel"]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["data"]["points"] = np.ones((4, 1, samples))
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
    file.write(str(path / "plate.c3d"))
    (plate,) = read_c3d(path / "plate.c3d", "+X,+Z").plates
    return plate


@pytest.mark.parametrize("metres", [False, True], ids=["as said", "in m and Nm, where they are"])
@pytest.mark.parametrize(
    ("kind", "channels"), [(1, of_pressure), (2, of_moments), (3, of_sensors), (4, of_voltages)]
)
def test_a_plate_of_each_type_gives_the_wrench_about_its_middle(
    kind: int,
    channels: Callable[[np.ndarray, np.ndarray], Channels],
    metres: bool,
    wrench: tuple[np.ndarray, np.ndarray],
    tmp_path: Path,
) -> None:
    force, moment = wrench
    values, units, origin = channels((force @ LAB.T @ PLATE).T, (moment @ LAB.T @ PLATE).T)
    if metres:
        values = values / np.array([[1000.0 if unit in ("mm", "Nmm") else 1.0] for unit in units])
        units = [unit.replace("mm", "m") for unit in units]
    plate = plate_of(tmp_path, kind, values, units, origin)
    assert relative_error(plate.force, force) < 1e-6
    assert relative_error(plate.moment, moment) < 1e-6
    assert plate.place == pytest.approx(LAB.T @ MIDDLE)
    assert not plate.told


def test_units_of_a_plate_are_refused_where_they_are_unknown_and_told_where_they_are_not_said(
    wrench: tuple[np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    force, moment = wrench
    values, _, origin = of_moments((force @ LAB.T @ PLATE).T, (moment @ LAB.T @ PLATE).T)
    for units, told in (
        (["kN"] * 3 + ["Nmm"] * 3, r"plate 1: ANALOG:UNITS of a force is 'kN'; N are read"),
        (["V"] * 6, "of a force is 'V'"),
        (["N"] * 3 + ["Nm", "Nm", "Nmm"], "of a moment is 'Nm', 'Nmm'; Nm, N.m, "),
        (["N", "", "N", "Nmm", "Nmm", "Nmm"], "of a force is '', 'N'"),
    ):
        with pytest.raises(LinkwiseError, match=told):
            plate_of(tmp_path, 2, values, units, origin)
    plate = plate_of(tmp_path, 2, values, [""] * 6, origin)
    assert relative_error(plate.moment, moment) < 1e-6
    assert plate.told == ("plate 1: the unit of a force is not said; N and N times POINT:UNITS are taken",)


def test_a_file_that_says_no_units_at_all_is_read_and_another_type_of_plate_is_refused() -> None:
    turned = np.eye(3)
    assert list(plate_wrenches({"parameters": {}, "data": {}}, 1.0, turned)) == []
    plate = {"TYPE": {"value": [5]}, "CHANNEL": {"value": np.ones((6, 1))}}
    file = {"parameters": {"FORCE_PLATFORM": plate}, "data": {"platform": [{}]}}
    with pytest.raises(LinkwiseError, match="plate 1 is of type 5; types 1, 2, 3, 4 are read"):
        list(plate_wrenches(file, 1.0, turned))
