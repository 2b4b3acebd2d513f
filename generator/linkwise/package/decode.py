"""Decoding of JSON and of TOML's tables as dataclasses: each entry of its annotated type, none unknown.

A fault is named with its place, in one line. No library does it in less: msgspec passes unknown entries of
dataclasses and NaN, and names no key of a mapping; cattrs needs a hook of one's own for every kind of type,
and for its errors.
"""

import json
import math
import sys
from collections.abc import Iterable, Mapping
from dataclasses import is_dataclass
from types import UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError
from linkwise.escape import listed, short

T = TypeVar("T")

DIGITS = 16
"""Most digits of a whole number; no count or index has more, and Python takes long over many."""
DEEPEST = 8
"""Most lists and objects in each other, in plain data of any kind."""
IN_TOML = {"a finite number": "a number", "a string": "a text", "an object": "a table"}
"""Names in messages about TOML of what has other names in those about JSON."""


class Misfit(ValueError):
    """Error where data are not of their type: their place, what is there, and what is wanted, in words."""

    def __init__(self, place: str, data: Any, wanted: str) -> None:
        super().__init__(f"{place.lstrip('.') or 'the whole'} is not {wanted}")
        self.place, self.data, self.wanted = place, data, wanted


def parse_json(text: str) -> Any:
    """Return JSON as Python has it.

    Raises ValueError for what is not JSON, is nested too deeply, or has an entry twice.
    """
    try:
        return json.loads(text, object_pairs_hook=_once, parse_int=_whole)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def require(met: bool, place: str, wanted: str, data: Any = None) -> None:
    """Raise Misfit, a ValueError that names the place, unless `met` is true."""
    if not met:
        raise Misfit(place, data, wanted)


def filled(kind: type[T], place: str, data: Any, defaults: Mapping[str, Any] | None = None) -> T:
    """Return a dataclass of a TOML table's keys; `defaults` apply where the table has no key.

    Raises LinkwiseError, which names place and key, for what is unknown, missing or of another type.
    """
    hints = get_type_hints(kind)
    table = known_keys(place, data, hints)
    values = {key: toml_value(hints[key], f"{place}: {key!r}", value) for key, value in table.items()}
    try:
        return kind(**{**(defaults or {}), **values})
    except TypeError:
        missing = next(key for key in hints if key not in values and not hasattr(kind, key))
        raise LinkwiseError(f"{place} needs {missing!r}") from None


def known_keys(place: str, data: Any, known: Iterable[str], most: int = 8) -> dict[str, Any]:
    """Return a TOML table itself; raise LinkwiseError for what is no table, and for unknown keys.

    most: how many of the known keys the error names, the nearest first
    """
    if not isinstance(data, dict):
        raise LinkwiseError(f"{place} must be a table")
    for key in data:
        if key not in known:
            near = listed(nearest_first(key, sorted(known)), most)
            raise LinkwiseError(f"{place} has the unknown key {key!r}; known are {near}")
    return data


def toml_value(kind: Any, place: str, data: Any) -> Any:
    """Return a value of TOML, of the annotated type `kind`; raise LinkwiseError. A list may be one text."""
    whole = [data] if get_origin(kind) is tuple and isinstance(data, str) else data
    try:
        return _value(kind, whole, place, strict=False)
    except Misfit as misfit:
        wanted = IN_TOML.get(misfit.wanted, misfit.wanted)
        raise LinkwiseError(f"{misfit.place} is {short(repr(misfit.data), 80)}; give {wanted}") from None


def decode(kind: type[T], data: Any, place: str, also: Iterable[str] = ()) -> T:
    """Return the dataclass of a JSON object that has all entries of its fields; raise Misfit.

    also: entries of the object that are there besides those of `kind`
    """
    hints = get_type_hints(kind)
    wanted = [*hints, *also]
    require(isinstance(data, dict), place, "an object")
    lost = [name for name in wanted if name not in data]
    require(not lost, place, f"an object with {', '.join(lost)}")
    for name in data:
        require(name in wanted, f"{place}.{_key(name)}", "a known entry")
    return kind(**{name: _value(hint, data[name], f"{place}.{name}") for name, hint in hints.items()})


def _value(kind: Any, data: Any, place: str, strict: bool = True) -> Any:
    """Return data as a value of the annotated type `kind`; raise Misfit.

    strict: numbers must be finite, and whole ones not below 0
    """
    inner, origin = get_args(kind), get_origin(kind)
    if isinstance(kind, type) and is_dataclass(kind):
        return decode(kind, data, place)
    if origin in (UnionType, Union):  # X | None
        return None if data is None else _value(inner[0], data, place, strict)
    if origin is tuple:
        return _row(inner, data, place, strict)
    if origin is Literal:
        require(data in inner, place, " or ".join(map(repr, inner)), data)
        return data
    if origin in (Mapping, dict):
        require(isinstance(data, dict), place, "an object", data)
        return {key: _value(inner[1], item, f"{place}.{_key(key)}", strict) for key, item in data.items()}
    if kind is object:  # plain data of any kind
        return _option(data, place, DEEPEST)
    return _option(data, place) if kind is Any else _scalar(kind, data, place, strict)


def _row(inner: tuple[Any, ...], data: Any, place: str, strict: bool) -> tuple[Any, ...]:
    endless = inner[-1] is Ellipsis
    expected = "a list" if endless else f"a list of {len(inner)}"
    require(isinstance(data, list) and (endless or len(data) == len(inner)), place, expected, data)
    kinds = inner[:1] * len(data) if endless else inner
    return tuple(
        _value(k, item, f"{place}[{n}]", strict) for n, (k, item) in enumerate(zip(kinds, data, strict=True))
    )


def _scalar(kind: Any, data: Any, place: str, strict: bool = True) -> Any:
    if kind is float:
        number = isinstance(data, (int, float)) and not isinstance(data, bool)
        met = number and (abs(data) <= sys.float_info.max or (not strict and isinstance(data, float)))
        require(met, place, "a finite number", data)
        return float(data)
    if kind is int:
        require(type(data) is int and (data >= 0 or not strict), place, "a whole number", data)
        return data
    if kind is bool:
        require(isinstance(data, bool), place, "true or false", data)
        return data
    require(isinstance(data, str), place, "a string", data)
    require(not any("\ud800" <= letter <= "\udfff" for letter in data), place, "a string of whole letters")
    return data


def _option(data: Any, place: str, deeper: int = 1) -> Any:
    """Return the option of a command: null, true, false, a number, text, or a list or object of such.

    deeper: how many lists and objects may lie in each other

    Raises ValueError, which names the place, for anything else.
    """
    if data is None or isinstance(data, bool):
        return data
    if isinstance(data, (int, float)):
        require(math.isfinite(data), place, "a finite number")
        return data
    if isinstance(data, str):
        return _scalar(str, data, place)
    require(deeper > 0, place, "a number, a string, true, false or null")
    if isinstance(data, list):
        return [_option(item, f"{place}[{n}]", deeper - 1) for n, item in enumerate(data)]
    return {key: _option(item, f"{place}.{_key(key)}", deeper - 1) for key, item in data.items()}


def _key(name: str) -> str:
    """Return an entry's name for a message, on one line and short."""
    return name if name.isprintable() and len(name) <= 80 else ascii(name[:80])


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"the entry {twice[:80]!a} is there twice")
    return found


def _whole(digits: str) -> float:
    """Return a whole number; infinity, which is refused at its place, if it has too many digits."""
    return int(digits) if len(digits) <= DIGITS else math.inf
