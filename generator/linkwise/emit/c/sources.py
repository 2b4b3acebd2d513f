"""Closed forms in C: a robot's file to compile, in double or float, and headers.

A kernel's text does not say how many samples it takes nor which numbers: the file that includes it does. So
one text serves one sample and many, float and double, and a link's file stays the same in a longer robot.
"""

from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from typing import Any

from linkwise.dynamics.kernel import Kernel, parameter_names
from linkwise.emit.c import header
from linkwise.emit.c.calls import LinkKernels, call, group_calls, link_calls, motions, total
from linkwise.emit.c.kernel_function import (
    KernelFunction,
    decomposition_outputs,
    kernel_function,
    outputs,
)
from linkwise.emit.c.prototypes import cost, functions, pointers
from linkwise.emit.c.quantity_table import causes, quantity_lines
from linkwise.emit.c.shared_part import SHARED_FILE, SharedWork, shared_work
from linkwise.emit.c.sizes import EntryCounts, Span, groups, link_spans, whole
from linkwise.emit.derivation import Derivation
from linkwise.emit.render import render
from linkwise.symbolic.system import System
from linkwise.version import VERSION

FIXED = ("numbers.h", "sines.h", "rows.h", "stream.h")
"""Files that are the same in every package."""


def c_files(derivation: Derivation) -> Iterator[tuple[str, str]]:
    """Paths inside the package and texts."""
    system, name = derivation.system, derivation.package
    together = shared_work(system, derivation.shared) if derivation.shared else None
    kernels = []
    for number, kernel in enumerate(derivation.kernels, 1):
        rest = together.rests[number - 1] if together else None
        kernels.append(_link_kernels(system, kernel, number, rest))
        yield f"c/link_{number}.h", _kernel_file(_link_view(system, number, kernels[-1], kernel.frame))
    if together:
        yield f"c/{SHARED_FILE}", _kernel_file(_shared_view(together))
    links = link_spans(derivation.kernels)
    common = {"version": VERSION, "name": name}
    robot = common | _robot_view(system, links, kernels, together)
    yield f"c/{name}.c", render("c/robot.c.j2", robot)
    yield f"c/{name}f.c", render("c/robotf.c.j2", common)
    names = common | {"upper": name.upper()}
    yield (
        f"c/{name}.h",
        render("c/robot.h.j2", names | _header_view(system, links, name) | _costs(kernels, together)),
    )
    tables = {"tables": list(header.index_tables(system, links))}
    yield f"c/{name}_index.h", render("c/index.h.j2", names | tables)
    for file in FIXED:
        yield f"c/{file}", files("linkwise.runtime").joinpath("c", file).read_text(encoding="utf-8")


def _link_kernels(system: System, kernel: Kernel, number: int, rest: KernelFunction | None) -> LinkKernels:
    forms = kernel.forms[0]
    stem = f"link_{number}"
    results = decomposition_outputs(kernel, forms, number)
    torques = [output for output in results if output.array == "tau"]
    gradients = list(outputs("c0", forms.position_gradient, number))
    return LinkKernels(
        kernel_function(system, kernel, f"{stem}_decomposition", "Decomposition", results),
        kernel_function(system, kernel, f"{stem}_torque", "Torques alone", torques),
        kernel_function(system, kernel, f"{stem}_position_gradient", "Position gradient", gradients),
        rest,
    )


def _link_view(system: System, number: int, kernels: LinkKernels, frame: tuple[str, ...]) -> dict[str, Any]:
    return {
        "frame": frame,
        "title": f"Link {number}, {header.shown(system.links[number - 1].name)}",
        "about": (
            "The file that includes this one asks for functions by WANT_DECOMPOSITION, WANT_TORQUE and",
            "WANT_POSITION_GRADIENT, and says how many samples W they take; KERNEL completes their names.",
        ),
        "functions": (
            ("WANT_DECOMPOSITION", kernels.decomposition),
            ("WANT_TORQUE", kernels.torque),
            ("WANT_POSITION_GRADIENT", kernels.position_gradient),
        ),
    }


def _shared_view(together: SharedWork) -> dict[str, Any]:
    return {
        "frame": together.frame,
        "title": "All links together, where they share work",
        "about": (
            "shared_part computes what several links need, link_1_rest what is then left of link 1. The file",
            "that includes this one says how many samples W they take; KERNEL completes their names.",
            "Where a shared value has no name of its own, shared_30, say, is entry 30 of the array `shared`.",
        ),
        "functions": tuple(("", function) for function in (together.part, *together.rests)),
    }


def _kernel_file(view: Mapping[str, Any]) -> str:
    return render("c/link.h.j2", {"version": VERSION, **view})


def _robot_view(
    system: System, links: Sequence[Span], kernels: Sequence[LinkKernels], together: SharedWork | None
) -> dict[str, Any]:
    """Fields of NAME.c but for its name."""
    robot = whole(links)
    arrays = robot.size.arrays
    parts = tuple(groups(links))
    waiting = _most([whole(part).size for part in parts])
    names = list(parameter_names(system).values())
    motion = _inputs(system)
    shared = [("shared", together.values)] if together else []
    return {
        "n": len(system.coordinates),
        "totals": _totals(robot.size),
        "total": robot.size.total,
        "parameters": [(name, place) for place, name in enumerate(names)],
        "kernels": f"link_1.h to link_{len(links)}.h" if len(links) > 1 else "link_1.h",
        "inputs": pointers("const real", motion),
        "outputs": pointers("real", arrays),
        "motions": motions(motion),
        "pointers": ", ".join(f"*{array}" for array in arrays),
        "passed": ", ".join((*motion, *arrays)),
        "passed_motion": ", ".join(motion),
        "links": [link_calls(link, k) for link, k in zip(links, kernels, strict=True)],
        "groups": [group_calls(part, kernels, arrays) for part in parts],
        "room": [*shared, *((f"{array}_block", waiting.of(array)) for array in arrays)],
        "waiting": ", ".join(f"{array}_block" for array in arrays),
        "streams": len(parts) == 1,
        "largest": max(waiting.of(array) for array in arrays),
        "waiting_torques": waiting.g,
        "largest_gradient": max(link.size.c1 for link in links),
        "shared_calls": [call(together.part, "block", "m.", {"shared": "shared"})] if together else [],
        "decomposition_kernels": f'#include "{SHARED_FILE}"' if together else "#define WANT_DECOMPOSITION",
    }


def _header_view(system: System, links: Sequence[Span], name: str) -> dict[str, Any]:
    """Fields of NAME.h but for its name and its costs."""
    robot = whole(links)
    linear = bool(robot.size.h1)
    return {
        "commands": header.commands(name),
        "cpp_command": header.cpp_command(name),
        "tuned": header.TUNED,
        "tuned_arm": header.TUNED_ARM,
        "n": len(system.coordinates),
        "totals": _totals(robot.size),
        "full": ", ".join(array for array in ("c1", "c0", "h1") if robot.size.of(array)),
        "causes": causes(system),
        "quantities": list(quantity_lines(system, linear)),
        "links": list(header.link_lines(system, links)),
        "joints": list(header.joint_lines(system)),
        "parameters": header.parameter_lines(system),
        "blocks": tuple(header.BLOCK.values()),
        "functions": list(functions(_inputs(system), robot, links)),
    }


def _costs(kernels: Sequence[LinkKernels], together: SharedWork | None) -> dict[str, int]:
    """Arithmetic operations of a sample in NAME.h, of samples that go through blocks."""
    shared = [together.part] if together else []
    return {
        "decomposition_cost": cost([*shared, *(k.blocks for k in kernels)]),
        "torque_cost": cost(k.torque for k in kernels),
        "gradient_cost": cost(k.position_gradient for k in kernels),
    }


def _inputs(system: System) -> tuple[str, ...]:
    """Arrays that every function takes."""
    return ("q", "qd", "qdd", "p") if system.parameters else ("q", "qd", "qdd")


def _totals(size: EntryCounts) -> list[tuple[str, int]]:
    """Names in C and values of the robot's numbers of entries."""
    return [(total(array), size.of(array)) for array in size.arrays if array != "tau"]


def _most(sizes: Sequence[EntryCounts]) -> EntryCounts:
    """Return room for any of these."""
    return EntryCounts(*(max(size.of(array) for size in sizes) for array in ("c2", "c1", "g", "h1")))
