"""Models of OpenSim as they are read, beside OpenSim itself: each kind of joint, coupling and function."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from answers import relative_error
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from osim_text import KNEE, LINES, ROLLING, Kind, chain, coefficients, constraints, coupler, points

pytest.importorskip(
    "opensim", reason="needs opensim, which has wheels for Linux on x86-64: pip install opensim"
)

import opensim as osim

from numeric.opensim_model import numbers

LIMIT = 1e-12
SPECK = 1e-14
"""Mass and inertia of a body that is to have none: OpenSim asks for some."""
CHAINS: dict[str, Sequence[Kind]] = {
    "pin, slider": ["PinJoint", "SliderJoint"],
    "universal, gimbal": ["UniversalJoint", "GimbalJoint"],
    "weld between planar and pin": ["PlanarJoint", "WeldJoint", "PinJoint"],
    "ball, pin": ["BallJoint", "PinJoint"],
    "free, ball": ["FreeJoint", "BallJoint"],
    "knee between pins": ["PinJoint", KNEE, "PinJoint"],
    "rolling, knee": [ROLLING, KNEE],
}
SETS = {
    "coupled": constraints(coupler("joint3_angle", "joint0_angle", LINES)),
    "coupled by turns": constraints(
        coupler("joint3_angle", "joint1_angle", coefficients("LinearFunction", -0.4, 0.1)),
        coupler(
            "joint1_angle", "joint0_angle", points("SimmSpline", (-1, 0.3), (0, 0.1), (0.7, 0.5), (1, 0))
        ),
    ),
    "not enforced": constraints(coupler("joint3_angle", "joint0_angle", LINES, enforced="false")),
}


class Beside:
    """One model in linkwise and in OpenSim, at a motion."""

    def __init__(self, folder: Path, text: str) -> None:
        osim.Logger.setLevelString("Error")
        self.file = folder / "model.osim"
        self.file.write_text(text)
        write_package(generate(read_system(self.file), ["numpy"]), folder / "package")
        self.robot: Any = import_package(folder / "package").load("numpy")
        self.names: Sequence[str] = self.robot.joint_names
        self.motion = np.random.default_rng(7).uniform(-1.0, 1.0, (3, self.robot.n))

    def torques(self, alone: Sequence[str] = ()) -> Any:
        """OpenSim's generalized forces by linkwise's coordinates; of the bodies `alone` where some are named.

        OpenSim's forces are those of its speeds u, which are not the rates of all coordinates: u = E q̇, and
        coupled coordinates and their rates follow others.
        """
        model = osim.Model(str(self.file))
        bodies = model.updBodySet()
        for body in (bodies.get(k) for k in range(bodies.getSize())):
            if alone and body.getName() not in alone:
                body.setMass(SPECK)
                body.setInertia(osim.Inertia(SPECK))
        state = model.initSystem()
        order, n = slots(model, state), len(self.names)
        followed = follows(model, order, dict(zip(self.names, self.motion[0], strict=True)))
        columns, bends = np.zeros((2, len(order), n))
        for row, (free, _, slope, bend) in enumerate(followed):
            columns[row, self.names.index(free)] = slope
            bends[row, self.names.index(free)] = bend
        q = np.array([value for _, value, _, _ in followed])
        for name, place in zip(order, q, strict=True):
            model.getCoordinateSet().get(name).setValue(state, float(place), False)
        _, qd, qdd = self.motion
        rate, jerk = columns @ qd, columns @ qdd + bends @ np.square(qd)
        turn, turning = speeds(model, order, q, rate)
        state.setU(osim.Vector.createFromMat(turn @ rate))
        model.realizeVelocity(state)
        wanted = osim.Vector.createFromMat(turn @ jerk + turning @ rate)
        force = numbers(osim.InverseDynamicsSolver(model).solve(state, wanted))
        return columns.T @ turn.T @ force


Followed = tuple[str, float, float, float]
"""A free coordinate's name, and what a coordinate is where it follows that, with two derivatives by it."""


def follows(model: Any, order: list[str], free: dict[str, float]) -> list[Followed]:
    """What all coordinates are, by OpenSim's own functions of couplings."""
    found: dict[str, Followed] = {name: (name, value, 1.0, 0.0) for name, value in free.items()}
    couplers = model.getConstraintSet()
    while len(found) < len(order):
        for k in range(couplers.getSize()):
            coupler = osim.CoordinateCouplerConstraint.safeDownCast(couplers.get(k))
            master = coupler.getIndependentCoordinateNames().get(0)
            if master in found:
                name, x, slope, bend = found[master]
                value, first, second = derivatives(coupler.getFunction(), x)
                follower = coupler.getDependentCoordinateName()
                found[follower] = name, value, first * slope, second * slope**2 + first * bend
    return [found[name] for name in order]


def derivatives(function: Any, x: float) -> tuple[float, float, float]:
    at, orders = osim.Vector(1, x), [osim.StdVectorInt([0] * order) for order in (1, 2)]
    first, second = (function.calcDerivative(order, at) for order in orders)
    return function.calcValue(at), first, second


def slots(model: Any, state: Any) -> list[str]:
    """Names of coordinates as Simbody numbers their speeds."""
    numbered, coordinates = osim.State(state), model.getCoordinateSet()
    names = [coordinates.get(k).getName() for k in range(coordinates.getSize())]
    for k, name in enumerate(names):
        coordinates.get(name).setSpeedValue(numbered, float(k))
    return [names[round(speed)] for speed in numbers(numbered.getU())]


def speeds(model: Any, order: list[str], q: Any, qd: Any) -> tuple[Any, Any]:
    """E of u = E q̇, and its rate: a ball's u is its angular velocity on the parent's frame."""
    turn, step = np.eye(len(order), dtype=complex), 1e-30
    for joint in (model.getJointSet().get(k) for k in range(model.getJointSet().getSize())):
        if joint.getConcreteClassName() in ("BallJoint", "FreeJoint"):
            at = [order.index(joint.get_coordinates(k).getName()) for k in range(3)]
            a, b, _ = q[at] + 1j * step * qd[at]
            turn[np.ix_(at, at)] = [
                [1.0, 0.0, np.sin(b)],
                [0.0, np.cos(a), -np.sin(a) * np.cos(b)],
                [0.0, np.sin(a), np.cos(a) * np.cos(b)],
            ]
    return turn.real, turn.imag / step


@pytest.mark.parametrize("kinds", CHAINS.values(), ids=CHAINS)
def test_generalized_forces_and_each_bodys_share_are_opensims(kinds: Sequence[Kind], tmp_path: Path) -> None:
    both = Beside(tmp_path, chain(kinds))
    assert relative_error(both.robot.inverse_dynamics(*both.motion), both.torques()) <= LIMIT
    shares = both.robot.partial_torque(*both.motion)
    welded = {f"body{k - 1}": f"body{k}" for k, kind in enumerate(kinds) if kind == "WeldJoint"}
    for j, link in enumerate(both.robot.link_names):
        expected = both.torques([link, welded.get(link, link)])
        assert np.abs(shares[:, j] - expected).max() <= LIMIT * np.abs(both.torques()).max()


@pytest.mark.parametrize("sets", SETS.values(), ids=SETS)
def test_coupled_coordinates_load_the_one_that_they_follow(sets: str, tmp_path: Path) -> None:
    both = Beside(tmp_path, chain(["PinJoint", KNEE, "SliderJoint", "PinJoint"], sets))
    assert relative_error(both.robot.inverse_dynamics(*both.motion), both.torques()) <= LIMIT
