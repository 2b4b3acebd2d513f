"""Answers of any call of a robot with names along the axes."""

import inspect
from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arguments import has_tensors
from .call import Call
from .call_table import CALLS
from .chosen_names import choice, numbered, short
from .named_arrays import Part, SampleAxes, alone, arrays_in_order, dataset, samples_along, xarray
from .quantities import AppliedLoad
from .robot_axes import NamedAxis, axes_of, tied_axes

TIED = "constraints."
OF_MOTION = ("trace", "counterfactual")
"""Calls whose arguments are a motion over time."""
OVER_TIME = ("simulate", *OF_MOTION)
"""Calls whose first answer is the time along the others."""
ALONE = ("constraints.closed", "simulate")
"""Calls that accept the independent joints alone in place of all joints."""


def labelled(
    robot: Any, ties: Any, call: str, given: Sequence[object], named: Mapping[str, object], along: Any
) -> Any:
    """Return the answer of a call as `Dynamics.labelled` says.

    ties: constraints whose calls are meant, None for those of the robot
    """
    xarray()
    rows = _rows(ties is not None, call)
    function = attrgetter(call)(robot if ties is None else ties)
    arguments: dict[str, object] = dict(inspect.signature(function).bind(*given, **named).arguments)
    if arguments.pop("out", None) is not None:
        raise TypeError("labelled makes arrays of its own; leave out away")
    if "time" in arguments:  # along which no joints stand
        arguments["time"] = np.asarray(arguments["time"])
    key = rows[0].name
    asked = arguments.get("constraints")
    is_kept = key in (*OVER_TIME, "reactions") and asked is not False and robot.backend.ties_joints
    if asked or is_kept or key.startswith(TIED) or key == "induced_reactions":
        ties = ties or asked or robot.constraints
    arguments, samples = arrays_in_order(
        arguments, robot.joint_names, ties.independent if ties else (), key in ALONE and bool(ties)
    )
    answer = function(**arguments)
    row = _chosen(rows, arguments)
    values = answer if isinstance(answer, tuple) else (answer,)
    # What a record has beside its arrays, such as names, follows them.
    parts = list(zip(row.answers, map(_array, values[: len(row.answers)]), strict=True))
    instants = parts.pop(0)[1] if key in OVER_TIME else None
    if key in OF_MOTION and samples is None and along is None:
        more = values[1].ndim - len(row.answers[1].axes) - 1
        along = ["time", *(f"sample_{at}" for at in range(more))]
    before = _before(parts[-1], instants, samples, along, key == "simulate")
    about = {"robot": robot.name, "backend": robot.backend.name, "call": call}
    about |= {"convention": answer.convention} if hasattr(answer, "convention") else {}
    axes = _axes(robot, ties, key, arguments)
    if key == "trace":
        windows = tuple(f"{begin:.15g}..{end:.15g} s" for begin, end in answer.windows)
        axes |= {"origin": NamedAxis("origin", answer.sources), "window": NamedAxis("window", windows)}
    return alone(dataset(parts, axes, *before, about))


def _rows(of_ties: bool, call: str) -> list[Call]:
    """Return the rows of a call, one for each variant; raise ValueError for a call that does not exist."""
    known: dict[str, list[Call]] = {}
    for row in CALLS.values():
        if row.is_named and (not of_ties or row.key.startswith(TIED)):
            known.setdefault(row.name.removeprefix(TIED) if of_ties else row.name, []).append(row)
    if call not in known:
        raise ValueError(
            f"{short(call)} answers with no array whose axes have names; choose a call: "
            f"{choice(call, known, 'linkwise_runtime.call_table.CALLS')}"
        )
    return known[call]


def _chosen(rows: Sequence[Call], arguments: Mapping[str, object]) -> Call:
    """Return the row that the arguments choose; the first one is the default."""
    for row in rows[1:]:
        if all(_is_so(arguments, name, value) for name, value in row.chosen.items()):
            return row
    return rows[0]


def _is_so(arguments: Mapping[str, object], name: str, value: object) -> bool:
    """Return whether an option has this value, as the call sees it: any true value is True."""
    given = arguments.get(name, not value)
    return bool(given) == value if isinstance(value, bool) else given == value


def _before(
    part: Part, instants: NDArray[Any] | None, samples: SampleAxes | None, along: Any, is_made: bool
) -> tuple[list[str], dict[str, Any]]:
    """Return the dimensions before those of the quantities, and the coordinates along them.

    is_made: whether the call has made the axis of time, which the samples of its arguments do not have
    """
    quantity, values = part
    first = ["time"] if is_made else []
    shape = values.shape[len(first) : values.ndim - len(quantity.axes)]
    if samples is None:
        samples = samples_along(along, shape)
    elif along is not None:
        raise ValueError("along is given, but arguments name the axes of their samples; leave it away")
    elif samples.shape != shape:
        raise ValueError(
            f"the arguments with names are of {samples.shape} samples, with the others there are "
            f"{shape}; give names to those that have more"
        )
    dimensions = [*first, *samples.dimensions]
    if instants is None or "time" not in dimensions:
        return dimensions, samples.coordinates
    return dimensions, {"time": ("time", instants, {"units": "s"})} | samples.coordinates


def _axes(robot: Any, ties: Any, key: str, arguments: Mapping[str, Any]) -> dict[str, NamedAxis]:
    """Return the axes by the names that quantities have for them."""
    axes = axes_of(robot.joint_names, robot.joint_units, robot.link_names, robot.share_names)
    if key.startswith("kinematics.poses"):
        axes["frame"] = NamedAxis("frame", robot.kinematics.frames)
    if ties:
        units = [robot.joint_units[robot.joint_index(name)] for name in ties.independent]
        axes |= tied_axes(ties.independent, units, ties.rows, ties.row_units)
    if key.startswith("induced"):
        frame = arguments.get("frame")
        centre = frame == "centre of mass" and frame not in robot.kinematics.frames
        of = "constraint" if key == "induced_reactions" else "joint" if frame is None else "component"
        axes["moved"] = axes["axis" if centre else of]
        axes["holder"] = _holders(robot, bool(arguments.get("passive", True)))
    if key == "reactions":
        axes["mover"] = axes["independent_cause" if ties else "cause"]
        axes["tree_joint"] = NamedAxis("tree_joint", _chosen_joints(robot, arguments.get("joints")))
    if key.startswith("induced") or key == "reactions":
        axes["load"] = NamedAxis("load", _names_of(arguments.get("loads", ()), robot))
    return axes


def _chosen_joints(robot: Any, given: Any) -> tuple[str, ...]:
    """Return the names of the tree's joints that are given by name or number, of all for None."""
    names: tuple[str, ...] = robot.tree_joint_names
    if given is None:
        return names
    several = given if isinstance(given, list | tuple) else [given]
    return tuple(one if isinstance(one, str) else names[one] for one in several)


def _holders(robot: Any, passive: bool) -> NamedAxis:
    """Return the axis of what holds energy: links, and armatures where they count."""
    turning = robot.structure.armature_joints if passive else ()
    armatures = (f"armature of {robot.joint_names[k]}" for k in turning)
    return NamedAxis("holder", (*robot.link_names, *armatures))


def _names_of(loads: Any, robot: Any) -> tuple[str, ...]:
    """Return the names of loads: those of their frames, numbered where a frame has several."""
    every = [loads] if isinstance(loads, AppliedLoad) else loads
    frames = (
        [
            one.frame if isinstance(one.frame, str) else robot.kinematics.frames[one.frame]
            for one in ([load] if isinstance(load, AppliedLoad) else load)
        ]
        for load in every
    )
    return numbered(" and ".join(dict.fromkeys(names)) for names in frames)


def _array(value: Any) -> NDArray[Any]:
    """Return an array, or the numbers of a tensor; raise TypeError for one that requires a gradient."""
    if not has_tensors([value]):
        return np.asarray(value)
    if value.requires_grad:
        raise TypeError("names stand along arrays, which have no gradients; call under torch.no_grad()")
    return np.asarray(value.cpu())
