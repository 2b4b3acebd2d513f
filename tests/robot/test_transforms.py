"""Rotations: conventions, the snapping of entries that are whole but for rounding, and what comes of it."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers.urdf_text import chain, joint
from linkwise import read_system
from linkwise.dynamics.derive import derive
from linkwise.robot.transforms import (
    about_z,
    align_z,
    compose,
    from_quaternion,
    from_rpy,
    rotate,
    rotate_inertia,
    snap,
    snapped,
    transpose,
)

QUARTER = math.pi / 2
RPY = (0.3, -0.7, 1.9)


def turn(axis: int, angle: float) -> np.ndarray:
    """Rodrigues about one axis of the frame."""
    k = np.cross(np.eye(3), np.eye(3)[axis]).T
    return np.eye(3) + math.sin(angle) * k.T + (1 - math.cos(angle)) * k @ k


def test_roll_pitch_yaw_turn_about_x_then_y_then_z_of_the_parent() -> None:
    roll, pitch, yaw = RPY
    np.testing.assert_allclose(from_rpy(*RPY), turn(2, yaw) @ turn(1, pitch) @ turn(0, roll), atol=1e-15)


def test_a_quaternion_is_half_the_angle_about_its_axis() -> None:
    for axis in range(3):
        half = [math.cos(0.4), *(math.sin(0.4) * np.eye(3)[axis])]
        np.testing.assert_allclose(from_quaternion(*half), turn(axis, 0.8), atol=1e-15)
    w, x, y, z = 0.5, -0.5, 0.1, 0.7
    full = np.array(from_quaternion(w, x, y, z))
    np.testing.assert_allclose(full @ full.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(full @ (x, y, z), (x, y, z), atol=1e-15)


def test_products_and_turns_are_those_of_matrices() -> None:
    a, b = snap(from_rpy(*RPY)), snap(from_rpy(1.1, 0.2, -0.4))
    np.testing.assert_allclose(compose(a, b), np.array(a) @ b, atol=1e-15)
    np.testing.assert_allclose(transpose(a), np.array(a).T)
    np.testing.assert_allclose(rotate(a, (1.0, 2.0, 3.0)), np.array(a) @ (1.0, 2.0, 3.0), atol=1e-15)
    np.testing.assert_allclose(about_z(0.7), turn(2, 0.7), atol=1e-15)
    inertia = ((3.0, 0.1, 0.2), (0.1, 4.0, 0.3), (0.2, 0.3, 5.0))
    turned = rotate_inertia(a, inertia)
    np.testing.assert_allclose(np.array(turned, float), np.array(a) @ inertia @ np.array(a).T, atol=1e-14)
    assert turned == tuple(zip(*turned, strict=True))


AXES = [
    *np.eye(3),
    *-np.eye(3),
    (0.6, 0.0, 0.8),
    (0.0, -0.6, -0.8),
    (1 / 3, -2 / 3, 2 / 3),
    (0.0, 1e-3, -1.0),
]


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_aligning_turns_z_to_the_axis_and_permutes_for_an_axis_of_the_frame(axis: tuple[float, ...]) -> None:
    unit = np.array(axis) / np.linalg.norm(axis)
    rotation = np.array(align_z(unit))
    np.testing.assert_allclose(rotation[:, 2], unit, atol=1e-15)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    if np.count_nonzero(axis) == 1:
        assert set(np.abs(rotation).reshape(-1)) == {0.0, 1.0}


def test_entries_within_1e_12_of_a_whole_number_become_it_where_rows_stay_orthonormal() -> None:
    e = 0.9e-12
    rows = [(-e, -1 + e, e), (1 - e, e, -e), (e, -e, 1 - e)]
    whole = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert snapped(rows) == (whole, True)
    assert snapped(whole) == (whole, False)
    assert math.copysign(1.0, snap(rows)[0][0]) == 1.0
    tilted = [(1 - e, 0.0, 1.3e-6), (0.0, 1.0, 6e-17), (-1.3e-6, 0.0, 1 - e)]
    assert snap(tilted) == ((1 - e, 0.0, 1.3e-6), (0.0, 1.0, 0.0), (-1.3e-6, 0.0, 1 - e))
    for left in (1 - 1.1e-12, -1 + 1.1e-12, 1.1e-12, -1.1e-12, 0.5):
        assert snap([(left, left, left)])[0] == (left, left, left)
    assert snap([(math.nan, math.inf, 0.25)])[0][1:] == (math.inf, 0.25)


def test_right_angles_cost_no_more_than_the_permutations_they_are(tmp_path: Path) -> None:
    costs, notes = [], []
    for name, angle in (("exact", "1.5707963267948966"), ("near", "1.57079632679")):
        file = tmp_path / f"{name}.urdf"
        file.write_text(
            chain(*(joint(a + b, a, b, rpy=f"{angle} 0 0", axis="0 0 1") for a, b in ("ab", "bc")))
        )
        system = read_system(file)
        costs.append(sum(forms.decomposition_cost for forms in derive(system)))
        notes.append({note.subject for note in system.notes if note.kind == "snapped"})
    assert costs[0] < costs[1]
    assert notes == [{"ab", "bc"}, set()]


@pytest.mark.parametrize("angle", [1.570796, 1.5707963, 1e-6, 3.14159])
def test_a_rounded_angle_stays_a_rotation(angle: float) -> None:
    for rpy in ((angle, 0.0, 0.0), (0.0, angle, 0.0), (0.3, 0.0, angle)):
        rows = np.array(compose(snap(from_rpy(*rpy)), about_z(angle)))
        np.testing.assert_allclose(rows @ rows.T, np.eye(3), rtol=0, atol=4e-15)
