"""Arguments with names along their axes, brought into the robot's order, and the axes of their samples."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from .chosen_names import choice
from .named_arrays import names_array, xarray

LAST = ("joint", "component", "axis")
"""Dimensions that are none of the samples."""
OF_INDEPENDENT = ("yd", "ydd")
"""Arguments of constraints that are of the independent joints."""


class SampleAxes(NamedTuple):
    """Dimensions before those of a quantity, and what stands along them, as xarray takes it."""

    dimensions: Sequence[str]
    coordinates: dict[str, Any]


def taken(
    arguments: dict[str, Any], joints: Sequence[str], independent: Sequence[str]
) -> tuple[dict[str, Any], SampleAxes | None]:
    """The arguments as arrays, joints in the robot's order; and their samples, where some have names.

    Raises ValueError for a joint that an argument lacks, and where arguments are of other samples.
    """
    xr = xarray()
    named = {name: a for name, a in arguments.items() if isinstance(a, xr.DataArray)}
    if not named:
        return arguments, None
    wanted = {name: independent if name in OF_INDEPENDENT else joints for name in named}
    ordered = [_in_order(name, array, wanted[name]) for name, array in named.items()]
    try:
        aligned = xr.align(*ordered, join="exact", exclude=LAST)
    except ValueError as error:
        raise ValueError(f"{', '.join(named)} are of different samples: {error}") from None
    alike = xr.broadcast(*aligned, exclude=LAST)
    dimensions = [d for d in alike[0].dims if d not in LAST]
    along = {
        name: coordinate
        for array in alike
        for name, coordinate in array.coords.items()
        if set(coordinate.dims) <= set(dimensions)
    }
    values = [array.transpose(*dimensions, ...).to_numpy() for array in alike]
    return arguments | dict(zip(named, values, strict=True)), SampleAxes(dimensions, along)


def samples_along(along: Any, count: int) -> SampleAxes:
    """The axes of samples without names, of which there are so many, as `along` names them.

    Raises ValueError where it names more or fewer.
    """
    if along is None:
        return SampleAxes(["sample"] if count == 1 else [f"sample_{at}" for at in range(count)], {})
    names = [along] if isinstance(along, str) else list(along)
    if len(names) != count:
        raise ValueError(f"along has {len(names)} names, {names}; the samples have {count} axes")
    if not isinstance(along, Mapping):
        return SampleAxes(names, {})
    return SampleAxes(names, {name: _along(name, values) for name, values in along.items()})


def _along(name: str, values: Any) -> Any:
    if isinstance(values, list | tuple) and all(isinstance(value, str) for value in values):
        values = names_array(values)
    return name, values, ({"units": "s"} if name == "time" else {})


def _in_order(argument: str, array: Any, joints: Sequence[str]) -> Any:
    """An array whose joints, where they have names, are these."""
    if "joint" not in array.dims or "joint" not in array.coords:
        return array
    there = [str(name) for name in array["joint"].values]
    for joint in joints:
        if joint not in there:
            raise ValueError(
                f"{argument} has no joint {joint!r}; it has {choice(joint, there, f'{argument}.joint')}"
            )
    return array.isel(joint=[there.index(joint) for joint in joints])
