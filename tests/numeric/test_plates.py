"""Force plates of each type in C3D files, of which the channels are written by the format's own formulas."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import relative_error
from linkwise.analysis.markers.c3d import read_c3d
from linkwise.analysis.markers.force_plates import ForcePlates, PlateWrench
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


def made(kind: int, values: np.ndarray, units: list[str], origin: list[float], **more: Any) -> Any:
    """Return a file with one plate, whose channels (C, S) are in these units.

    more: other numbers of its parameters in FORCE_PLATFORM
    """
    file, (count, samples) = ezc3d.c3d(), values.shape
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["heel"]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["data"]["points"] = np.ones((4, 1, samples))
    named = {"LABELS": [f"c{at}" for at in range(count)], "UNITS": units[:255], "RATE": [100.0]}
    for name, value in {**named, "SCALE": [1.0] * count, "OFFSET": [0] * count}.items():
        file["parameters"]["ANALOG"][name]["value"] = value
    if units[255:]:
        file.add_parameter("ANALOG", "UNITS2", units[255:])
    file["data"]["analogs"] = values[None]
    edges = np.array([[200.0, -200.0, -200.0, 200.0], [-100.0, -100.0, 100.0, 100.0], [0.0] * 4])
    for name, value in {
        "USED": np.array([1]),
        "TYPE": np.array([kind]),
        "ZERO": np.array([0, 0]),
        "CORNERS": (1000 * MIDDLE[:, None] + edges)[:, :, None],
        "ORIGIN": np.array(origin)[:, None],
        "CHANNEL": np.arange(1, 1 + count)[:, None],
        **more,
    }.items():
        file["parameters"]["FORCE_PLATFORM"][name]["value"] = value
    if kind == 4:
        file.add_parameter("FORCE_PLATFORM", "CAL_MATRIX", MIXED[:, :, None])
    return file


def file_of(path: Path, *given: Any, **more: Any) -> ForcePlates:
    """Write what `made` makes, and read it."""
    made(*given, **more).write(str(path / "plate.c3d"))
    return read_c3d(path / "plate.c3d", "+X,+Z").plates


def plate_of(path: Path, *given: Any, **more: Any) -> PlateWrench:
    return file_of(path, *given, **more).wrench(1)


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


def moments(wrench: tuple[np.ndarray, np.ndarray]) -> Channels:
    """Return channels of type 2 that have the wrench."""
    force, moment = wrench
    return of_moments((force @ LAB.T @ PLATE).T, (moment @ LAB.T @ PLATE).T)


@pytest.mark.parametrize(("kind", "channels"), [(2, of_moments), (3, of_sensors), (4, of_voltages)])
def test_an_origin_above_the_surface_is_turned_round_and_told(
    kind: int,
    channels: Callable[[np.ndarray, np.ndarray], Channels],
    wrench: tuple[np.ndarray, np.ndarray],
    tmp_path: Path,
) -> None:
    """ezc3d turns all of it round, which for type 3 has two distances of sensors."""
    force, moment = wrench
    values, units, origin = channels((force @ LAB.T @ PLATE).T, (moment @ LAB.T @ PLATE).T)
    plate = plate_of(tmp_path, kind, values, units, [*origin[:2], -origin[2]])
    assert relative_error(plate.moment, moment) < 1e-6
    (told,) = plate.told
    assert "ORIGIN is above its surface, and is taken with the other sign" in told


def test_units_of_channels_beyond_255_are_read(wrench: tuple[np.ndarray, np.ndarray]) -> None:
    """UNITS2 goes on after UNITS; ezc3d reads such files, and does not write them."""
    values, _, origin = moments(wrench)
    metres = values / np.array([[1.0]] * 3 + [[1000.0]] * 3)
    channels = np.concatenate([np.zeros((254, values.shape[1])), metres])
    units = ["V"] * 254 + ["N"] * 3 + ["Nm"] * 3
    file = made(2, channels, units, origin, CHANNEL=np.arange(255, 261)[:, None])
    plate = ForcePlates(file, 0.001, LAB.T).wrench(1)
    assert relative_error(plate.moment, wrench[1]) < 1e-6
    assert not plate.told


def test_a_matrix_gives_newtons_unless_the_channels_of_its_plate_are_forces(
    wrench: tuple[np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    force, moment = wrench
    values, _, origin = moments(wrench)
    in_metres = values / np.array([[1.0]] * 3 + [[1000.0]] * 3)
    for wanted, units in ((values, ["V"] * 6), (in_metres, ["N"] * 3 + ["Nm"] * 3)):
        plate = plate_of(tmp_path, 4, np.linalg.solve(MIXED, wanted), units, origin)
        assert relative_error(plate.force, force) < 1e-6
        assert relative_error(plate.moment, moment) < 1e-6
    with pytest.raises(LinkwiseError, match="ANALOG:UNITS of a force is 'kN'"):
        plate_of(tmp_path, 4, values, ["kN"] * 3 + ["Nm"] * 3, origin)


def test_frames_in_which_nothing_presses_are_told_with_the_force_there(
    wrench: tuple[np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    values, units, origin = moments(wrench)
    values[:, :10] = 0.0
    for zero in ([0, 0], [1, 10], [9, 4]):
        assert not plate_of(tmp_path, 2, values, units, origin, ZERO=np.array(zero)).told
    values[:3] += np.array([[3.0], [0.0], [4.0]])
    for zero in ([1, 10], [0, 10]):
        (told,) = plate_of(tmp_path, 2, values, units, origin, ZERO=np.array(zero)).told
        assert "nothing presses in frames 1 to 10; its mean force of 5 N there is not taken off" in told


def test_units_may_have_signs_beyond_ascii_in_latin_1(
    wrench: tuple[np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    values, _, origin = moments(wrench)
    for unit in ("Nqmm", "N mm"):
        file_of(tmp_path, 2, values, ["N"] * 3 + [unit] * 3, origin)
        file = tmp_path / "plate.c3d"
        file.write_bytes(file.read_bytes().replace(b"Nqmm", b"N\xb7mm"))
        plate = read_c3d(file, "+X,+Z").plates.wrench(1)
        assert relative_error(plate.moment, wrench[1]) < 1e-6
    with pytest.raises(LinkwiseError, match=r"'nmm'; Nm, .*, Nmm, .*, N mm are read, written so"):
        plate_of(tmp_path, 2, values, ["N"] * 3 + ["nmm"] * 3, origin)


def test_a_plate_that_is_not_read_is_refused_only_when_it_is_asked_for(
    wrench: tuple[np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    values, units, origin = moments(wrench)
    plates = file_of(tmp_path, 5, values, units, origin)
    assert plates.count == 1
    with pytest.raises(LinkwiseError, match="plate 1 is of type 5; types 1, 2, 3, 4 are read"):
        plates.wrench(1)
    plates = file_of(tmp_path, 2, values, units, origin, CHANNEL=np.arange(4, 10)[:, None])
    with pytest.raises(LinkwiseError, match="plate 1: FORCE_PLATFORM:CHANNEL names no 6 of the file's 6"):
        plates.wrench(1)
    assert file_of(tmp_path, 2, values, units, origin, USED=np.array([0])).count == 0


def test_channels_whose_offset_is_below_zero_are_refused(wrench: tuple[np.ndarray, np.ndarray]) -> None:
    """ezc3d drops the sign, so that all would be off by twice the offset."""
    file = made(2, *moments(wrench))
    file["parameters"]["ANALOG"]["OFFSET"]["value"] = [0, -200, 0, 0, 0, 0]
    with pytest.raises(LinkwiseError, match="plate 1: ANALOG:OFFSET of its channels is below 0"):
        ForcePlates(file, 0.001, LAB.T).wrench(1)
    file["parameters"]["ANALOG"]["OFFSET"]["value"] = [-32768] * 6
    file["parameters"]["ANALOG"]["FORMAT"]["value"] = ["UNSIGNED"]
    assert relative_error(ForcePlates(file, 0.001, LAB.T).wrench(1).force, wrench[0]) < 1e-6
    file["parameters"]["POINT"]["SCALE"]["value"] = [0.1]  # then numbers are whole ones
    with pytest.raises(LinkwiseError, match="plate 1: ANALOG:FORMAT is UNSIGNED, and ezc3d reads"):
        ForcePlates(file, 0.001, LAB.T).wrench(1)


def test_a_matrix_of_zeros_beside_another_is_refused(wrench: tuple[np.ndarray, np.ndarray]) -> None:
    matrices = np.dstack([np.zeros((6, 6)), np.eye(6)])
    file = made(4, *moments(wrench))
    file["parameters"]["FORCE_PLATFORM"]["CAL_MATRIX"]["value"] = matrices
    with pytest.raises(LinkwiseError, match="plate 1: FORCE_PLATFORM:CAL_MATRIX is all zeros"):
        ForcePlates(file, 0.001, LAB.T).wrench(1)


def test_corners_that_are_missing_or_do_not_go_round_are_refused(
    wrench: tuple[np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    values, units, origin = moments(wrench)
    edges = np.array([[200.0, -200.0, -200.0, 200.0], [-100.0, -100.0, 100.0, 100.0], [0.0] * 4])
    crossed = edges[:, [0, 1, 3, 2], None]
    for corners, told in ((0.0 * crossed, "does not say where it is"), (crossed, "go round a rectangle")):
        plates = file_of(tmp_path, 2, values, units, origin, CORNERS=corners)
        assert plates.size(1) == pytest.approx(np.linalg.norm(wrench[0], axis=1))
        with pytest.raises(LinkwiseError, match=f"plate 1: FORCE_PLATFORM:CORNERS .*{told}"):
            plates.wrench(1)
