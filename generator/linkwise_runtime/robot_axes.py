"""Names along the axes of a robot's answers, and the units of the entries along them.

Units are products of powers, as mappings from symbols to powers: {"N": 1, "m": 1, "rad": -1} is N m/rad. They
are written such that udunits and pint read them.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

PARAMETER_UNITS = {
    "m": "kg",
    "mc_x": "kg m",
    "mc_y": "kg m",
    "mc_z": "kg m",
    "I_xx": "kg m^2",
    "I_xy": "kg m^2",
    "I_yy": "kg m^2",
    "I_xz": "kg m^2",
    "I_yz": "kg m^2",
    "I_zz": "kg m^2",
}
"""Inertial parameters of a link and their units, in the order of regressors."""
TURNS, MOVES = ("angular_x", "angular_y", "angular_z"), ("x", "y", "z")
"""Rows of a frame: rotations about the world's axes, then translations of its point along them."""
HOMOGENEOUS = ("m", "m", "m", "1")
"""Units of the homogeneous coordinates that a pose maps from and to."""
WRENCH = ("moment_x", "moment_y", "moment_z", "force_x", "force_y", "force_z")
"""Components of a wrench."""
LOSSES = ("spring", "damping", "friction")
"""Passive sources of acceleration in the joints, in the order of induced accelerations."""


class NamedAxis(NamedTuple):
    """An axis of an answer."""

    dimension: str
    """Name of the axis in the answer; axes of different lengths may share one, as all joints and the
    independent ones do."""
    names: tuple[str, ...]
    """Names of the entries; empty where they have none."""
    units: tuple[str, ...] = ()
    """Units of the places that the entries stand for, such as rad and m for joints; empty without places."""


def axes_of(
    joints: Sequence[str], units: Sequence[str], links: Sequence[str], shares: Sequence[str]
) -> dict[str, NamedAxis]:
    """Return the axes of a robot's answers, by the names that `Quantity` has for them."""
    along = tuple(joints), tuple(units)
    return {
        "joint": NamedAxis("joint", *along),
        "link": NamedAxis("link", tuple(links)),
        "cause": NamedAxis("cause", *along),
        "other_cause": NamedAxis("other_cause", *along),
        "parameter": NamedAxis("parameter", tuple(PARAMETER_UNITS), tuple(PARAMETER_UNITS.values())),
        "component": NamedAxis("component", (*TURNS, *MOVES), ("rad",) * 3 + ("m",) * 3),
        "axis": NamedAxis("axis", MOVES, ("m",) * 3),
        "world": NamedAxis("world", (*MOVES, "1"), HOMOGENEOUS),
        "own": NamedAxis("own", (*MOVES, "origin"), HOMOGENEOUS),
        "source": NamedAxis("source", LOSSES),
        "kind": NamedAxis("kind", (*LOSSES, "armature")),
        "wrench": NamedAxis("component", WRENCH, ("rad",) * 3 + ("m",) * 3),
        "share": NamedAxis("share", tuple(shares)),
    }


def tied_axes(
    independent: Sequence[str], units: Sequence[str], rows: Sequence[str], row_units: Sequence[str]
) -> dict[str, NamedAxis]:
    """Return the axes that constraints add: those of the independent joints and of the rows.

    units: those of the independent joints; row_units: those of the rows
    """
    along = tuple(independent), tuple(units)
    return {
        "independent": NamedAxis("joint", *along),
        "independent_cause": NamedAxis("cause", *along),
        "constraint": NamedAxis("constraint", tuple(rows), tuple(row_units)),
        "part": NamedAxis("part", ()),
    }


Unit = Mapping[str, int]

SYMBOLS = ("kg", "N", "W", "J", "m", "s", "rad")
"""Symbols in the order in which they are written; J and W stand alone."""
UNKNOWN: Unit = {"?": 1}
"""Unknown unit, such as that of the sum in a row of a coupling."""
OF_PLACES: dict[str, Unit] = {
    "1": {},
    "rad": {"rad": 1},
    "m": {"m": 1},
    "kg": {"kg": 1},
    "kg m": {"kg": 1, "m": 1},
    "kg m^2": {"kg": 1, "m": 2},
}
"""Units of the entries along an axis, by their text: joints, rows, inertial parameters."""
RATES = {"place": 0, "position": 0, "velocity": -1, "acceleration": -2}
"""Powers of s in the unit of each kind of motion along an axis."""


def measured(what: str, place: str) -> Unit:
    """Return the unit of a torque, or of one of `RATES`, for places measured in `place`, such as rad."""
    if place not in OF_PLACES:
        return UNKNOWN
    if what == "torque":
        return {"N": 1, "m": 1} if place == "rad" else {"N": 1}
    return product(OF_PLACES[place], {"s": RATES[what]})


def product(unit: Unit, other: Unit, power: int = 1) -> Unit:
    """Return the first unit times a power of the other."""
    symbols = dict.fromkeys((*unit, *other))
    return {symbol: unit.get(symbol, 0) + power * other.get(symbol, 0) for symbol in symbols}


def inertial(unit: Unit) -> Unit:
    """Return a unit in kg, m and s, as inertia is written: angles count as numbers."""
    newtons = unit.get("N", 0)
    whole = product(unit, {"kg": 1, "m": 1, "s": -2}, newtons)
    return {symbol: power for symbol, power in whole.items() if symbol not in ("N", "rad")}


def written(unit: Unit) -> str:
    """Return a unit as text, N m s/rad, 1/(m s^2) and the like; "1" for a number, "" for an unknown unit."""
    if unit.get("?"):
        return ""
    powers = {symbol: unit.get(symbol, 0) for symbol in SYMBOLS}
    above, below = (
        [symbol if p * sign == 1 else f"{symbol}^{p * sign}" for symbol, p in powers.items() if p * sign > 0]
        for sign in (1, -1)
    )
    under = " ".join(below) if len(below) < 2 else f"({' '.join(below)})"
    return "/".join([" ".join(above) or "1", *([under] if under else [])])
