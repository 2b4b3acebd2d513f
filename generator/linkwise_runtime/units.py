"""Units as products of powers: what a quantity is measured in, made of the units of joints and rows.

A unit is a mapping from symbols to powers, N m/rad for one is {"N": 1, "m": 1, "rad": -1}. It is written such
that udunits and pint read it.
"""

from collections.abc import Mapping

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
