"""Names along the axes of what a robot computes, and in what entries along them are measured.

Units are products of powers: mappings from symbols to these, N m/rad for one is {"N": 1, "m": 1, "rad": -1}.
They are written such that udunits and pint read them.
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
"""Inertial parameters of a link, in the order of regressors."""
TURNS, MOVES = ("angular_x", "angular_y", "angular_z"), ("x", "y", "z")
"""Rows of a frame: turns about the world's axes, then its point along them."""
HOMOGENEOUS = ("m", "m", "m", "1")
"""Units of the coordinates that a pose takes and gives."""
LOSSES = ("spring", "damping", "friction")
"""What joints have of their own that accelerates, in the order of induced accelerations."""


class NamedAxis(NamedTuple):
    """An axis of an answer."""

    dimension: str
    """Its name there; axes of different lengths may share one, as all joints and the independent ones do."""
    names: tuple[str, ...]
    """Of its entries; none where they have none."""
    units: tuple[str, ...] = ()
    """Of what entries are places of, such as rad and m for joints; none where that means nothing."""


def axes_of(joints: Sequence[str], units: Sequence[str], links: Sequence[str]) -> dict[str, NamedAxis]:
    """Axes of a robot's answers, by the names that `Quantity` has for them."""
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
    }


def tied_axes(
    independent: Sequence[str], units: Sequence[str], rows: Sequence[str], row_units: Sequence[str]
) -> dict[str, NamedAxis]:
    """Axes that constraints add: those of the independent joints, which `units` are of, and of the rows."""
    along = tuple(independent), tuple(units)
    return {
        "independent": NamedAxis("joint", *along),
        "independent_cause": NamedAxis("cause", *along),
        "constraint": NamedAxis("constraint", tuple(rows), tuple(row_units)),
        "part": NamedAxis("part", ()),
    }


Unit = Mapping[str, int]

SYMBOLS = ("kg", "N", "W", "J", "m", "s", "rad")
"""In the order in which they are written; J and W stand alone."""
UNKNOWN: Unit = {"?": 1}
"""Of what a row of a coupling sums."""
OF_PLACES: dict[str, Unit] = {
    "1": {},
    "rad": {"rad": 1},
    "m": {"m": 1},
    "kg": {"kg": 1},
    "kg m": {"kg": 1, "m": 1},
    "kg m^2": {"kg": 1, "m": 2},
}
"""What entries along an axis are measured in: joints, rows, inertial parameters."""
RATES = {"place": 0, "position": 0, "velocity": -1, "acceleration": -2}
"""Powers of s in which the motion along an axis is measured."""


def measured(what: str, place: str) -> Unit:
    """Unit of a torque, or of one of `RATES`, where places are measured in `place`, such as rad."""
    if place not in OF_PLACES:
        return UNKNOWN
    if what == "torque":
        return {"N": 1, "m": 1} if place == "rad" else {"N": 1}
    return product(OF_PLACES[place], {"s": RATES[what]})


def product(unit: Unit, other: Unit, power: int = 1) -> Unit:
    """The first times a power of the other."""
    symbols = dict.fromkeys((*unit, *other))
    return {symbol: unit.get(symbol, 0) + power * other.get(symbol, 0) for symbol in symbols}


def inertial(unit: Unit) -> Unit:
    """The same in kg, m and s, as inertia is told: angles count as numbers."""
    newtons = unit.get("N", 0)
    whole = product(unit, {"kg": 1, "m": 1, "s": -2}, newtons)
    return {symbol: power for symbol, power in whole.items() if symbol not in ("N", "rad")}


def written(unit: Unit) -> str:
    """N m s/rad, 1/(m s^2) and the like; "1" for a number, and nothing for what is unknown."""
    if unit.get("?"):
        return ""
    powers = {symbol: unit.get(symbol, 0) for symbol in SYMBOLS}
    above, below = (
        [symbol if p * sign == 1 else f"{symbol}^{p * sign}" for symbol, p in powers.items() if p * sign > 0]
        for sign in (1, -1)
    )
    under = " ".join(below) if len(below) < 2 else f"({' '.join(below)})"
    return "/".join([" ".join(above) or "1", *([under] if under else [])])
