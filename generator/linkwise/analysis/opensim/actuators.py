"""Wrenches of a model's muscles and other actuators on its bodies, as OpenSim's own paths give them.

An actuator's effect is linear in its one force. With all others at 0 and without gravity, OpenSim's force on
each body and its generalized forces on coordinates are the actuator's: path points that move with a
coordinate and that exist for some angles only, and surfaces that a path wraps over, are in them.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

GROUND = "ground"


@dataclass(frozen=True)
class ActuatorFile:
    """A model of OpenSim, and files of forces that its tools were given beside it."""

    model: Path
    force_sets: tuple[Path, ...] = ()

    @property
    def files(self) -> tuple[Path, ...]:
        """Paths of all files."""
        return (self.model, *self.force_sets)


@dataclass(frozen=True)
class ActuatorNames:
    """Names of a model's actuators that have one force, of its groups of forces, and of its coordinates."""

    actuators: tuple[str, ...]
    paths: frozenset[str]
    """Actuators along a path, as muscles are."""
    unapplied: frozenset[str]
    """Actuators that the model itself does not apply."""
    groups: Mapping[str, tuple[str, ...]]
    coordinates: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class SourceWrenches:
    """Effect of one source over time: on bodies, in the ground's axes, and on coordinates."""

    wrenches: Mapping[str, Array]
    """Moment about the body's origin and force (S, 6), in N·m and N, by body; the ground is one."""
    efforts: Mapping[str, Array]
    """Generalized force (S,) by coordinate, in N·m or N."""


@dataclass(frozen=True, eq=False)
class ActuatorWrenches:
    """Effects of sources in their order, and the origins (S, 3) of the bodies on which they act, in m."""

    sources: tuple[SourceWrenches, ...]
    origins: Mapping[str, Array]


def actuator_names(osim: Any, given: ActuatorFile) -> ActuatorNames:
    """Return what a model has; osim: the module of OpenSim."""
    model = _opened(osim, given)
    forces = model.getForceSet()
    groups = {}
    for number in range(forces.getNumGroups()):
        group = forces.getGroup(number)
        members = group.getMembers()
        names = [members.get(at).getName() for at in range(members.getSize())]
        groups[group.getName()] = tuple(names)
    own = _scalar_actuators(osim, model)
    return ActuatorNames(
        tuple(own),
        frozenset(name for name, one in own.items() if _is_path(osim, one)),
        frozenset(name for name, one in own.items() if not one.get_appliesForce()),
        groups,
        tuple(one.getName() for one in _all(model.getCoordinateSet())),
    )


def actuator_wrenches(
    osim: Any,
    given: ActuatorFile,
    coordinates: Mapping[str, Array],
    sources: Sequence[Mapping[str, Array]],
) -> ActuatorWrenches:
    """Return the wrenches of sources at S samples.

    osim: the module of OpenSim; coordinates: value (S,) of each coordinate, in rad or m
    sources: force (S,) of each actuator of a source, by its name
    """
    model, own, state = _alone(osim, given)
    paths = {name: _moving_points(osim, one) for name, one in own.items() if _has_points(osim, one)}
    each = [model.getCoordinateSet().get(name) for name in coordinates]
    there = _places(model, state)
    values = np.array([*coordinates.values()])
    bodies = {GROUND: 0} | {one.getName(): one.getMobilizedBodyIndex() for one in _all(model.getBodySet())}
    shape = len(sources), values.shape[1]
    wrenches, efforts = np.zeros((*shape, len(bodies), 6)), np.zeros((*shape, len(there)))
    origins = np.zeros((values.shape[1], len(bodies), 3))
    places = [*there]
    for s in range(values.shape[1]):
        for coordinate, value in zip(each, values[:, s].tolist(), strict=True):
            coordinate.setValue(state, value, False)
        model.realizePosition(state)
        origins[s] = [_origin(model, name, state) for name in bodies]
        for x, source in enumerate(sources):
            for name, force in source.items():
                own[name].setOverrideActuation(state, float(force[s]))
            wrenches[x, s] = _on_bodies(model, state, [*bodies.values()])
            for name in filter(paths.__contains__, source):
                own[name].setOverrideActuation(state, 0.0)
                for coordinate, effort in _of_moving(osim, own[name], state) if paths[name] else ():
                    efforts[x, s, places.index(coordinate)] += float(source[name][s]) * effort
            if not paths.keys() >= source.keys():
                efforts[x, s] += _on_coordinates(osim, model, state)[[*there.values()]]
            for name in source:
                own[name].setOverrideActuation(state, 0.0)
    each_body = {name: origins[:, b] for b, name in enumerate(bodies)}
    found = (_source(bodies, there, on, effort) for on, effort in zip(wrenches, efforts, strict=True))
    return ActuatorWrenches(tuple(found), each_body)


def _source(bodies: Iterable[str], coordinates: Iterable[str], on: Array, efforts: Array) -> SourceWrenches:
    """Return what is not zero of wrenches (S, bodies, 6) and generalized forces (S, coordinates)."""
    return SourceWrenches(
        {name: on[:, b] for b, name in enumerate(bodies) if on[:, b].any()},
        {name: efforts[:, k] for k, name in enumerate(coordinates) if efforts[:, k].any()},
    )


def _opened(osim: Any, given: ActuatorFile) -> Any:
    """Return the model with the forces of the other files."""
    model = osim.Model(str(given.model))
    for path in given.force_sets:
        added = osim.ForceSet(str(path))
        for number in range(added.getSize()):
            model.updForceSet().cloneAndAppend(added.get(number))
    model.finalizeFromProperties()
    names = [one.getName() for one in _all(model.getForceSet())]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise LinkwiseError(
            f"{given.model}: several forces are named {listed(map(repr, twice))}; rename them"
        )
    model.finalizeConnections()
    return model


def _alone(osim: Any, given: ActuatorFile) -> tuple[Any, dict[str, Any], Any]:
    """Return the model without gravity and other forces, its actuators at 0, and its state.

    Its coordinates take any value.
    """
    model = _opened(osim, given)
    model.setGravity(osim.Vec3(0.0, 0.0, 0.0))
    own = _scalar_actuators(osim, model)
    for force in _all(model.updForceSet()):
        force.set_appliesForce(force.getName() in own)
    for coordinate in _all(model.updCoordinateSet()):
        coordinate.set_locked(False)
        coordinate.set_clamped(False)
        coordinate.set_prescribed(False)
    state = model.initSystem()
    for actuator in own.values():
        actuator.overrideActuation(state, True)
        actuator.setOverrideActuation(state, 0.0)
    return model, own, state


def _scalar_actuators(osim: Any, model: Any) -> dict[str, Any]:
    every = (osim.ScalarActuator.safeDownCast(force) for force in _all(model.updForceSet()))
    return {one.getName(): one for one in every if one is not None}


def _is_path(osim: Any, actuator: Any) -> bool:
    return osim.PathActuator.safeDownCast(actuator) is not None


def _has_points(osim: Any, actuator: Any) -> bool:
    """Return whether it pulls at points of bodies, not by moment arms that functions give."""
    path = osim.PathActuator.safeDownCast(actuator)
    return path is not None and osim.FunctionBasedPath.safeDownCast(path.getPath()) is None


def _on_bodies(model: Any, state: Any, bodies: Sequence[int]) -> list[list[float]]:
    """Return the moment about the origin and the force on each body that the actuators give together."""
    model.realizeDynamics(state)
    on = model.getRigidBodyForces(state)
    spatial = [on.get(index) for index in bodies]
    return [[*one.get(0).to_numpy(), *one.get(1).to_numpy()] for one in spatial]


def _moving_points(osim: Any, actuator: Any) -> bool:
    """Return whether a path has points that move on their bodies."""
    path = osim.GeometryPath.safeDownCast(osim.PathActuator.safeDownCast(actuator).getPath())
    points = [] if path is None else _all(path.getPathPointSet())
    return any(osim.MovingPathPoint.safeDownCast(point) is not None for point in points)


def _of_moving(osim: Any, actuator: Any, state: Any) -> Iterator[tuple[str, float]]:
    """Yield coordinates and generalized forces on them of a tension of 1 N, as a path's points move.

    A point that goes by dp as the coordinate goes by dq has the force u2 - u1 of the tendon behind it and
    before it, with u along the tendon. OpenSim 4.6 adds the part of u1 alone.
    """
    path = osim.GeometryPath.safeDownCast(osim.PathActuator.safeDownCast(actuator).getPath())
    current = path.getCurrentPath(state)
    points = [current.get(number) for number in range(current.getSize())]
    places = np.array([point.getLocationInGround(state).to_numpy() for point in points])
    along = np.diff(places, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    pull = np.zeros_like(places)
    pull[:-1] += along
    pull[1:] -= along
    for point, force in zip(points, pull, strict=True):
        moving = osim.MovingPathPoint.safeDownCast(point)
        if moving is not None:
            turn = moving.getParentFrame().getTransformInGround(state).R().asMat33()
            axes = np.array([[turn.get(row, axis) for row in range(3)] for axis in range(3)])
            by = moving.getXCoordinate(), moving.getYCoordinate(), moving.getZCoordinate()
            each = moving.getdPointdQ(state).to_numpy() * (axes @ force)
            yield from ((one.getName(), float(effort)) for one, effort in zip(by, each, strict=True))


def _places(model: Any, state: Any) -> dict[str, int]:
    """Return the place of each coordinate's value among those of the system."""
    found = {}
    for one in _all(model.getCoordinateSet()):
        before = state.getQ().to_numpy().copy()
        one.setValue(state, one.getValue(state) + 1.0, False)
        found[one.getName()] = int(np.flatnonzero(state.getQ().to_numpy() != before)[0])
        one.setValue(state, float(before[found[one.getName()]]), False)
    return found


def _on_coordinates(osim: Any, model: Any, state: Any) -> Array:
    """Return the generalized forces on the rates of all coordinates that the actuators give together.

    OpenSim's are on speeds u, which of a Ball or Free joint are the angular velocity: with q' = N u, the
    power f u = (N^-T f) q'.
    """
    model.realizeDynamics(state)
    found, every = osim.Vector(state.getNQ(), 0.0), model.getMobilityForces(state)
    model.getMatterSubsystem().multiplyByNInv(state, True, every, found)
    forces: Array = found.to_numpy().copy()
    return forces


def _origin(model: Any, name: str, state: Any) -> Array:
    frame = model.getGround() if name == GROUND else model.getBodySet().get(name)
    found: Array = frame.getPositionInGround(state).to_numpy()
    return found


def _all(several: Any) -> list[Any]:
    return [several.get(number) for number in range(several.getSize())]
