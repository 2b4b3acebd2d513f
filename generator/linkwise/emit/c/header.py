"""Contents of a robot's header: its joints, links and entries, how to compile, and the functions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from linkwise_runtime.native.compiler import FLAGS, TUNING

from linkwise.constraints.constrained_system import constraints_of
from linkwise.emit.c.sizes import Span
from linkwise.escape import c_comment, identifiers
from linkwise.symbolic.definition import joint_entries
from linkwise.symbolic.system import RigidSystem, System

BLOCK = {"double": 8, "float": 16}
"""Samples in a block: one cache line of each quantity, as in numbers.h."""

TUNED, TUNED_ARM = (" ".join(TUNING[kind]) for kind in ("x86_64", "aarch64"))
"""Flags that make full use of the processor, on x86 and on ARM."""


@dataclass(frozen=True)
class IndexTable:
    """The indices of an array's entries, written as C."""

    array: str
    total: str
    columns: int
    lines: tuple[str, ...]


@dataclass(frozen=True)
class LimitTable:
    """One limit of each joint: the array's name after the robot's, its meaning, and its numbers in C."""

    array: str
    about: str
    numbers: str


LIMITS = {
    "lower": "of the position, in rad or m",
    "upper": "of the position",
    "velocity": "of the speed either way, in rad/s or m/s",
    "effort": "of the torque or force either way, in N m or N",
}


def commands(name: str) -> list[str]:
    """Return command lines that compile a robot's double and float, on x86."""
    return [" ".join(("cc", *FLAGS, TUNED, "-c", source)) for source in (f"{name}.c", f"{name}f.c")]


def cpp_command(name: str) -> str:
    """Return the command line that compiles a robot's double as C++, on x86."""
    flags = (flag.replace("-std=c99", "-std=c++17") for flag in FLAGS)
    return " ".join(("c++", "-x", "c++", *flags, TUNED, "-c", f"{name}.c"))


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
            c_comment(system.links[link.first - 1].name),
        ]
        for link in links
    ]
    return align_columns([head, *rows])


def joint_lines(system: System) -> Iterator[str]:
    """Return a table: each joint, its unit and its name."""
    rows = [[str(k), c.unit, c_comment(c.name)] for k, c in enumerate(system.coordinates, 1)]
    return align_columns([["joint", "unit", "name"], *rows])


def tie_lines(system: System) -> list[str]:
    """Return a table: what ties joints, by name, and what each holds; empty for an open tree."""
    rows = [[c_comment(word) for word in row] for row in constraints_of(system)]
    return list(align_columns(rows)) if rows else []


def limit_tables(system: System) -> Iterator[LimitTable]:
    """Yield the limits of the joints as arrays of C, and their meaning."""
    entries = joint_entries(system)
    for what, about in LIMITS.items():
        none = "-HUGE_VAL" if what == "lower" else "HUGE_VAL"
        numbers = [none if (limit := getattr(e, what)) is None else repr(limit) for e in entries]
        yield LimitTable(f"{what}_limit", about, ", ".join(numbers))


def frame_lines(system: RigidSystem) -> Iterator[tuple[str, str]]:
    """Yield each frame's constant, without the robot's own name, with its name and what carries it."""
    frames = system.robot.named_frames
    constants = identifiers([frame.name for frame in frames], "FRAME_")
    for constant, frame in zip(constants, frames, strict=True):
        link = None if frame.link is None else system.robot.links[frame.link]
        moved = "on the ground" if link is None else f"behind {c_comment(link.joint.name)}"
        yield constant, f"{c_comment(frame.name)}, {moved}"


def parameter_lines(system: System) -> list[str]:
    """Return a table: each run-time parameter and the value that the description has."""
    rows = [[c_comment(s.name), repr(float(value))] for s, value in system.parameters.items()]
    return list(align_columns(rows))


def index_tables(system: System, links: Sequence[Span]) -> Iterator[IndexTable]:
    """Yield tables of the (i, j, k) or (i, j) of each entry, one line for each i of each link."""
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


def align_columns(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield lines with their columns below each other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "   ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def _partners(array: str, path: Sequence[int], place: int) -> Sequence[int | None]:
    """Return the joints k that joint i, at `place` of the path, has entries with."""
    return [None] if array == "g" else path[place:] if array == "c2" else path


def _entry(i: int, j: int, k: int | None) -> str:
    return f"{{{i}, {j}}}" if k is None else f"{{{i}, {j}, {k}}}"


def _run(path: Sequence[int]) -> str:
    """Return a path in words: as a range, 1 to 7, or joint by joint."""
    if len(path) > 2 and path[-1] - path[0] == len(path) - 1:
        return f"{path[0]} to {path[-1]}"
    return " ".join(map(str, path))
