"""Uncertainty of external loads: of their force, their free moment and the point where they act.

[load.right_plate]           # the name of the load
force = "5 N"                # along each axis of those in which the load is given; or three
moment = "0.5 N*m"           # about the point
point = ["5 mm", "5 mm", "0 mm"]

[loads]                      # every load, unless its own table says otherwise
force = "5 N"
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from linkwise.analysis.loads.placed import NO_SHIFT, LoadShift, PlacedLoad
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.stated_sd import stated
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.package.decode import known_keys

UNITS: Mapping[str, Mapping[str, float]] = {
    "force": {"N": 1.0},
    "moment": {"N*m": 1.0, "N·m": 1.0},
    "point": {"mm": 1e-3, "cm": 1e-2, "m": 1.0},
}


class LoadSpread(NamedTuple):
    """Standard deviations of a load along three axes, (3,) each."""

    force: Array
    """Deviation of the force in N."""
    moment: Array
    """Deviation of the free moment in N m."""
    point: Array
    """Deviation of the point in m."""

    def directions(self) -> list[LoadShift]:
        """Return independent changes of the load, of one standard deviation each."""
        found = []
        for name, sizes in zip(self._fields, self, strict=True):
            for axis in np.flatnonzero(sizes):
                found.append(NO_SHIFT._replace(**{name: sizes * (np.arange(3) == axis)}))
        return found


class StatedLoads(NamedTuple):
    """Uncertainty of loads as a file states it."""

    usual: LoadSpread | None
    """Uncertainty of every load without a table of its own."""
    own: Mapping[str, LoadSpread]

    def placed(self, loads: Sequence[PlacedLoad], robot: OpenedRobot) -> tuple[LoadSpread | None, ...]:
        """Return the uncertainty of each load; raise LinkwiseError for a load that is not there."""
        names = [load.name for load in loads]
        if not names:
            raise LinkwiseError(
                f"[loads] states how uncertain loads are, and {robot.name} bears none here; add --load or "
                "--loads, or leave the table out"
            )
        for name in self.own:
            if name not in names:
                raise LinkwiseError(f"[load.{name}]: there is no load {name!r}; loads are {listed(names)}")
        return tuple(self.own.get(name, self.usual) for name in names)


def read_loads(usual: Any, own: Any) -> StatedLoads:
    """Return what the tables [loads] and [load.NAME] say; raise LinkwiseError for what cannot be."""
    tables = known_keys("[load]", own, own if isinstance(own, dict) else ())
    return StatedLoads(
        None if usual is None else _spread("[loads]", usual),
        {name: _spread(f"[load.{name}]", table) for name, table in tables.items()},
    )


def _spread(place: str, data: Any) -> LoadSpread:
    table = known_keys(place, data, UNITS)
    if not table:
        raise LinkwiseError(f"{place} states nothing; give {listed(list(UNITS))}")
    return LoadSpread(*(_three(place, key, table.get(key)) for key in UNITS))


def _three(place: str, key: str, given: Any) -> Array:
    each = given if isinstance(given, list) else [given] * 3
    if len(each) != 3:
        raise LinkwiseError(f"{place}: {key} has {len(each)} numbers; give one, or three for x, y, z")
    return np.array([0.0 if one is None else stated(place, key, one, UNITS[key])[0] for one in each])
