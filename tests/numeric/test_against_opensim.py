"""OpenSim models as they are read, beside OpenSim itself: every kind of joint, coupling and function."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

osim = pytest.importorskip("opensim", reason="needs opensim: pip install opensim")

X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def spline(*points: tuple[float, float]) -> Any:
    made = osim.SimmSpline()
    for x, y in points:
        made.addPoint(x, y)
    return made


def lines(*points: tuple[float, float]) -> Any:
    made = osim.PiecewiseLinearFunction()
    for x, y in points:
        made.addPoint(x, y)
    return made


KNEE = spline((-2.1, -0.003), (-1.2, 0.004), (-0.3, -0.001), (0.2, -0.005), (2.1, -0.006))
ROLL = spline((-2.1, 0.3), (-0.9, -0.2), (0.1, 0.25), (1.0, 0.1), (2.1, -0.4))


def custom(ends: Any, name: str, axes: dict[str, tuple[tuple[float, ...], str, Any]]) -> Any:
    """A CustomJoint of its spatial transform: for each axis direction, coordinate and function."""
    transform = osim.SpatialTransform()
    for axis, (direction, coordinate, function) in axes.items():
        made = getattr(transform, f"upd_{axis}")()
        made.set_coordinates(0, coordinate) if coordinate else None
        made.setAxis(osim.Vec3(*direction))
        made.set_function(function)
    return osim.CustomJoint(name, *ends, transform)


def identity() -> Any:
    return osim.LinearFunction(1.0, 0.0)


JOINTS: dict[str, Callable[[Any, str], Any]] = {
    "pin": lambda ends, name: osim.PinJoint(name, *ends),
    "slider": lambda ends, name: osim.SliderJoint(name, *ends),
    "universal": lambda ends, name: osim.UniversalJoint(name, *ends),
    "gimbal": lambda ends, name: osim.GimbalJoint(name, *ends),
    "planar": lambda ends, name: osim.PlanarJoint(name, *ends),
    "weld": lambda ends, name: osim.WeldJoint(name, *ends),
    "knee": lambda ends, name: custom(
        ends,
        name,
        {
            "rotation1": (Z, f"{name}_angle", identity()),
            "rotation2": (Y, f"{name}_angle", ROLL),
            "translation1": (X, f"{name}_angle", KNEE),
            "translation2": ((0.6, 0.8, 0), f"{name}_angle", osim.MultiplierFunction(ROLL, 0.3)),
        },
    ),
    "rolling": lambda ends, name: custom(
        ends,
        name,
        {
            "rotation1": (X, f"{name}_turn", osim.LinearFunction(-0.7, 0.2)),
            "rotation3": ((0.6, 0, 0.8), f"{name}_turn", osim.PolynomialFunction(osim.Vector.createFromMat(np.array([0.3, -0.2, 0.1])))),
            "translation3": (Z, f"{name}_slip", lines((-1, 0.2), (0.3, -0.1), (1, 0.4))),
            "translation1": (X, f"{name}_slip", identity()),
        },
    ),
}


def chain(kinds: list[str]) -> Any:
    """A chain of bodies on ground by these joints, whose frames stand askew in both bodies."""
    generator = np.random.default_rng(len(kinds))
    model = osim.Model()
    model.setName("chain")
    model.setGravity(osim.Vec3(0.3, -9.7, 0.5))
    parent = model.getGround()
    for number, kind in enumerate(kinds):
        half = generator.normal(size=(3, 3))
        inertia = half @ half.T + np.eye(3)
        moments = [float(inertia[i, k]) for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        com = osim.Vec3(*generator.normal(size=3))
        body = osim.Body(f"body{number}", float(generator.uniform(1, 3)), com, osim.Inertia(*moments))
        model.addBody(body)
        places = (osim.Vec3(*generator.normal(size=3)) for _ in range(4))
        ends = parent, next(places), next(places), body, next(places), next(places)
        model.addJoint(JOINTS[kind](ends, f"{kind}{number}"))
        parent = body
    model.finalizeConnections()
    return model


def order(model: Any, state: Any) -> list[str]:
    """Names of coordinates as Simbody numbers their speeds."""
    numbered, coordinates = osim.State(state), model.getCoordinateSet()
    names = [coordinates.get(k).getName() for k in range(coordinates.getSize())]
    for k, name in enumerate(names):
        coordinates.get(name).setSpeedValue(numbered, 100.0 + k)
    speeds = numbered.getU()
    return [names[round(speeds.get(at) - 100)] for at in range(speeds.size())]


@pytest.mark.parametrize(
    "kinds",
    [["pin", "slider"], ["universal", "gimbal"], ["planar", "weld", "pin"], ["pin", "knee", "pin"], ["rolling", "knee"]],
    ids="-".join,
)
def test_generalized_forces_are_opensims(kinds: list[str], tmp_path: Path) -> None:
    model = chain(kinds)
    state = model.initSystem()
    model.printToXML(str(tmp_path / "chain.osim"))
    write_package(generate(read_system(tmp_path / "chain.osim"), ["numpy"]), tmp_path / "chain")
    robot = import_package(tmp_path / "chain").load("numpy")
    names = order(model, state)
    assert sorted(names) == sorted(robot.joint_names)
    solver, generator = osim.InverseDynamicsSolver(model), np.random.default_rng(7)
    for _ in range(5):
        q, qd, qdd = generator.uniform(-1.0, 1.0, (3, robot.n))
        for k, name in enumerate(robot.joint_names):
            coordinate = model.getCoordinateSet().get(name)
            coordinate.setValue(state, float(q[k]), False)
            coordinate.setSpeedValue(state, float(qd[k]))
        model.realizeVelocity(state)
        wanted = osim.Vector(len(names), 0.0)
        for at, name in enumerate(names):
            wanted.set(at, float(qdd[robot.joint_names.index(name)]))
        tau = solver.solve(state, wanted)
        expected = np.array([tau.get(names.index(name)) for name in robot.joint_names])
        assert np.abs(robot.inverse_dynamics(q, qd, qdd) - expected).max() <= 1e-12 * np.abs(expected).max()
