"""Arguments with names along their axes, brought into the robot's order, and the axes of their samples."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from .chosen_names import choice
from .named_arrays import names_array, xarray

LAST = ("joint", "component", "axis")
"""Dimensions that are none of the samples."""
OTHER_UNITS = ("deg", "\u00b0", "mm", "cm")
"""How units begin that are none of SI."""
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
    arguments = {name: _of_frame(a, xr) for name, a in arguments.items()}
    named = {name: a for name, a in arguments.items() if isinstance(a, xr.DataArray)}
    if not named:
        return arguments, None
    for name, array in named.items():
        _check_named(name, array)
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


def _of_frame(value: Any, xr: Any) -> Any:
    """A table or row of pandas or polars as an array with its columns' names; any other value itself."""
    if not hasattr(value, "to_numpy") or isinstance(value, xr.DataArray):
        return value
    index: Any = getattr(value, "index", None)
    if hasattr(value, "columns"):
        samples = "sample" if getattr(index, "name", None) is None else str(index.name)
        names = names_array(str(column) for column in value.columns)
        along = {"joint": names} if index is None else {"joint": names, samples: index.to_numpy()}
        return xr.DataArray(value.to_numpy(), dims=(samples, "joint"), coords=along)
    if hasattr(index, "to_numpy"):
        names = names_array(str(name) for name in index)
        return xr.DataArray(value.to_numpy(), dims=("joint",), coords={"joint": names})
    return value


def _check_named(name: str, array: Any) -> None:
    """Raise ValueError for an array in other units, or without an axis of joints, components or axes."""
    units = str(array.attrs.get("units", ""))
    if units.casefold().startswith(OTHER_UNITS):
        raise ValueError(f"{name} is in {units}; give it in rad and m")
    if not set(array.dims) & set(LAST):
        there = ", ".join(map(str, array.dims))
        raise ValueError(f"{name} has the dimensions ({there}); call that of the joints 'joint'")


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
