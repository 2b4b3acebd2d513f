"""Tables in C of a tree of rigid bodies, which loops read."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import sympy as sp
from linkwise_runtime.structure import passive_sums

from linkwise.dynamics.link_forms import lowering, parameter_names
from linkwise.emit.c.sizes import EntryCounts, Span
from linkwise.emit.c.tie_tables import tie_view
from linkwise.emit.printer import CPrinter
from linkwise.emit.straight_line import straight_line
from linkwise.escape import c_comment
from linkwise.robot.robot import Scalar
from linkwise.symbolic.system import RigidSystem

PRODUCTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Entries of an inertia, in the order of `struct body` in tree.h."""


@dataclass(frozen=True)
class Columns:
    """Columns that move each link, one for each coordinate of its path, ascending: see tree.h.

    sums: columns beyond those of joints, as (column, joint's column), for joints that follow one coordinate
    """

    of_links: tuple[tuple[int, ...], ...]
    sums: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class NamedFrame:
    """A named frame as rows of two tables: the frame that it stands in with its rotation, and its place."""

    standing: str
    place: str


def columns(system: RigidSystem) -> Columns:
    """Return the columns of a robot."""
    frames = len(system.robot.links)
    found: dict[tuple[int, int], int] = {}
    of_links = []
    for link in system.links:
        own: dict[int, int] = {}
        for frame in link.chain:
            k = system.robot.links[frame].joint.coordinate
            own[k] = found.setdefault((own[k], frame), frames + len(found)) if k in own else frame
        of_links.append(tuple(own[k] for k in sorted(own)))
    return Columns(tuple(of_links), tuple(found))


def path_spans(system: RigidSystem) -> tuple[Span, ...]:
    """Return each link by itself, in order; all its values are there, whether or not they are zero."""
    sizes = []
    for j in range(len(system.links)):
        d = len(system.path(j))
        sizes.append(EntryCounts(d * (d + 1) // 2, d * d, d))
    starts = accumulate(sizes, initial=EntryCounts())
    return tuple(
        Span(number, number, size, start)
        for number, (size, start) in enumerate(zip(sizes, starts, strict=False), 1)
    )


def table_view(system: RigidSystem) -> dict[str, Any]:
    """Return the fields of NAME_tree.h but for its name."""
    found, robot, links = columns(system), system.robot, path_spans(system)
    return tie_view(system) | {
        "frames": len(robot.links),
        "columns": len(robot.links) + len(found.sums),
        "joints": list(_joints(system)),
        "sums": [f"{{{a}, {b}}}" for a, b in found.sums],
        "links": [
            f"{{{link.chain[-1] + 1}, {span.start.c2}, {span.start.c1}, {span.start.g}}}, "
            f"/* {span.first}, {c_comment(link.name)} */"
            for link, span in zip(system.links, links, strict=True)
        ],
        "path_columns": [", ".join(map(str, own)) for own in found.of_links],
        "placings": list(_placings(system)),
        "curves": curve_tables(system),
        "bodies": list(_bodies(system)),
        "gravity": _row(_values(system, robot.gravity)),
        "passive": list(_passive(system)),
        "named": list(_named_frames(system)),
        "parameters": bool(system.parameters),
        "formulas": formulas(system, _places(system)),
        "offset_formulas": formulas(system, _offsets(system)),
    }


def formulas(system: RigidSystem, numbers: Iterable[tuple[str, Scalar]]) -> list[str]:
    """Return statements that set the numbers in `x` that depend on run-time parameters, which `p` holds."""
    lower, _ = lowering(system)
    places = [(place, value) for place, value in numbers if isinstance(value, sp.Expr) and value.free_symbols]
    code = straight_line(lower.graph, [lower(value) for _, value in places], CPrinter())
    names = [name for name in parameter_names(system).values() if name in code.symbols]
    return [
        *(f"const real {name} = p[at_{name}];" for name in names),
        *(f"const real {variable} = {text};" for variable, text in code.assignments),
        *(f"x.{place} = {text};" for (place, _), text in zip(places, code.outputs, strict=True)),
    ]


def place_matters(system: RigidSystem) -> list[bool]:
    """Return whether the place of each frame matters.

    A frame that nothing before it turns may as well be at the origin.
    """
    turned: list[bool] = []
    matters = []
    for link in system.robot.links:
        matters.append(link.parent is not None and turned[link.parent])
        turned.append(matters[-1] or link.joint.kind == "revolute")
    return matters


def _joints(system: RigidSystem) -> Iterator[str]:
    matters = place_matters(system)
    for number, link in enumerate(system.robot.links, 1):
        joint = link.joint
        up = 0 if link.parent is None else link.parent + 1
        yield (
            f"{{{up}, {joint.coordinate}, {joint.kind.upper()}, {int(matters[number - 1])}}}, "
            f"/* {number}, {c_comment(joint.name)} */"
        )


def _placings(system: RigidSystem) -> Iterator[str]:
    for link in system.robot.links:
        joint = link.joint
        turn = _row(entry for row in joint.rotation for entry in row)
        yield f"{{{turn}, {_row(_values(system, joint.translation))}, {_number(joint.ratio)}}}"


@dataclass(frozen=True)
class CurveRows:
    """The curves that joints follow, as rows of the tables that curves.h reads."""

    powers: int
    joints: tuple[str, ...]
    starts: tuple[str, ...]
    pieces: tuple[str, ...]


def curve_tables(system: RigidSystem) -> CurveRows | None:
    """Return the tables of a robot's curves; None where no joint follows a curve."""
    joints = [link.joint for link in system.robot.links]
    curves = [joint.curve for joint in joints if joint.curve]
    if not curves:
        return None
    powers = max(len(piece) for curve in curves for piece in curve.pieces)
    rows, first = [], 0
    for number, joint in enumerate(joints, 1):
        count = len(joint.curve.pieces) if joint.curve else 0
        rows.append(f"{{{first}, {count}}}, /* {number}, {c_comment(joint.name)} */")
        first += count
    pieces = (_row((*piece, *[0.0] * (powers - len(piece)))) for curve in curves for piece in curve.pieces)
    starts = (_number(start) for curve in curves for start in curve.starts)
    return CurveRows(powers, tuple(rows), tuple(starts), tuple(pieces))


def _bodies(system: RigidSystem) -> Iterator[str]:
    for link in system.links:
        [mass] = _values(system, (link.mass,))
        inertia = _values(system, (link.inertia[i][k] for i, k in PRODUCTS))
        yield f"{{{_number(mass)}, {_row(_values(system, link.com))}, {_row(inertia)}}}"


def _passive(system: RigidSystem) -> Iterator[str]:
    """Yield the passive properties of each coordinate's joints; nothing where no joint has any."""
    if passive := system.robot.passive:
        sums = passive_sums(passive, len(system.coordinates))
        for k, own in enumerate(zip(*sums, strict=True), 1):
            yield f"{_row(own)}, /* {k}, {c_comment(system.coordinates[k - 1].name)} */"


def _named_frames(system: RigidSystem) -> Iterator[NamedFrame]:
    for number, frame in enumerate(system.robot.named_frames):
        stands_in = 0 if frame.link is None else frame.link + 1
        turn = _row(entry for row in frame.rotation for entry in row)
        yield NamedFrame(
            f"{{{stands_in}, {turn}}}, /* {number}, {c_comment(frame.name)} */",
            _row(_values(system, frame.translation)),
        )


def _offsets(system: RigidSystem) -> Iterator[tuple[str, Scalar]]:
    """Yield every number that may depend on parameters, by its place in `struct offsets`."""
    for number, frame in enumerate(system.robot.named_frames):
        yield from _entries(f"place[{number}]", frame.translation)


def _places(system: RigidSystem) -> Iterator[tuple[str, Scalar]]:
    """Yield every number that may depend on parameters, by its place in `struct numbers`."""
    for f, frame in enumerate(system.robot.links):
        yield from _entries(f"placings[{f}].place", frame.joint.translation)
    for j, link in enumerate(system.links):
        yield f"bodies[{j}].mass", link.mass
        yield from _entries(f"bodies[{j}].com", link.com)
        yield from _entries(f"bodies[{j}].inertia", (link.inertia[i][k] for i, k in PRODUCTS))
    yield from _entries("gravity", system.robot.gravity)


def _entries(place: str, values: Iterable[Scalar]) -> Iterator[tuple[str, Scalar]]:
    return ((f"{place}[{at}]", value) for at, value in enumerate(values))


def _values(system: RigidSystem, scalars: Iterable[Scalar]) -> list[float]:
    parameters = system.parameters
    return [float(s.xreplace(parameters)) if isinstance(s, sp.Expr) else float(s) for s in scalars]


def _row(values: Iterable[float]) -> str:
    return f"{{{', '.join(map(_number, values))}}}"


def _number(value: float) -> str:
    return f"R({float(value)!r})"
