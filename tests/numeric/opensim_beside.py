"""OpenSim's answers on a model that linkwise has read, in linkwise's coordinates and their rates."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import opensim as osim
from linkwise import Options, generate, read_robot, read_system, write_package
from linkwise.package.load import import_package
from linkwise.package.manifest import Manifest

from numeric.opensim_model import numbers

AS_OPENSIM = Options(allow_unphysical=True)
"""OpenSim takes bodies that cannot exist, as some public models have."""
SPECK = 1e-14
"""Mass and inertia of a body that is to have none: OpenSim asks for some."""


class Beside:
    """A model in linkwise and in OpenSim, at a random motion within its limits."""

    def __init__(self, file: Path, package: Path) -> None:
        osim.Logger.setLevelString("Error")
        osim.Logger.removeFileSink()
        self.file = file
        write_package(generate(read_system(file, AS_OPENSIM), ["numpy"]), package)
        module: Any = import_package(package)
        self.robot = module.load("numpy")
        self.names: Sequence[str] = self.robot.joint_names
        self.merged = merged(file)
        limits = Manifest.read(package).joints
        draw, n = np.random.default_rng(7), self.robot.n
        low = [-1.0 if joint.lower is None else joint.lower for joint in limits]
        high = [1.0 if joint.upper is None else joint.upper for joint in limits]
        self.motion = np.array([draw.uniform(low, high), *draw.uniform(-1.0, 1.0, (2, n))])

    def errors(self) -> tuple[float, float]:
        """Largest errors of the torques and of each link's share, as parts of the largest torque."""
        expected = self.torques()
        size = float(np.abs(expected).max()) or 1.0
        shares = self.robot.partial_torque(*self.motion)
        own = np.stack([self.torques(self.merged[link]) for link in self.robot.link_names], 1)
        of_sums = np.abs(self.robot.inverse_dynamics(*self.motion) - expected).max() / size
        return float(of_sums), float(np.abs(shares - own).max() / size)

    def error_of_energies(self) -> float:
        """Largest error of the torques beside those of OpenSim's energies, as a part of the largest."""
        expected = self.torques_of_energies()
        off = np.abs(self.robot.inverse_dynamics(*self.motion) - expected).max()
        return float(off / (np.abs(expected).max() or 1.0))

    def torques(self, alone: Sequence[str] = ()) -> Any:
        """OpenSim's generalized forces by linkwise's coordinates; of the bodies `alone` where some are named.

        OpenSim's forces are those of its speeds u, which are not the rates of all coordinates: u = E q̇, and
        coupled coordinates and their rates follow others.
        """
        model, locked = bare(self.file, alone)
        state = model.initSystem()
        moved = self._moved(model, state, locked, *self.motion)
        wanted = osim.Vector.createFromMat(moved.turn @ moved.jerk + moved.turning @ moved.rate)
        force = numbers(osim.InverseDynamicsSolver(model).solve(state, wanted))
        return moved.columns.T @ moved.turn.T @ force

    def torques_of_energies(self) -> Any:
        """Return what the Lagrangian of OpenSim's own energies asks for, by differences of fourth order."""
        model, locked = bare(self.file, ())
        state = model.initSystem()
        q, qd, qdd = self.motion
        units = np.eye(len(q))

        def energies(q: Any, qd: Any) -> Any:
            self._moved(model, state, locked, q, qd, qdd)
            return np.array([model.calcKineticEnergy(state), model.calcPotentialEnergy(state)])

        def momentum(time: float) -> Any:
            place, rate = q + qd * time + qdd * time**2 / 2, qd + qdd * time
            both = [[energies(place, rate + sign * unit)[0] for unit in units] for sign in (1.0, -1.0)]
            return np.subtract(*both) / 2.0  # exact: kinetic energy is quadratic in the rates

        def lagrangian(way: Any) -> Callable[[float], Any]:
            return lambda step: -np.subtract(*energies(q + step * way, qd))

        return slope(momentum) + np.array([slope(lagrangian(unit)) for unit in units])

    def _moved(self, model: Any, state: Any, locked: dict[str, float], *motion: Any) -> "Moved":
        """OpenSim's model at a motion of linkwise's coordinates."""
        order, n = slots(model, state), len(self.names)
        followed = follows(model, order, dict(zip(self.names, motion[0], strict=True)), locked)
        columns, bends = np.zeros((2, len(order), n))
        for row, (name, _, first, second) in enumerate(followed):
            if name:
                columns[row, self.names.index(name)] = first
                bends[row, self.names.index(name)] = second
        q = np.array([value for _, value, _, _ in followed])
        for name, place in zip(order, q, strict=True):
            model.getCoordinateSet().get(name).setValue(state, float(place), False)
        rate, jerk = columns @ motion[1], columns @ motion[2] + bends @ np.square(motion[1])
        turn, turning = speeds(model, order, q, rate)
        state.setU(osim.Vector.createFromMat(turn @ rate))
        model.realizeVelocity(state)
        return Moved(columns, rate, jerk, turn, turning)


class Moved(NamedTuple):
    """OpenSim's coordinates as functions of linkwise's, their rates, and E of u = E q̇ with its rate."""

    columns: Any
    rate: Any
    jerk: Any
    turn: Any
    turning: Any


def slope(function: Callable[[float], Any], step: float = 1e-3) -> Any:
    """Derivative at 0."""
    near, far = (function(way * step) - function(-way * step) for way in (1, 2))
    return (8.0 * near - far) / (12.0 * step)


def bare(file: Path, alone: Sequence[str]) -> tuple[Any, dict[str, float]]:
    """OpenSim's model without forces or the mass of other bodies; and what it locks, let go here."""
    model = osim.Model(str(file))
    model.updForceSet().clearAndDestroy()
    model.updControllerSet().clearAndDestroy()
    bodies, coordinates = model.updBodySet(), model.updCoordinateSet()
    for body in (bodies.get(k) for k in range(bodies.getSize())):
        if alone and body.getName() not in alone:
            body.setMass(SPECK)
            body.setInertia(osim.Inertia(SPECK))
    locked: dict[str, float] = {}
    for coordinate in (coordinates.get(k) for k in range(coordinates.getSize())):
        if coordinate.getDefaultLocked():
            locked[coordinate.getName()] = coordinate.getDefaultValue()
            coordinate.setDefaultLocked(False)
    return model, locked


def merged(file: Path) -> dict[str, list[str]]:
    """Each link's body, and those that are fixed to it."""
    robot = read_robot(file, AS_OPENSIM)
    links = {link.name: [link.name] for link in robot.links}
    for note in robot.notes:
        if note.kind == "merged" and (onto := note.detail.removeprefix("into ")) in links:
            links[onto].append(note.subject)
    return links


Followed = tuple[str, float, float, float]
"""A free coordinate's name or nothing, what follows it, and two derivatives of that by it."""


def follows(model: Any, order: list[str], free: dict[str, float], locked: dict[str, float]) -> list[Followed]:
    """Return what each coordinate follows, by OpenSim's own functions of couplings."""
    found: dict[str, Followed] = {name: (name, value, 1.0, 0.0) for name, value in free.items()}
    found |= {name: ("", value, 0.0, 0.0) for name, value in locked.items()}
    every = (model.getConstraintSet().get(k) for k in range(model.getConstraintSet().getSize()))
    couplers = list(filter(None, map(osim.CoordinateCouplerConstraint.safeDownCast, every)))
    while len(found) < len(order):
        for coupler in couplers:
            master = coupler.getIndependentCoordinateNames().get(0)
            if master in found:
                name, x, slope, bend = found[master]
                value, first, second = derivatives(coupler.getFunction(), x)
                follower = coupler.getDependentCoordinateName()
                found[follower] = name, value, first * slope, second * slope**2 + first * bend
    return [found[name] for name in order]


def derivatives(function: Any, x: float) -> tuple[float, float, float]:
    # Lists of Python: OpenSim does not know its own StdVectorInt where ezc3d, wrapped by SWIG too, was used.
    at, orders = osim.Vector(1, x), [[0] * order for order in (1, 2)]
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
