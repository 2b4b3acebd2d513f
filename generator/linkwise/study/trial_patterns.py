"""Entries for many trials: {FIELD} in the path of a log is what differs, and fills the other keys."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.study.path_fields import FIELD, FieldedPath
from linkwise.study.study_paths import found_by_pattern, placed


def expanded(entry: Mapping[str, Any], folder: Path) -> Iterator[dict[str, Any]]:
    """Yield the entry itself, or one for each log that its pattern finds, sorted by name.

    Each field is filled into the other keys, and becomes a key itself where the entry has none of its name;
    `trials_of` drops those that no key of a trial is called. Raises LinkwiseError where the pattern finds
    nothing, for a path that fits in two ways, and for a field of another key that the log's path does not
    have.
    """
    log = entry.get("log")
    fields = dict.fromkeys(FIELD.findall(log)) if isinstance(log, str) else {}
    if not isinstance(log, str) or not fields:
        yield dict(entry)
        return
    pattern = FieldedPath(placed(log, folder))
    found = found_by_pattern(pattern.texts)
    matches = {path: values for path in found if (values := pattern.fields_of(path))}
    if not matches:
        raise LinkwiseError(f"no log is called {log}; correct the pattern")
    for path, values in matches.items():
        yield {key: _with(value, values, key) for key, value in entry.items() if key != "log"} | {
            "log": path,
            **{name: text for name, text in values.items() if name not in entry},
        }


def _with(value: Any, fields: Mapping[str, str], key: str) -> Any:
    """Return a value with fields filled in, in texts and lists of them."""
    if isinstance(value, list):
        return [_with(item, fields, key) for item in value]
    if not isinstance(value, str):
        return value

    def filled(match: re.Match[str]) -> str:
        if match[1] not in fields:
            raise LinkwiseError(f"{key} has the field {{{match[1]}}}, which the path of the log has not")
        return fields[match[1]]

    return FIELD.sub(filled, value)
