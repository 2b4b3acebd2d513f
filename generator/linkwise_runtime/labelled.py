"""Any call of a robot, answered with names along the axes."""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arguments import has_tensors
from .chosen_names import choice, short
from .motion_quantities import AppliedLoad
from .named_arguments import SampleAxes, samples_along, taken
from .named_arrays import Part, alone, dataset, xarray
from .quantity_axes import CONSTRAINTS, QUANTITIES
from .robot_axes import NamedAxis, axes_of, tied_axes

VARIANTS = ("_by_link", "_of_links")
"""Ends of names of what the arguments of a call choose."""
TIED = "constraints."


def labelled(
    robot: Any, ties: Any, call: str, given: Sequence[Any], named: Mapping[str, Any], along: Any
) -> Any:
    """See `Dynamics.labelled`; ties: constraints whose calls are meant, None for those of the robot."""
    xarray()
    function, key = _found(robot, ties, call)
    arguments = dict(inspect.signature(function).bind(*given, **named).arguments)
    if arguments.pop("out", None) is not None:
        raise TypeError("labelled makes arrays of its own; leave out away")
    if key.startswith(TIED) or key == "induced_reactions":
        ties = ties or arguments.get("constraints") or robot.constraints
    arguments, samples = taken(arguments, robot.joint_names, ties.independent if ties else ())
    answer = function(**arguments)
    parts = _parts(f"{key}_by_link" if arguments.get("by_link") else key, answer)
    instants = parts.pop(0)[1] if key == "simulate" else None
    before = _before(parts[-1], instants, samples, along)
    about = {"robot": robot.name, "backend": robot.backend.name, "call": call}
    about |= {"convention": answer.convention} if hasattr(answer, "convention") else {}
    return alone(dataset(parts, _axes(robot, ties, key, arguments), *before, about))


def _found(robot: Any, ties: Any, call: Any) -> tuple[Callable[..., Any], str]:
    """A call by its name, and its key among `QUANTITIES`; raises ValueError for one that is not there."""
    known = (
        {name: name for name in QUANTITIES}
        if ties is None
        else {k.removeprefix(TIED): k for k in CONSTRAINTS}
    )
    names = [name for name in known if not name.endswith(VARIANTS) and name != "gradient_propagation"]
    if call not in names:
        raise ValueError(
            f"{short(call)} answers with no array whose axes have names; choose a call: "
            f"{choice(call, names, 'runtime.quantity_axes.QUANTITIES')}"
        )
    return attrgetter(call)(robot if ties is None else ties), known[call]


def _parts(key: str, answer: Any) -> list[Part]:
    """The quantities of an answer, and their values in arrays."""
    values = answer if isinstance(answer, tuple) else (answer,)
    return list(zip(QUANTITIES[key], map(_array, values), strict=True))


def _before(
    part: Part, instants: NDArray[Any] | None, samples: SampleAxes | None, along: Any
) -> tuple[list[str], dict[str, Any]]:
    """Dimensions before those of the quantities, and what stands along them."""
    quantity, values = part
    first = [] if instants is None else ["time"]
    if samples is None:
        samples = samples_along(along, values.ndim - len(quantity.axes) - len(first))
    elif along is not None:
        raise ValueError("along is given, but arguments name the axes of their samples; leave it away")
    over = {} if instants is None else {"time": ("time", instants, {"units": "s"})}
    return [*first, *samples.dimensions], samples.coordinates | over


def _axes(robot: Any, ties: Any, key: str, arguments: Mapping[str, Any]) -> dict[str, NamedAxis]:
    """Axes by the names that quantities have for them."""
    axes = axes_of(robot.joint_names, robot.joint_units, robot.link_names)
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
        axes["load"] = NamedAxis("load", _names_of(arguments.get("loads", ()), robot))
    return axes


def _names_of(loads: Any, robot: Any) -> tuple[str, ...]:
    """Names of loads: those of their frames, numbered where one has several."""
    names: list[str] = []
    for load in [loads] if isinstance(loads, AppliedLoad) else loads:
        several: Iterable[Any] = [load] if isinstance(load, AppliedLoad) else load
        frames = [
            one.frame if isinstance(one.frame, str) else robot.kinematics.frames[one.frame] for one in several
        ]
        name = " and ".join(dict.fromkeys(frames))
        count = sum(other == name or other.startswith(f"{name} (") for other in names)
        names.append(f"{name} ({count + 1})" if count else name)
    return tuple(names)


def _array(value: Any) -> NDArray[Any]:
    """An array, or what a tensor holds; raises TypeError for one that gradients are asked of."""
    if not has_tensors([value]):
        return np.asarray(value)
    if value.requires_grad:
        raise TypeError("names stand along arrays, which have no gradients; call under torch.no_grad()")
    return np.asarray(value.cpu())
