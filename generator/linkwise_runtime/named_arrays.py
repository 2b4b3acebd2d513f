"""Arrays with names along their axes, as in xarray: answers are made such arrays, and arguments may be such.

Answers are a Dataset, made of quantities and their values. The joints of arguments are brought into the
robot's order, and the axes of their samples are those of the answer.
"""

from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from itertools import product as every
from types import ModuleType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .arguments import shape_of
from .call import ORDER, Quantity
from .chosen_names import choice, short
from .robot_axes import NamedAxis, Unit, inertial, measured, product, written

Values = NDArray[np.generic]
Part = tuple[Quantity, Values]
"""A quantity, and its values (..., *axes) in an array."""
Texts = NDArray[np.object_]
Variable = tuple[Sequence[str], Values, dict[str, str]]
"""Dimensions, values and attributes of a variable, as xarray accepts them."""
LAST = ("joint", "component", "axis")
"""Dimensions that are not those of samples."""
OTHER_UNITS = ("deg", "\u00b0", "mm", "cm")
"""Prefixes of units that are refused, as they are not those of SI."""
OF_INDEPENDENT = ("yd", "ydd")
"""Arguments of constraints that are given for the independent joints."""


class NamedArray(Protocol):
    """Part of a DataArray that arguments need: the runtime imports no xarray, not even for types."""

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the axes."""

    @property
    def coords(self) -> Mapping[str, "NamedArray"]:
        """Coordinates along the axes."""

    @property
    def attrs(self) -> Mapping[str, object]:
        """Attributes, such as the units."""

    def isel(self, *, joint: Sequence[int]) -> "NamedArray":
        """Return the array with the joints at these places."""

    def transpose(self, *dims: object) -> "NamedArray":
        """Return the array with its axes in this order."""

    def to_numpy(self) -> NDArray[np.generic]:
        """Return the values of the array."""


class SampleAxes(NamedTuple):
    """Dimensions before those of a quantity, and the coordinates along them, as xarray accepts them."""

    dimensions: Sequence[str]
    coordinates: dict[str, object]
    shape: tuple[int, ...]


def xarray() -> ModuleType:
    """Return the module xarray; raise ImportError, which says how to install it, where it is missing."""
    try:
        return import_module("xarray")
    except ImportError:
        raise ImportError(
            "names along axes are xarray's, which is not installed here: pip install xarray, and with it "
            "h5netcdf or zarr for files"
        ) from None


def dataset(
    parts: Sequence[Part],
    axes: Mapping[str, NamedAxis],
    before: Sequence[str],
    coordinates: Mapping[str, object],
    attributes: Mapping[str, object],
) -> Any:
    """Return a Dataset of all quantities; entries of one stand side by side along a further axis, the last.

    before: dimensions before those of the quantities; coordinates: those along these, as xarray accepts them

    A unit is an attribute, `units`; where it depends on the entry, the attribute `units_from` names the
    coordinate that has it, which quantities of the same units share.
    """
    taken = [axes[axis].dimension for quantity, _ in parts for axis in quantity.axes]
    if len(set(before)) < len(before):
        name = next(name for name in before if before.count(name) > 1)
        raise ValueError(f"{name!r} is an axis of the samples twice; name it otherwise by along")
    if twice := set(before) & {*taken, ORDER}:
        raise ValueError(f"the samples' axis {twice.pop()!r} is one of the answer too; name it otherwise")
    variables: dict[str, Variable] = {}
    along: dict[str, object] = dict(coordinates)
    for name, given in _by_name(parts).items():
        quantity, values = given[0][0], given[0][1]
        dimensions = [*before, *(axes[axis].dimension for axis in quantity.axes)]
        along |= {axes[a].dimension: names_array(axes[a].names) for a in quantity.axes if axes[a].names}
        if quantity.beside is not None:
            dimensions.append(quantity.beside[0])
            along[quantity.beside[0]] = names_array([q.beside[1] for q, _ in given if q.beside is not None])
            values = np.stack([values for _, values in given], -1)
        variables[name] = dimensions, values, {"long_name": quantity.meaning}
    return xarray().Dataset(variables, along | _with_units(parts, axes, variables), attributes)


def _with_units(
    parts: Sequence[Part], axes: Mapping[str, NamedAxis], variables: Mapping[str, Variable]
) -> dict[str, object]:
    """Return the coordinates of units that depend on the entry; add other units to the attributes."""
    shared: dict[tuple[tuple[object, ...], ...], str] = {}
    found: dict[str, object] = {}
    for name, given in _by_name(parts).items():
        over, units = units_of([quantity for quantity, _ in given], axes)
        told = variables[name][2]
        if over:
            key = tuple(over), tuple(units.flat)
            told["units_from"] = shared.setdefault(key, "units" if len(variables) == 1 else f"{name}_units")
            found[told["units_from"]] = over, units
        elif units.item():
            told["units"] = units.item()
    return found


def names_array(names: Iterable[str]) -> Texts:
    """Return names along an axis as objects, which files can hold: Zarr has no text of fixed width."""
    return np.array(list(names), dtype=object)


def units_of(entries: Sequence[Quantity], axes: Mapping[str, NamedAxis]) -> tuple[list[str], Texts]:
    """Return the dimensions along which a quantity's unit changes, and the unit as text along these."""
    factors = [_factors(entry.unit) for entry in entries]
    named = {axis for some in factors for _, axis, _ in some if axis}
    over = [axis for axis in entries[0].axes if axis in named and len(set(axes[axis].units)) > 1]
    kinds = [list(dict.fromkeys(axes[axis].units)) for axis in over]
    tables = []
    for entry, some in zip(entries, factors, strict=True):
        fixed = {axis: axes[axis].units[0] for axis in named.difference(over)}
        texts = [_written(entry, some, fixed | dict(zip(over, at, strict=True))) for at in every(*kinds)]
        tables.append(names_array(texts).reshape([len(kind) for kind in kinds]))
    dimensions = [axes[axis].dimension for axis in over]
    places = [[kind.index(unit) for unit in axes[axis].units] for axis, kind in zip(over, kinds, strict=True)]
    tables = [table[np.ix_(*places)] for table in tables] if over else tables
    if all((table == tables[0]).all() for table in tables):
        return dimensions, tables[0]
    assert entries[0].beside is not None
    return [*dimensions, entries[0].beside[0]], np.stack(tables, -1)


def _factors(unit: str) -> list[tuple[str, str, int]]:
    """Return the factors of a unit: what is measured, along which axis, and the power.

    For a symbol these are the symbol, no axis, and the power.
    """
    above, _, below = unit.removeprefix("~").partition("/")
    words = [(word, 1) for word in above.split()] + [(word, -1) for word in below.split()]
    return [(*word.partition(":")[::2], power) for word, power in words]


def _written(quantity: Quantity, factors: Sequence[tuple[str, str, int]], places: Mapping[str, str]) -> str:
    """Return the unit, as text, of the entries whose places are measured so along each axis."""
    unit: Unit = {}
    for what, axis, power in factors:
        unit = product(unit, measured(what, places[axis]) if axis else {what: 1}, power)
    return written(inertial(unit) if quantity.unit.startswith("~") else unit)


def _by_name(parts: Sequence[Part]) -> dict[str, list[Part]]:
    found: dict[str, list[Part]] = {}
    for quantity, values in parts:
        found.setdefault(quantity.name, []).append((quantity, values))
    return found


def alone(made: Any) -> Any:
    """Return the only quantity of a Dataset as a DataArray, with the Dataset's attributes.

    A Dataset of several quantities is returned as it is.
    """
    if len(made.data_vars) > 1:
        return made
    (name,) = made.data_vars
    return made[name].assign_attrs(made.attrs)


def arrays_in_order(
    arguments: Mapping[str, object], joints: Sequence[str], independent: Sequence[str], alone: bool = False
) -> tuple[dict[str, object], SampleAxes | None]:
    """Return the arguments as arrays, joints in the robot's order; and their samples, where some have names.

    alone: whether an argument of all joints may have the independent ones alone

    Raises ValueError for a joint that an argument lacks, and where the samples of arguments differ.
    """
    xr = xarray()
    arguments = {name: _of_frame(a, xr) for name, a in arguments.items()}
    named: dict[str, NamedArray] = {name: a for name, a in arguments.items() if isinstance(a, xr.DataArray)}
    if not named:
        return arguments, None
    for name, array in named.items():
        _check_named(name, array)

    def wanted(name: str, array: NamedArray) -> Sequence[str]:
        is_own = name in OF_INDEPENDENT or (alone and set(_joints_of(array)) == set(independent))
        return independent if is_own else joints

    ordered = [_in_order(name, array, wanted(name, array)) for name, array in named.items()]
    try:
        aligned = xr.align(*ordered, join="exact", exclude=LAST)
    except ValueError as error:
        raise ValueError(f"{', '.join(named)} are of different samples: {error}") from None
    alike: Sequence[NamedArray] = xr.broadcast(*aligned, exclude=LAST)
    dimensions = [d for d in alike[0].dims if d not in LAST]
    along: dict[str, object] = {
        name: coordinate
        for array in alike
        for name, coordinate in array.coords.items()
        if set(coordinate.dims) <= set(dimensions)
    }
    values = [array.transpose(*dimensions, ...).to_numpy() for array in alike]
    samples = SampleAxes(dimensions, along, values[0].shape[: len(dimensions)])
    return arguments | dict(zip(named, values, strict=True)), samples


def _of_frame(value: object, xr: ModuleType) -> object:
    """Return a table or row of pandas or polars as an array with the names of its columns.

    Any other value is returned as it is.
    """
    if not hasattr(value, "to_numpy") or isinstance(value, xr.DataArray):
        return value
    index = getattr(value, "index", None)
    if hasattr(value, "columns"):
        name = getattr(index, "name", None)
        samples = "sample" if name is None else str(name)
        names = names_array(str(column) for column in value.columns)
        along = {"joint": names} if index is None else {"joint": names, samples: index.to_numpy()}
        return xr.DataArray(value.to_numpy(), dims=(samples, "joint"), coords=along)
    if index is not None and hasattr(index, "to_numpy"):
        names = names_array(str(name) for name in index)
        return xr.DataArray(value.to_numpy(), dims=("joint",), coords={"joint": names})
    return value


def _check_named(name: str, array: NamedArray) -> None:
    """Raise ValueError for an array in other units, or without an axis of joints, components or axes."""
    units = str(array.attrs.get("units", ""))
    if units.casefold().startswith(OTHER_UNITS):
        raise ValueError(f"{name} is in {units}; give it in rad and m")
    if not set(array.dims) & set(LAST):
        there = ", ".join(map(str, array.dims))
        raise ValueError(f"{name} has the dimensions ({there}); call that of the joints 'joint'")


def samples_along(along: object, shape: tuple[int, ...]) -> SampleAxes:
    """Return the axes of samples without names, as `along` names them.

    Raises TypeError for values that are not names, ValueError where there are more or fewer of them than
    axes, or of the values along an axis than samples.
    """
    count = len(shape)
    if along is None:
        return SampleAxes(["sample"] if count == 1 else [f"sample_{at}" for at in range(count)], {}, shape)
    if not isinstance(along, Iterable) or not all(isinstance(name, str) for name in along):
        raise TypeError(f"along is {short(along)}; give names of the samples' axes")
    names: list[str] = [along] if isinstance(along, str) else list(along)
    if len(names) != count:
        raise ValueError(f"along has {len(names)} names, {names}; the samples have {count} axes")
    if not isinstance(along, Mapping):
        return SampleAxes(names, {}, shape)
    for (name, values), size in zip(along.items(), shape, strict=True):
        if shape_of(values) != (size,):
            raise ValueError(
                f"along {name!r} stands what has shape {shape_of(values)}; there are {size} samples"
            )
    return SampleAxes(names, {name: _along(name, values) for name, values in along.items()}, shape)


def _along(name: str, values: object) -> tuple[str, object, dict[str, str]]:
    if isinstance(values, list | tuple) and all(isinstance(value, str) for value in values):
        values = names_array(values)
    return name, values, ({"units": "s"} if name == "time" else {})


def _joints_of(array: NamedArray) -> list[str]:
    """Return the names of an array's joints; [] where they have none."""
    if "joint" not in array.dims or "joint" not in array.coords:
        return []
    return [str(name) for name in array.coords["joint"].to_numpy()]


def _in_order(argument: str, array: NamedArray, joints: Sequence[str]) -> NamedArray:
    """Return the array with these joints, in this order, where its joints have names.

    Raises ValueError for a joint that it lacks or has more than once.
    """
    there = _joints_of(array)
    if not there:
        return array
    for joint in joints:
        if there.count(joint) > 1:
            raise ValueError(f"{argument} has the joint {joint!r} {there.count(joint)} times")
        if joint not in there:
            raise ValueError(
                f"{argument} has no joint {joint!r}; it has {choice(joint, there, f'{argument}.joint')}"
            )
    return array.isel(joint=[there.index(joint) for joint in joints])
