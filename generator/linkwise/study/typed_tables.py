"""Tables of a study's file as dataclasses: every key has its annotated type, and none is unknown."""

from collections.abc import Iterable, Mapping
from types import UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError
from linkwise.escape import listed

T = TypeVar("T")


def filled(kind: type[T], place: str, data: Any, defaults: Mapping[str, Any] | None = None) -> T:
    """Return a dataclass of a table's keys; `defaults` apply where the table has no key.

    Raises LinkwiseError, which names place and key, for what is unknown, missing or of another type.
    """
    hints = get_type_hints(kind)
    table = known_keys(place, data, hints)
    values = {key: _value(hints[key], f"{place}: {key!r}", value) for key, value in table.items()}
    try:
        return kind(**{**(defaults or {}), **values})
    except TypeError:
        missing = next(key for key in hints if key not in values and not hasattr(kind, key))
        raise LinkwiseError(f"{place} needs {missing!r}") from None


def known_keys(place: str, data: Any, known: Iterable[str]) -> dict[str, Any]:
    """Return the table itself; raise LinkwiseError for what is no table, and for unknown keys."""
    if not isinstance(data, dict):
        raise LinkwiseError(f"{place} must be a table")
    for key in data:
        if key not in known:
            near = listed(nearest_first(key, sorted(known)))
            raise LinkwiseError(f"{place} has the unknown key {key!r}; known are {near}")
    return data


def given_text(data: Mapping[str, Any], key: str, default: str | None = None) -> str:
    """Return a text of a table; raise LinkwiseError for another type, and for none without a default."""
    value = data.get(key, default)
    if not isinstance(value, str) or not value.strip():
        raise LinkwiseError(f"{key!r} is {value!r}; give a text" if key in data else f"needs {key!r}")
    return value


def given_flag(data: Mapping[str, Any], key: str) -> bool:
    """Return the flag of a table, true if not given; raise LinkwiseError for another type."""
    value = data.get(key, True)
    if not isinstance(value, bool):
        raise LinkwiseError(f"{key!r} is {value!r}; give true or false")
    return value


def given_texts(data: Mapping[str, Any], key: str, default: tuple[str, ...]) -> tuple[str, ...]:
    """Return a list of texts of a table; raise LinkwiseError for another type."""
    value = data.get(key, list(default))
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise LinkwiseError(f"{key!r} is {value!r}; give a list of texts")
    return tuple(value)


def _value(kind: Any, place: str, value: Any) -> Any:
    inner = get_args(kind)
    if get_origin(kind) in (UnionType, Union):  # X | None
        return _value(inner[0], place, value)
    if get_origin(kind) is Literal:
        if value not in inner:
            raise LinkwiseError(f"{place} is {value!r}; give one of {listed(inner)}")
        return value
    if get_origin(kind) is tuple:
        items = [value] if isinstance(value, str) else value
        if not isinstance(items, list):
            raise LinkwiseError(f"{place} is {value!r}; give a list")
        return tuple(_value(inner[0], place, item) for item in items)
    if get_origin(kind) is dict:
        if not isinstance(value, dict):
            raise LinkwiseError(f"{place} is {value!r}; give a table")
        return {key: _value(inner[1], f"{place}, {key!r}", item) for key, item in value.items()}
    return _plain(kind, place, value)


def _plain(kind: type, place: str, value: Any) -> Any:
    wanted = {str: "a text", float: "a number", int: "a whole number", bool: "true or false"}
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    fits = is_number if kind is float else type(value) is kind
    if not fits:
        raise LinkwiseError(f"{place} is {value!r}; give {wanted[kind]}")
    try:
        return float(value) if kind is float else value
    except OverflowError:
        raise LinkwiseError(f"{place}: so large a number is none of a float's") from None
