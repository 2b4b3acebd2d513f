"""Closed forms in C99: kernels over a block of samples, one file a link, and entry points over them.

A kernel's text doesn't say how wide its block or its numbers are: the files that include it do, so that one
text serves one sample and many, float and double, and a link's file stays the same in a longer robot.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from linkwise.dynamics.kernel import Kernel, parameter_names
from linkwise.emit.c.kernel_function import KernelFunction, decomposition_groups, kernel_function
from linkwise.emit.c.shared_part import fused
from linkwise.emit.derivation import Derivation
from linkwise.emit.render import render
from linkwise.symbolic.system import System
from linkwise.version import VERSION

BLOCK = {"double": 8, "float": 16}
"""Samples in a block: one cache line of each quantity."""

PARTS = (
    ("robot", "", "decomposition and torques of many samples"),
    ("one", "one_", "decomposition and torques of one sample"),
    ("gradient", "gradient_", "position gradient"),
)
"""Files for each number type: what they include, what their names begin with, what they hold."""

GROUP = 384
"""Values that wait in blocks at a time: 24 KiB, half of a usual first-level cache."""


@dataclass(frozen=True)
class LinkSizes:
    """Number of packed values of one link, and where they start in the robot's arrays."""

    number: int
    acceleration: int
    velocity: int
    gravity: int
    linear: int
    at_acceleration: int
    at_velocity: int
    at_gravity: int
    at_linear: int


@dataclass(frozen=True)
class LinkGroup:
    """Consecutive links whose results, block by block, stay in the cache until they turn into rows together.

    The fields beside `links` are those of LinkSizes, for the whole group.
    """

    links: tuple[LinkSizes, ...]
    acceleration: int
    velocity: int
    gravity: int
    linear: int
    at_acceleration: int
    at_velocity: int
    at_gravity: int
    at_linear: int


def c_files(derivation: Derivation) -> Iterator[tuple[str, str]]:
    """Paths inside the package and texts."""
    system, name = derivation.system, derivation.package
    shared = {"version": VERSION}
    for number, kernel in enumerate(derivation.kernels, 1):
        for file, functions in _functions(system, kernel, number):
            view = {**shared, "number": number, "functions": functions}
            yield f"c/{file}_{number}.inc", render("c/link.inc.j2", view)
    sizes = list(link_sizes(derivation.kernels))
    c2, c1, g, _, h1 = packed_sizes(derivation.kernels)
    totals = {"n": len(system.coordinates), "c2": c2, "c1": c1, "g": g, "h1": h1}
    groups = list(link_groups(sizes))
    kinds = ("acceleration", "velocity", "gravity", "linear")
    room = {kind: max(1, *(getattr(group, kind) for group in groups)) for kind in kinds}
    whole = fused(system, derivation.fused, derivation.kernels)
    robot = {**shared, "links": sizes, "groups": groups, "room": room, "largest": max(room.values())}
    robot["shared"] = whole.shared if whole else 0
    gradient = {**shared, "links": sizes, "largest": max(k.velocity for k in sizes)}
    header = {
        "name": name,
        "upper": name.upper(),
        "links": range(1, len(sizes) + 1),
        "parameters": len(system.parameters),
        "types": [("double", "", BLOCK["double"]), ("float", "f", BLOCK["float"])],
    }
    parameters = {"parameters": list(parameter_names(system).values())}
    yield f"c/{name}.h", render("c/robot.h.j2", shared | totals | header)
    yield "c/sizes.inc", render("c/sizes.inc.j2", shared | totals | parameters)
    yield "c/blocks.inc", render("c/blocks.inc.j2", shared)
    yield "c/one.inc", render("c/one.inc.j2", {**shared, "links": sizes})
    yield "c/robot.inc", render("c/robot.inc.j2", robot)
    if whole:
        view = {**shared, "number": 0, "functions": whole.functions}
        yield "c/fused.inc", render("c/link.inc.j2", view)
    yield "c/gradient.inc", render("c/gradient.inc.j2", gradient)
    for file in ("turn.c", "internal.h"):
        yield f"c/{file}", render(f"c/{file}.j2", {**shared, "name": name})
    for kind, suffix in (("double", ""), ("float", "f")):
        for part, stem, what in PARTS:
            view = {
                "name": name,
                "type": kind,
                "suffix": suffix,
                "block": BLOCK[kind],
                "part": part,
                "what": what,
            }
            yield f"c/{name}_{stem}{kind}.c", render("c/robot.c.j2", shared | view)


def link_sizes(kernels: Sequence[Kernel]) -> Iterator[LinkSizes]:
    """Sizes and offsets of the links' packed values, in order."""
    c2 = c1 = g = linear = 0
    for number, kernel in enumerate(kernels, 1):
        forms = kernel.forms[0]
        counts = (
            len(forms.acceleration),
            len(forms.velocity),
            len(forms.gravity),
            len(forms.linear_block(kernel.graph.zero)),
        )
        yield LinkSizes(number, *counts, c2, c1, g, linear)
        c2, c1, g, linear = c2 + counts[0], c1 + counts[1], g + counts[2], linear + counts[3]


def link_groups(sizes: Sequence[LinkSizes]) -> Iterator[LinkGroup]:
    """Groups of at most GROUP values; a link that is larger is one by itself."""
    links: list[LinkSizes] = []
    for link in sizes:
        if links and sum(map(_values, links)) + _values(link) > GROUP:
            yield _group(links)
            links = []
        links.append(link)
    yield _group(links)


def _values(k: LinkSizes) -> int:
    return k.acceleration + k.velocity + 2 * k.gravity + k.linear


def _group(links: Sequence[LinkSizes]) -> LinkGroup:
    kinds = ("acceleration", "velocity", "gravity", "linear")
    counts = {kind: sum(getattr(k, kind) for k in links) for kind in kinds}
    starts = {f"at_{kind}": getattr(links[0], f"at_{kind}") for kind in kinds}
    return LinkGroup(tuple(links), **counts, **starts)


def packed_sizes(kernels: Sequence[Kernel]) -> tuple[int, int, int, int, int]:
    """Packed values of one sample of the whole robot: c2, c1, g, τ, h1."""
    *_, last = link_sizes(kernels)
    gravity = last.at_gravity + last.gravity
    return (
        last.at_acceleration + last.acceleration,
        last.at_velocity + last.velocity,
        gravity,
        gravity,
        last.at_linear + last.linear,
    )


def _functions(system: System, kernel: Kernel, number: int) -> Iterator[tuple[str, list[KernelFunction]]]:
    """Stems of the link's files and the functions in each."""
    forms = kernel.forms[0]
    groups = decomposition_groups(kernel, forms)
    yield "link", [kernel_function(system, kernel, f"link_{number}_decomposition", groups)]
    torque = {"torque": groups["torque"]}
    yield "torque", [kernel_function(system, kernel, f"link_{number}_torque", torque)]
    gradient = {"gradient": list(forms.position_gradient.values())}
    yield "gradient", [kernel_function(system, kernel, f"gradient_{number}", gradient)]
