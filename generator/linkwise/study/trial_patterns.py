"""One entry for many trials: {FIELD} in the path of a log is what differs, and fills the other keys."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.study.study_paths import found_by_pattern, placed

FIELD = re.compile(r"\{([A-Za-z_]\w*)\}")


def expanded(entry: Mapping[str, Any], folder: Path) -> Iterator[dict[str, Any]]:
    """The entry itself, or one for each log that its pattern finds, by name.

    Fields that no key is called are filled in and gone. Raises LinkwiseError where the pattern finds nothing,
    for a path that fits in two ways,
    and for a field of another key that the log's path does not have.
    """
    log = entry.get("log")
    fields = dict.fromkeys(FIELD.findall(log)) if isinstance(log, str) else {}
    if not isinstance(log, str) or not fields:
        yield dict(entry)
        return
    whole = placed(log, folder)
    found = found_by_pattern(FIELD.split(whole)[::2])
    matches = {path: values for path in found if (values := _fields(whole, path))}
    if not matches:
        raise LinkwiseError(f"no log is called {log}; correct the pattern")
    for path, values in matches.items():
        yield {key: _with(value, values, key) for key, value in entry.items() if key != "log"} | {
            "log": path,
            **{name: text for name, text in values.items() if name not in entry},
        }


def _fields(pattern: str, path: str) -> dict[str, str]:
    """Fields of a path that fits; none where it does not. Raises LinkwiseError where it fits in two ways."""
    short, long = (_expression(pattern, sign).fullmatch(path) for sign in ("+?", "+"))
    if short is None or long is None:
        return {}
    if short.groupdict() != long.groupdict():
        ways = (", ".join(f"{k}={v}" for k, v in way.groupdict().items()) for way in (short, long))
        raise LinkwiseError(
            f"{path} fits the pattern in two ways, {' and '.join(ways)}; put folders, or signs that names do"
            " not have, between the fields"
        )
    return short.groupdict()


def _expression(pattern: str, much: str) -> re.Pattern[str]:
    """What a path must be; a field that stands twice is the same text. `much` says how long fields are."""
    parts, last, seen = [], 0, set[str]()
    for match in FIELD.finditer(pattern):
        name = match[1]
        parts += [
            re.escape(pattern[last : match.start()]),
            f"(?P={name})" if name in seen else f"(?P<{name}>[^/]{much})",
        ]
        seen.add(name)
        last = match.end()
    return re.compile("".join([*parts, re.escape(pattern[last:])]))


def _with(value: Any, fields: Mapping[str, str], key: str) -> Any:
    """A value with fields filled in, in texts and lists of them."""
    if isinstance(value, list):
        return [_with(item, fields, key) for item in value]
    if not isinstance(value, str):
        return value

    def filled(match: re.Match[str]) -> str:
        if match[1] not in fields:
            raise LinkwiseError(f"{key} has the field {{{match[1]}}}, which the path of the log has not")
        return fields[match[1]]

    return FIELD.sub(filled, value)
