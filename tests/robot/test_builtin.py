"""The built-in robots: each can be read by its name, and shows what it is there to show."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from linkwise import check_package, generate, read_system, write_package
from linkwise.robot import BUILT_IN, DESCRIPTIONS, read_robot


@pytest.mark.parametrize("name", [name.split()[0].replace("N", "7") for name in BUILT_IN])
def test_built_in_robot_is_read_by_its_name(name: str) -> None:
    assert read_robot(name).name == name


def test_description_of_what_can_be_read_names_every_robot_and_format() -> None:
    for word in (*BUILT_IN, ".toml", ".urdf", ".xml", "MJCF", ".mjcf", ".py"):
        assert word in DESCRIPTIONS


def test_planar_arms_have_the_torques_of_the_textbook(package_of: Callable[[str], ModuleType]) -> None:
    """Spong, Hutchinson and Vidyasagar, section 7.4: two links, gravity along -y, angles from x."""
    length, centre, mass, inertia, gravity = 0.25, 0.125, 0.6, 5e-3, 9.80665
    q, qd, qdd = np.random.default_rng(2).uniform(-2.0, 2.0, (3, 50, 2))
    turned, (a1, a2), (v1, v2) = np.cos(q[:, 1]), qdd.T, qd.T
    own = inertia + mass * centre**2
    m12 = own + mass * length * centre * turned
    m11 = 2 * own + mass * (length**2 + 2 * length * centre * turned)
    h = mass * length * centre * np.sin(q[:, 1])
    weight = mass * gravity * centre * np.cos(q.sum(1))
    first = mass * gravity * (centre + length) * np.cos(q[:, 0])
    exact = [
        m11 * a1 + m12 * a2 - h * (2 * v1 * v2 + v2**2) + first + weight,
        m12 * a1 + own * a2 + h * v1**2 + weight,
    ]
    answer = package_of("planar2").load("numpy").inverse_dynamics(q, qd, qdd)
    np.testing.assert_allclose(answer, np.stack(exact, -1), rtol=0, atol=1e-14)


def test_the_puma_has_the_gravity_constants_that_were_published_with_it(
    package_of: Callable[[str], ModuleType],
) -> None:
    """Armstrong, Khatib and Burdick 1986, table of constants: the torque on joint 2 at rest.

    By the masses and places that they print the second is -8.454, 0.17 % beside the constant that they print.
    So all are held to 0.2 %, or to half of the last digit.
    """
    q = np.random.default_rng(3).uniform(-3.0, 3.0, (40, 6))
    found = package_of("puma560").load("numpy").inverse_dynamics(q, 0.0 * q, 0.0 * q)[:, 1]
    c2, s2 = np.cos(q[:, 1]), np.sin(q[:, 1])
    c23, s23 = np.cos(q[:, 1] + q[:, 2]), np.sin(q[:, 1] + q[:, 2])
    c4, c5, s5 = np.cos(q[:, 3]), np.cos(q[:, 4]), np.sin(q[:, 4])
    shapes = np.stack([c2, s23, s2, c23, s23 * c5 + c23 * c4 * s5], -1)
    constants, rest, *_ = np.linalg.lstsq(shapes, found, rcond=None)
    assert rest.item() < 1e-20
    published = np.array([-37.2, -8.44, 1.02, 0.249, -0.0282])
    near = np.maximum(2e-3 * abs(published), [0.05, 0.005, 0.005, 0.0005, 0.00005])
    assert (abs(constants - published) <= near).all(), constants


def test_torso_is_a_small_tree() -> None:
    system = read_system("torso")
    assert [link.name for link in system.links] == [
        "chest",
        "left_upper_arm",
        "left_forearm",
        "right_upper_arm",
        "right_forearm",
    ]
    assert system.path(2) == (0, 1, 2, 3, 4)
    assert system.path(4) == (0, 1, 2, 5, 6)


def test_arms_of_the_torso_mirror_each_other() -> None:
    links = {link.name: link for link in read_robot("torso").links}
    for part in ("upper_arm", "forearm"):
        left, right = links[f"left_{part}"], links[f"right_{part}"]
        assert left.mass == right.mass
        # The joints' axes are y: in linkwise's frames of the links z is left and right.
        assert np.array_equal(np.multiply(left.com, (1, 1, -1)), right.com)
        signs = np.outer((1, 1, -1), (1, 1, -1))
        assert np.array_equal(np.multiply(left.inertia, signs), right.inertia)
        assert np.multiply(left.inertia, 1).all()


def test_torso_agrees_with_an_independent_recursion(tmp_path: Path) -> None:
    files = generate(read_system("torso"), ["numpy", "c"])
    write_package(files, tmp_path / "torso")
    assert not any(result.failed for result in check_package(tmp_path / "torso", samples=20))
