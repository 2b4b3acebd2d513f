"""Forces of muscles and other actuators, as OpenSim's tools write them, as loads on the bodies of the robot.

A muscle is a load that pulls at several bodies at once. As of other loads, τ_ie is what joint i takes to bear
it: minus the muscle's own torque about the joint, which is its force times the moment arm. With all muscles
given, the joint torque τ_i is what they leave.
"""

from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Literal

import numpy as np
from linkwise_runtime.chosen_names import end_of_path, nearest_first

from linkwise.analysis.column_matching import time_column
from linkwise.analysis.disk_rows import collected
from linkwise.analysis.loads import WIDTH, WORLD, Muscles
from linkwise.analysis.loads.placed import PlacedLoad, PlacedWrench, load_frame_of, model_pose, rows_at
from linkwise.analysis.loads.read import check_time
from linkwise.analysis.logs import open_log
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.opensim.actuators import (
    GROUND,
    ActuatorFile,
    ActuatorNames,
    ActuatorWrenches,
    SourceWrenches,
    actuator_names,
    actuator_wrenches,
)
from linkwise.analysis.samples import finite_blocks
from linkwise.analysis.settings import Reading
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.own_opensim import asked_of_opensim
from linkwise.progress import Progress

GROUPS = "--muscle-group"
APART = 1e-5
"""Largest distance in m between the origins of a body here and in OpenSim's model."""
BALANCED = 1e-9
"""Part of the largest force that forces on all bodies may leave where they are in balance."""


def placed_muscles(
    wanted: Muscles, robot: OpenedRobot, time: Array, q: Array, progress: Progress
) -> tuple[PlacedLoad, ...]:
    """Return the muscles as loads at the motion's instants (S,) and positions (S, n).

    Raises LinkwiseError for files that do not fit each other, the robot or the motion, and without OpenSim.
    """
    file = ActuatorFile(wanted.model, wanted.force_sets)
    names = asked_of_opensim(lambda osim: actuator_names(osim, file), f"{wanted.model}: OpenSim")
    log = open_log(wanted.forces)
    with within(str(wanted.forces)):
        numbers, told = _columns(log.columns, names)
        sources = grouped(wanted.groups, tuple(numbers), names.groups)
    wanted_columns = time_column(log.columns, Reading()), *numbers.values()
    every = collected(finite_blocks(log, wanted_columns, progress), 1 + len(numbers), None)
    with within(str(wanted.forces)):
        check_time(every[:, 0], time, log.first_row)
    forces = dict(zip(numbers, rows_at(every, time)[:, 1:].T, strict=True))
    if max(float(np.abs(force).max()) for force in forces.values()) <= 1.0:
        told += ("no force exceeds 1: if these are activations, give the file of forces",)
    values = _coordinates(wanted, robot, names.coordinates, q)
    each = [{name: forces[name] for name in members} for members in sources.values()]
    found = asked_of_opensim(
        lambda osim: actuator_wrenches(osim, file, values, each), f"{wanted.model}: OpenSim"
    )
    _require_same_bodies(wanted, robot, q, found)
    kinds: dict[str, Literal["muscle", "actuator"]] = {
        name: "muscle" if names.paths.issuperset(members) else "actuator" for name, members in sources.items()
    }
    pressing = zip(kinds.items(), found.sources, strict=True)
    by_functions = [n for (n, kind), one in pressing if kind == "muscle" and one.efforts and not one.wrenches]
    if by_functions:
        told += (f"functions give the moment arms of {listed(by_functions)}: no joint is pressed together",)
    warnings = tuple(f"{wanted.forces.name}: {one}" for one in (*log.warnings, *told))
    return tuple(
        _placed(name, one, robot, time, q, kind, (wanted.forces.name, warnings))
        for (name, kind), one in zip(kinds.items(), found.sources, strict=True)
    )


def grouped(
    texts: Sequence[str], actuators: Sequence[str], of_model: Mapping[str, Sequence[str]]
) -> dict[str, tuple[str, ...]]:
    """Return the names of the actuators of each source: of groups, then of each that is in none.

    Raises LinkwiseError for a group without any, and for an actuator in two groups.
    """
    found: dict[str, tuple[str, ...]] = {}
    owner: dict[str, str] = {}
    for text in texts:
        name, sign, patterns = text.partition("=")
        if not sign and name not in of_model:
            known = f"the model's groups are {listed(nearest_first(name, of_model))}" if of_model else ""
            raise LinkwiseError(
                f"{GROUPS} {text}: write it as NAME=MUSCLE,MUSCLE; {known or 'the model has no groups'}"
            )
        wanted = [p.strip() for p in patterns.split(",")] if sign else of_model[name]
        members = tuple(one for one in actuators if any(fnmatchcase(one, p) for p in wanted))
        idle = [p for p in wanted if sign and not any(fnmatchcase(one, p) for one in actuators)]
        if idle or not members:
            asked = idle[0] if idle else name
            raise LinkwiseError(
                f"{GROUPS} {text}: no actuator is named {asked!r}; the file has forces of"
                f" {listed(nearest_first(asked, actuators))}"
            )
        for one in members:
            if owner.setdefault(one, name) != name:
                raise LinkwiseError(f"{GROUPS} {text}: {one!r} is in {owner[one]!r} already")
        if name in found:
            raise LinkwiseError(f"{GROUPS} {text}: another group has that name")
        found[name] = members
    alone = {one: (one,) for one in actuators if one not in owner}
    for name in found.keys() & alone.keys():
        raise LinkwiseError(
            f"{GROUPS} {name}: an actuator that is in no group has that name; rename the group, or add it"
        )
    return found | alone


def _columns(columns: Sequence[str], names: ActuatorNames) -> tuple[dict[str, int], tuple[str, ...]]:
    """Return the number of each actuator's column, and what is told of other columns and muscles."""
    time = time_column(columns, Reading())
    numbers: dict[str, int] = {}
    extra = []
    for at, column in enumerate(columns):
        name = end_of_path(column)
        if name in numbers:
            raise LinkwiseError(
                f"{columns[numbers[name]]!r} and {column!r} are both {name!r}; leave one of them out"
            )
        if name in names.actuators:
            numbers[name] = at
        elif at != time:
            extra.append(column)
    if not numbers:
        raise LinkwiseError(
            f"no column is an actuator of the model; there are {listed(map(repr, columns[:8]))}, and the"
            f" model has {listed(names.actuators[:8])}"
        )
    told = []
    if extra:
        told.append(
            f"no actuator of the model for {listed(extra)}: left out, so that joint torques contain what"
            " these give; files of reserve actuators go with --muscle-actuators"
        )
    unapplied = [name for name in numbers if name in names.unapplied]
    if unapplied:
        told.append(
            f"the model does not apply {listed(unapplied)}, and the file has forces of these: they count;"
            " leave their columns out if they should not"
        )
    missing = [one for one in names.actuators if one not in numbers and one not in names.unapplied]
    if missing:
        told.append(f"no column for {listed(missing)}: taken to give nothing")
    return numbers, tuple(told)


def _coordinates(
    wanted: Muscles, robot: OpenedRobot, coordinates: Iterable[str], q: Array
) -> dict[str, Array]:
    """Return the value (S,) of each coordinate of the model, also of those that follow or are held."""
    found = dict(zip(robot.joints, q.T, strict=True))
    for one in robot.followers:
        leader = np.zeros(len(q)) if one.leader is None else found[one.leader]
        found[one.name] = one.at(leader)
    lacking = [name for name in coordinates if name not in found]
    if lacking:
        raise LinkwiseError(
            f"--muscles: {robot.name} has no joint for the coordinate {listed(map(repr, lacking))} of"
            f" {wanted.model}; give the model itself as --robot"
        )
    return {name: found[name] for name in coordinates}


def _require_same_bodies(wanted: Muscles, robot: OpenedRobot, q: Array, found: ActuatorWrenches) -> None:
    """Raise LinkwiseError where a body that a muscle pulls at is elsewhere than in OpenSim's model."""
    pose, tree = model_pose(robot.model), robot.package.manifest.tree
    frames = {} if tree is None else {frame.name: frame for frame in tree.frames}
    for body in dict.fromkeys(body for one in found.sources for body in one.wrenches if body != GROUND):
        if body not in frames:
            raise LinkwiseError(
                f"--muscles: {robot.name} has no body {body!r}, at which a muscle of it pulls"
            )
        apart = float(np.abs(pose(frames[body], q)[:, :3, 3] - found.origins[body]).max())
        if apart > APART:
            raise LinkwiseError(
                f"--muscles: body {body!r} is up to {apart:.3g} m from where {wanted.model} has it; the"
                " motion or the robot does not belong to that model"
            )


def _placed(
    name: str,
    effect: SourceWrenches,
    robot: OpenedRobot,
    time: Array,
    q: Array,
    kind: Literal["muscle", "actuator"],
    told: tuple[str, tuple[str, ...]],
) -> PlacedLoad:
    """Return a source as a load; told: the name of its file, and warnings."""
    tree = robot.package.manifest.tree
    assert tree is not None  # `_require_same_bodies` has found bodies in it
    moving = {frame.name for frame in tree.frames if frame.joint is not None}
    wrenches = []
    for body, wrench in effect.wrenches.items():
        if body in moving:
            table = np.zeros((len(time), WIDTH))
            table[:, 0], table[:, 1:4], table[:, 4:7] = time, wrench[:, 3:], wrench[:, :3]
            wrenches.append(PlacedWrench(load_frame_of(name, body, WORLD, body, robot), table))
    forces = [wrench[:, 3:] for wrench in effect.wrenches.values()]
    largest = max((float(np.abs(force).max()) for force in forces), default=0.0)
    on_ground = not moving.issuperset(effect.wrenches)
    balanced = float(np.abs(sum(forces, np.zeros((len(time), 3)))).max()) <= BALANCED * largest
    given = _efforts(effect.efforts, robot, time, q)
    if given is not None and robot.constrained is not None:
        raise LinkwiseError(
            f"--muscles: {name!r} is a generalized force, and joints of {robot.name} are tied by loops, which"
            " would carry a part of it that is not modelled; leave its column out of the file"
        )
    source, warnings = told
    return PlacedLoad(
        name,
        tuple(wrenches),
        source,
        warnings=warnings,
        kind=kind,
        efforts=given,
        is_inside=balanced and not on_ground and len(wrenches) > 1,
    )


def _efforts(efforts: Mapping[str, Array], robot: OpenedRobot, time: Array, q: Array) -> Array | None:
    """Return rows of time and generalized forces on the joints, those on followers brought to these."""
    found = np.zeros((len(time), 1 + len(robot.joints)))
    found[:, 0] = time
    place = {name: 1 + i for i, name in enumerate(robot.joints)}
    followers = {one.name: one for one in robot.followers}
    for name, effort in efforts.items():
        if name in place:
            found[:, place[name]] += effort
        elif (leader := followers[name].leader) is not None:
            found[:, place[leader]] += effort * followers[name].slope(q[:, place[leader] - 1])
    return found if found[:, 1:].any() else None
