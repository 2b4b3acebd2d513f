"""Compiled modules that Python keeps in `__pycache__`, which run in place of the sources beside them.

linkwise imports packages without them, but the Python of a package's user does not, and would run whatever
lies there. They are compared part by part: code objects count as equal with any size of stack, and as
different without the columns that -X no_debug_ranges leaves out.
"""

import importlib.util
import inspect
import marshal
import re
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import CodeType

from linkwise.input_file import is_file
from linkwise.package.manifest import is_too_large

CACHE = "__pycache__"
NAME = re.compile(
    r"(?P<module>[^.]+)\.(?P<python>[^.]+)(\.opt-(?P<optimization>\w+))?\.pyc(?P<unfinished>\.\d+)?"
)
HEADER = 16
PLACE = {"co_filename", "co_linetable", "co_lnotab", "co_consts"}
RUN = sorted(
    name
    for name, what in vars(CodeType).items()
    if name.startswith("co_") and name not in PLACE and inspect.isdatadescriptor(what)
)
"""Attributes of code that say what it does; not its constants, nor from which lines of which file it is."""


@dataclass(frozen=True)
class Cache:
    """A compiled module: its source, its Python ("cpython-311"), and how far it is optimized."""

    file: Path
    source: Path
    python: str
    optimization: str
    finished: bool

    @property
    def readable(self) -> bool:
        """True if this Python made it, and would run it."""
        plain = self.optimization in ("", "1", "2")
        return self.finished and plain and self.python == sys.implementation.cache_tag


def cache_of(file: Path) -> Cache | None:
    """Return the cache that a file's name in `__pycache__` describes; None for a name that Python has not."""
    found = NAME.fullmatch(file.name)
    if found is None:
        return None
    source = file.parent.parent / f"{found['module']}.py"
    return Cache(file, source, found["python"], found["optimization"] or "", not found["unfinished"])


def caches(directory: Path, files: Iterable[str]) -> list[Cache]:
    """Return the caches of a package's modules, also those elsewhere that PYTHONPYCACHEPREFIX names."""
    sources = [directory / file for file in files if file.endswith(".py")]
    places = {source.parent / CACHE for source in sources}
    found = {file for place in places if place.is_dir() for file in place.iterdir()}
    known = {cache.file: cache for file in found if (cache := cache_of(file)) is not None}
    for source in sources:
        for level in ("", "1", "2"):
            file = Path(importlib.util.cache_from_source(source, optimization=level))
            if file.is_file():
                known[file] = Cache(file, source, sys.implementation.cache_tag or "", level, True)
    return sorted((cache for cache in known.values() if cache.source in sources), key=lambda c: c.file)


def is_compiled_from_source(cache: Cache) -> bool:
    """Return whether the cache of a module does what its source says; compiles that and runs neither.

    The cache is read as Python would read it, which like Python trusts it to be well-formed.
    """
    try:
        if not is_file(cache.file) or is_too_large(cache.file) or is_too_large(cache.source):
            return False
        data = cache.file.read_bytes()
        if data[:4] != importlib.util.MAGIC_NUMBER:
            return False
        code = marshal.loads(data[HEADER:])
        level = int(cache.optimization or 0)
        made = compile(cache.source.read_bytes(), code.co_filename, "exec", dont_inherit=True, optimize=level)
        return _plain(code) == _plain(made)
    except Exception:  # a damaged one may raise anything
        return False


def _plain(value: object) -> object:
    """Return a constant or code as nested tuples of text: 0, 0.0 and False differ, and a set has no order."""
    if isinstance(value, CodeType):
        return (*(repr(getattr(value, name)) for name in RUN), _plain(value.co_consts))
    if isinstance(value, tuple):
        return tuple(_plain(item) for item in value)
    if isinstance(value, frozenset):
        return ("frozenset", *sorted(repr(_plain(item)) for item in value))
    return f"{type(value).__name__} {value!r}"
