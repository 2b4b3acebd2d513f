"""What a robot's header says: which joint, link and entry is which, how to compile, and the functions."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from linkwise.emit.c.sizes import Span
from linkwise.runtime.native_compiler import FLAGS
from linkwise.symbolic.system import System

BLOCK = {"double": 8, "float": 16}
"""Samples in a block: one cache line of each quantity, as in numbers.h."""

COMMAND = " ".join(("cc", *FLAGS, "-march=native", "-c"))
LONGEST = 60
"""Characters of a name that are shown."""


@dataclass(frozen=True)
class Functions:
    """The functions of one number type; `links` pairs each link's number with the outputs of its function."""

    title: str
    type: str
    suffix: str
    inputs: str
    outputs: str
    links: tuple[tuple[int, str], ...]


@dataclass(frozen=True)
class IndexTable:
    """The indices of an array's entries, written as C."""

    array: str
    total: str
    columns: int
    lines: tuple[str, ...]


def pointers(kind: str, arrays: Iterable[str]) -> str:
    """Return declarations of array parameters; `kind` is such as const double."""
    return ", ".join(f"{kind} *{array}" for array in arrays)


def functions(inputs: Sequence[str], robot: Span, links: Sequence[Span]) -> Iterator[Functions]:
    """Functions of double, then of float."""
    for kind, suffix in (("double", ""), ("float", "f")):
        yield Functions(
            f"All links, many samples, in {kind}",
            kind,
            suffix,
            pointers(f"const {kind}", inputs),
            pointers(kind, robot.size.arrays),
            tuple((link.first, pointers(kind, link.size.arrays)) for link in links),
        )


def link_lines(system: System, links: Sequence[Span]) -> Iterator[str]:
    """Return a table: each link, its name, the joints on its path, and where its entries begin."""
    linear = any(link.size.h1 for link in links)
    head = ["link", "path", "c2", "c1, c0", "g, tau", *(["h1"] if linear else []), "name"]
    rows = [
        [
            str(link.first),
            _run([k + 1 for k in system.path(link.first - 1)]),
            str(link.start.c2),
            str(link.start.c1),
            str(link.start.g),
            *([str(link.start.h1) if link.size.h1 else "-"] if linear else []),
            shown(system.links[link.first - 1].name),
        ]
        for link in links
    ]
    return _aligned([head, *rows])


def joint_lines(system: System) -> Iterator[str]:
    """Return a table: each joint, its unit and its name."""
    rows = [[str(k), c.unit, shown(c.name)] for k, c in enumerate(system.coordinates, 1)]
    return _aligned([["joint", "unit", "name"], *rows])


def parameter_lines(system: System) -> list[str]:
    """Return a table: each run-time parameter and the value that the description has."""
    rows = [[shown(s.name), repr(float(value))] for s, value in system.parameters.items()]
    return list(_aligned(rows))


def index_tables(system: System, links: Sequence[Span]) -> Iterator[IndexTable]:
    """Which (i, j, k) or (i, j) each entry is, one line for each i of each link."""
    paths = [(link, [k + 1 for k in system.path(link.first - 1)]) for link in links]
    for array in ("c2", "c1", "g", "h1"):
        lines = [
            ", ".join(_entry(i, link.first, k) for k in _partners(array, path, place))
            for link, path in paths
            if link.size.of(array)
            for place, i in enumerate(path)
        ]
        if lines:
            commas = [f"{line}," for line in lines[:-1]] + lines[-1:]
            yield IndexTable(array, array.upper(), 2 if array == "g" else 3, tuple(commas))


def shown(name: str) -> str:
    """Return a name as a comment may hold it: ASCII, in quotes, without what opens or ends a comment."""
    text = ascii(name)
    text = text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
    for pair in ("*/", "/*", "??"):
        text = text.replace(pair, " ".join(pair))
    return text


def _partners(array: str, path: Sequence[int], place: int) -> Sequence[int | None]:
    """Joints k that joint i, at `place` of the path, has entries with."""
    return [None] if array == "g" else path[place:] if array == "c2" else path


def _entry(i: int, j: int, k: int | None) -> str:
    return f"{{{i}, {j}}}" if k is None else f"{{{i}, {j}, {k}}}"


def _run(path: Sequence[int]) -> str:
    """Return a path: 1 to 7, or its joints one by one."""
    if len(path) > 2 and path[-1] - path[0] == len(path) - 1:
        return f"{path[0]} to {path[-1]}"
    return " ".join(map(str, path))


def _aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Return lines with their columns below each other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "   ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
