"""Arrays with names along their axes: xarray's Dataset, made of quantities and their values."""

from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from itertools import product as every
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .quantity_axes import ORDER, Quantity
from .robot_axes import NamedAxis
from .units import Unit, inertial, measured, product, written

Part = tuple[Quantity, Any]
"""A quantity, and its values (..., *axes) in an array."""


def xarray() -> Any:
    """The library; raises ImportError that says how to install it."""
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
    coordinates: Mapping[str, Any],
    attributes: Mapping[str, Any],
) -> Any:
    """A Dataset of all quantities; entries of one stand side by side along an axis behind the others.

    before: dimensions before those of the quantities; coordinates: along these, as xarray takes them

    A unit is an attribute, `units`; where it hangs on the entry, the attribute `units_from` names the
    coordinate that has it, which quantities of the same units share.
    """
    taken = [axes[axis].dimension for quantity, _ in parts for axis in quantity.axes]
    if twice := set(before) & {*taken, ORDER}:
        raise ValueError(f"the samples' axis {twice.pop()!r} is one of the answer too; name it otherwise")
    variables: dict[str, Any] = {}
    along: dict[str, Any] = dict(coordinates)
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
    parts: Sequence[Part], axes: Mapping[str, NamedAxis], variables: Mapping[str, Any]
) -> dict[str, Any]:
    """Coordinates of units that hang on the entry; the others are put among what the variables say."""
    shared: dict[Any, str] = {}
    found: dict[str, Any] = {}
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


def names_array(names: Iterable[str]) -> NDArray[Any]:
    """Names along an axis, such as files hold: text of one width is none of Zarr's types."""
    return np.array(list(names), dtype=object)


def units_of(entries: Sequence[Quantity], axes: Mapping[str, NamedAxis]) -> tuple[list[str], NDArray[Any]]:
    """Dimensions along which the unit of a quantity changes, and how it is written along these."""
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
    """What is measured along which axis, and its power; of a symbol the symbol, and no axis."""
    above, _, below = unit.removeprefix("~").partition("/")
    words = [(word, 1) for word in above.split()] + [(word, -1) for word in below.split()]
    return [(*word.partition(":")[::2], power) for word, power in words]


def _written(quantity: Quantity, factors: Sequence[tuple[str, str, int]], places: Mapping[str, str]) -> str:
    """The unit of the entries that are measured so along each axis."""
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
    """The only quantity of a Dataset as a DataArray, which says what the Dataset says of itself."""
    if len(made.data_vars) > 1:
        return made
    (name,) = made.data_vars
    return made[name].assign_attrs(made.attrs)
