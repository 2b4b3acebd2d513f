"""Tables of a TOML file, with checks of their content and errors that name the table and the key."""

from collections.abc import Iterable, Mapping
from typing import Any

from linkwise.errors import LinkwiseError, within
from linkwise.package.decode import known_keys
from linkwise.robot.readers.toml.formula import parse_formula
from linkwise.robot.robot import Scalar, Vec3, unusable


class TomlTable:
    """One table of the file; its getters raise LinkwiseError that names table and key if one is wrong."""

    def __init__(self, place: str, data: Any, known: Iterable[str], parameters: Mapping[str, float]) -> None:
        self.place, self.data, self.parameters = place, known_keys(place, data, known, 20), parameters

    def text(self, key: str, default: str | None = None) -> str:
        """Return the string of a key."""
        value = self.data.get(key, default)
        if not isinstance(value, str):
            raise LinkwiseError(f"{self.place} needs {key!r}, a string")
        return value

    def scalar(self, key: str, value: Any) -> Scalar:
        """Return the `value` of a key as a number or a formula."""
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return as_float(f"{self.place}: {key!r}", value)
        if isinstance(value, str):
            with within(f"{self.place}, {key}"):
                return parse_formula(value, self.parameters)
        raise LinkwiseError(f"{self.place}: {key!r} must be a number or a formula in quotes")

    def number(self, key: str) -> float:
        """Return the number of a key, without parameters."""
        value = self.scalar(key, self.data[key])
        if not isinstance(value, float):
            raise LinkwiseError(f"{self.place}: {key!r} takes a number only, without parameters")
        return value

    def vector(self, key: str, default: list[float] | None) -> Vec3:
        """Return the three numbers or formulas of a key."""
        value = self.data.get(key, default)
        if not isinstance(value, list) or len(value) != 3:
            raise LinkwiseError(f"{self.place} needs {key!r}, three numbers")
        x, y, z = (self.scalar(key, item) for item in value)
        return x, y, z

    def numbers(self, key: str, default: list[float]) -> tuple[float, float, float]:
        """Return the three numbers of a key, without parameters."""
        x, y, z = self.vector(key, default)
        if not all(isinstance(item, float) for item in (x, y, z)):
            raise LinkwiseError(f"{self.place}: {key!r} takes numbers only, parameters cannot turn a frame")
        return x, y, z


def named_parameters(data: Any) -> dict[str, float]:
    """Return the numbers in the table [parameters] of a file, by name."""
    if not isinstance(data, dict):
        raise LinkwiseError("[parameters] must be a table of numbers")
    for name, value in data.items():
        if not name.isidentifier() or name == "pi":
            raise LinkwiseError(
                f"parameter {name!r} is not a usable name; use letters, digits and _, and not pi"
            )
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise LinkwiseError(f"parameter {name!r} must be a number")
        if fault := unusable(as_float(f"parameter {name!r}", value)):
            raise LinkwiseError(f"parameter {name!r} has {fault} for a value; give a number")
    return {name: float(value) for name, value in data.items()}


def as_float(place: str, value: int | float) -> float:
    """Return a number of the file; raises LinkwiseError, which names its place, for one that is too large."""
    try:
        return float(value)
    except OverflowError:
        raise LinkwiseError(f"{place} is too large a number; 1e308 is about the largest") from None


def tables(data: dict[str, Any], key: str) -> list[Any]:
    """Return the tables that are headed [[key]]."""
    items = data.get(key, [])
    if not isinstance(items, list):
        raise LinkwiseError(f"write each {key} as a table of its own, headed [[{key}]]")
    for number, item in enumerate(items, 1):
        if not isinstance(item, dict):
            raise LinkwiseError(f"entry {number} of {key} must be a table; head each with [[{key}]]")
    return items
