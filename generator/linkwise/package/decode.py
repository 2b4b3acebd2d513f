"""Decoding of JSON as dataclasses: each entry of its annotated type, none missing, none unknown.

A fault is named.
"""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import is_dataclass
from types import UnionType
from typing import Any, Literal, get_args, get_origin, get_type_hints

DIGITS = 16
"""Most digits of a whole number; no count or index has more, and Python takes long over many."""


def parsed(text: str) -> Any:
    """Return JSON as Python has it.

    Raises ValueError for what is not JSON, and for an entry that is there twice.
    """
    return json.loads(text, object_pairs_hook=_once, parse_int=_whole)


def require(met: bool, place: str, expected: str) -> None:
    """Raise ValueError, which names the place, unless `met` is true."""
    if not met:
        raise ValueError(f"{place.lstrip('.') or 'the whole'} is not {expected}")


def decoded(kind: Any, data: Any, place: str, also: Iterable[str] = ()) -> Any:
    """Return JSON data as a value of the annotated type `kind`; raises ValueError that names the place.

    also: entries of the whole that are there besides those of `kind`
    """
    inner = get_args(kind)
    if isinstance(kind, type) and is_dataclass(kind):
        return _record(kind, data, place, also)
    if get_origin(kind) is UnionType:  # X | None
        return None if data is None else decoded(inner[0], data, place)
    if get_origin(kind) is tuple:
        return _row(inner, data, place)
    if get_origin(kind) is Literal:
        require(data in inner, place, " or ".join(map(repr, inner)))
        return data
    if get_origin(kind) is Mapping:
        require(isinstance(data, dict), place, "an object")
        return {key: decoded(inner[1], item, f"{place}.{_key(key)}") for key, item in data.items()}
    return _option(data, place) if kind is Any else _scalar(kind, data, place)


def _record(kind: Any, data: Any, place: str, also: Iterable[str]) -> Any:
    hints = get_type_hints(kind)
    wanted = [*hints, *also]
    require(isinstance(data, dict), place, "an object")
    lost = [name for name in wanted if name not in data]
    require(not lost, place, f"an object with {', '.join(lost)}")
    unknown = [name for name in data if name not in wanted]
    if unknown:
        raise ValueError(f"{f'{place}.{_key(unknown[0])}'.lstrip('.')} is not a known entry")
    return kind(**{name: decoded(hint, data[name], f"{place}.{name}") for name, hint in hints.items()})


def _row(inner: tuple[Any, ...], data: Any, place: str) -> tuple[Any, ...]:
    endless = inner[-1] is Ellipsis
    expected = "a list" if endless else f"a list of {len(inner)}"
    require(isinstance(data, list) and (endless or len(data) == len(inner)), place, expected)
    kinds = inner[:1] * len(data) if endless else inner
    return tuple(
        decoded(k, item, f"{place}[{n}]") for n, (k, item) in enumerate(zip(kinds, data, strict=True))
    )


def _scalar(kind: Any, data: Any, place: str) -> Any:
    if kind is float:
        number = isinstance(data, (int, float)) and not isinstance(data, bool)
        require(number and math.isfinite(data), place, "a finite number")
        return float(data)
    if kind is int:
        require(type(data) is int and data >= 0, place, "a whole number")
        return data
    if kind is bool:
        require(isinstance(data, bool), place, "true or false")
        return data
    require(isinstance(data, str), place, "a string")
    require(not any("\ud800" <= letter <= "\udfff" for letter in data), place, "a string of whole letters")
    return data


def _option(data: Any, place: str, nested: bool = True) -> Any:
    """Return the option of a command: null, true, false, a number, text, or a list or object of such.

    Raises ValueError, which names the place, for anything else.
    """
    if data is None or isinstance(data, bool):
        return data
    if isinstance(data, (int, float)):
        require(math.isfinite(data), place, "a finite number")
        return data
    if isinstance(data, str):
        return _scalar(str, data, place)
    require(nested, place, "a number, a string, true, false or null")
    if isinstance(data, list):
        return [_option(item, f"{place}[{n}]", False) for n, item in enumerate(data)]
    return {key: _option(item, f"{place}.{_key(key)}", False) for key, item in data.items()}


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
