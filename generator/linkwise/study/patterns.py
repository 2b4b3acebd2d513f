"""Patterns of logs for many trials.

In the path of a log {FIELD} is what differs, any text but an empty one in one part of the path, and fills the
other keys of the trial's entry.
"""

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.study.paths import found_by_pattern, placed

FIELD = re.compile(r"\{([A-Za-z_]\w*)\}")
MOST = 10_000
"""Most ends of fields that are tried for a path; in ordinary paths each one tried is the right one."""

Way = list[tuple[int, int]]
"""Start and end of each field in the path."""


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


class FieldedPath:
    """A pattern of texts, and the fields between them; a field that stands twice is the same text."""

    def __init__(self, pattern: str) -> None:
        self.texts, self.names = FIELD.split(pattern)[::2], FIELD.findall(pattern)
        at: dict[str, int] = {}
        self._first = [at.setdefault(name, number) for number, name in enumerate(self.names)]

    def fields_of(self, path: str) -> dict[str, str]:
        """Return the fields of a path that fits the pattern; empty if it does not fit.

        Raises LinkwiseError where it fits in two ways, and where too many would have to be tried.
        """
        if not path.startswith(self.texts[0]) or not (ends := self._ends(path)):
            return {}
        short, long = (self._way(path, ends, is_long) for is_long in (False, True))
        if short is None or long is None:
            return {}
        if short != long:
            ways = (
                ", ".join(f"{k}={v}" for k, v in self._values(path, way).items()) for way in (short, long)
            )
            raise _unclear(f"{path} fits the pattern in two ways, {' and '.join(ways)}")
        return self._values(path, short)

    def _values(self, path: str, way: Way) -> dict[str, str]:
        return {name: path[start:end] for name, (start, end) in zip(self.names, way, strict=True)}

    def _ends(self, path: str) -> list[list[int]]:
        """Return where each field may end so that the rest fits to the path's end; empty if it never does.

        The pattern is followed once, from its end, with all places at a time. A regular expression tries one
        after the other, which takes forever for a dozen fields. A field that stands twice is any text here.
        """
        ends = [len(path) - len(self.texts[-1])] if path.endswith(self.texts[-1]) else []
        found = [ends]
        for text in reversed(self.texts[1:-1]):
            if not ends:
                return []
            starts = range(path.rfind("/", 0, ends[-1]) + 1, ends[-1])
            ends = [at - len(text) for at in starts if path.endswith(text, 0, at)]
            found.append(ends)
        return found[::-1] if ends else []

    def _way(self, path: str, ends: list[list[int]], is_long: bool) -> Way | None:
        """Return the way whose fields, one after the other, are as short or as long as they can be.

        It is None where no way fits. Raises LinkwiseError where too many would have to be tried.
        """
        way: Way = []
        tried = [self._tries(path, ends, way, is_long)]
        for _ in range(MOST):
            field = next(tried[-1], None)
            if field is not None:
                way.append(field)
                if len(way) == len(ends):
                    return way
                tried.append(self._tries(path, ends, way, is_long))
            elif way:
                way.pop()
                tried.pop()
            else:
                return None
        raise _unclear(f"{path} may fit the pattern in too many ways to try them")

    def _tries(
        self, path: str, ends: list[list[int]], way: Sequence[tuple[int, int]], is_long: bool
    ) -> Iterator[tuple[int, int]]:
        """Yield the possible start and end of the next field after those of a way."""
        number = len(way)
        start = (way[-1][1] if way else 0) + len(self.texts[number])
        known = ends[number]
        if (first := self._first[number]) < number:
            text = path[slice(*way[first])]
            end = start + len(text)
            if path.startswith(text, start) and known[(at := bisect_left(known, end)) : at + 1] == [end]:
                yield start, end
            return
        slash = path.find("/", start)
        fits = range(bisect_right(known, start), bisect_right(known, slash if slash >= 0 else len(path)))
        for at in reversed(fits) if is_long else fits:
            yield start, known[at]


def _unclear(what: str) -> LinkwiseError:
    return LinkwiseError(f"{what}; put folders, or signs that names do not have, between the fields")
