"""Joints that follow curves of their coordinate: the curves themselves, and every kernel of a package."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from linkwise import (
    LinkwiseError,
    Options,
    check_package,
    generate,
    identify,
    read_system,
    write_package,
)
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.show.page import stick_figure
from linkwise.package.load import import_package
from linkwise.robot.curve import Curve
from linkwise.robot.readers.osim.functions import piecewise_linear, simm_spline

KNEE = f"{DATA / 'knee.osim'} loops"
SPLINE = simm_spline((-2.0, -0.5, 0.1, 1.0), (0.3, -0.1, 0.4, 0.9))
BENT = piecewise_linear((-1.0, 0.2, 1.5), (1.2, -0.6, 0.8))
PARABOLA = Curve((0.0,), ((0.1, 0.5, -0.7),))
PLACES = np.linspace(-4.0, 4.0, 401)


@pytest.mark.parametrize("outer", [SPLINE, BENT, PARABOLA], ids=["spline", "bent", "parabola"])
@pytest.mark.parametrize("inner", [SPLINE, BENT, PARABOLA], ids=["spline", "bent", "parabola"])
def test_a_curve_of_a_curve_is_one(outer: Curve, inner: Curve) -> None:
    whole = outer.after(inner)
    expected = [outer(inner(x)) for x in PLACES]
    np.testing.assert_allclose([whole(x) for x in PLACES], expected, rtol=1e-11, atol=1e-11)


def test_a_spline_passes_its_points_smoothly_and_is_straight_beyond_them() -> None:
    for x, y in ((-2.0, 0.3), (-0.5, -0.1), (0.1, 0.4), (1.0, 0.9)):
        assert SPLINE(x) == pytest.approx(y, abs=1e-15)
        for derivative in (0, 1):
            sides = (SPLINE(x + step, derivative) for step in (-1e-13, 1e-13))
            assert abs(next(sides) - next(sides)) < 1e-11
    assert [SPLINE(x, 2) for x in (-3.0, 2.0)] == [0.0, 0.0]


def test_a_spline_through_four_points_is_the_cubic_through_them() -> None:
    cubic = np.polynomial.Polynomial([0.3, -1.2, 0.7, 0.9])
    x = (-2.0, -0.5, 0.1, 1.0)
    spline, within = simm_spline(x, [float(cubic(at)) for at in x]), np.linspace(-2.0, 1.0, 31)
    np.testing.assert_allclose([spline(at) for at in within], cubic(within), rtol=0, atol=1e-13)


def test_every_back_end_moves_joints_along_their_curves(directory_of: Callable[[str], Path]) -> None:
    failed = [result for result in check_package(directory_of(KNEE), samples=40) if result.failed]
    assert not failed


def test_stiffness_along_curves_is_the_slope_of_each_links_torques(
    directory_of: Callable[[str], Path],
) -> None:
    robot = import_package(directory_of(KNEE)).load("numpy")
    q, qd, qdd = np.random.default_rng(1).uniform(-0.5, 0.5, (3, robot.n))
    steps = 1e-5 * np.eye(robot.n)
    slopes = (robot.partial_torque(q + steps, qd, qdd) - robot.partial_torque(q - steps, qd, qdd)) / 2e-5
    found = robot.position_gradient(q, qd, qdd)
    np.testing.assert_allclose(np.moveaxis(found, -1, 0), slopes, atol=1e-7 * np.abs(slopes).max())


def test_the_stick_figure_stands_where_the_robot_does(directory_of: Callable[[str], Path]) -> None:
    opened, robot = load_robot(directory_of(KNEE)), import_package(directory_of(KNEE)).load("numpy")
    q, tree = np.random.default_rng(3).uniform(-1.5, 1.5, (7, robot.n)), opened.tree
    assert tree is not None
    _, centres = stick_figure(opened, q)
    for name, link in zip(robot.link_names, tree.links, strict=True):
        frame = next(f for f in tree.frames if f.name == name)
        turned = np.array(frame.rotation).T @ (np.array(link.com) - np.array(frame.translation))
        place = robot.kinematics.pose(q, name) @ (*turned, 1.0)
        np.testing.assert_allclose(place[:, :3], centres[:, link.joint], atol=1e-13)


@needs_compiler
def test_a_frame_behind_slides_that_follow_curves_is_pulled_to_where_arrays_pull_it(tmp_path: Path) -> None:
    hips = {f"hip_{turn}": 0.1 for turn in ("adduction", "rotation", "flexion")}
    system = read_system(DATA / "knee.osim", Options(lock=hips))
    write_package(generate(system, ["numpy", "native"]), tmp_path / "knee")
    package = import_package(tmp_path / "knee")
    known, own = (package.load(backend) for backend in ("numpy", "native"))
    q, frame = np.array([-0.4, 0.2]), package.FrameImpedance("foot", stiffness=2.0, rows=("x",))
    target = package.Target(pose=known.kinematics.pose(q + 0.05, "foot"))
    expected, found = (robot.partial_impedance(frame=frame)(q, q, target) for robot in (known, own))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_links_behind_curves_are_not_identified(directory_of: Callable[[str], Path], tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time,ankle_angle\n0,0\n")
    with pytest.raises(LinkwiseError, match="'knee_angle' of knee moves axes by curves, and a URDF file"):
        identify(log, directory_of(KNEE))
