"""Closed forms in C: a robot's file to compile, in double or float, and headers.

A kernel's text does not say how many samples it takes nor which numbers: the file that includes it does. So
one text serves one sample and many, float and double, and a link's file stays the same in a longer robot.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from linkwise_runtime.version import VERSION

from linkwise.dynamics.kernel import Kernel
from linkwise.emit.c import header
from linkwise.emit.c.calls import LinkKernels
from linkwise.emit.c.kernel_function import (
    decomposition_outputs,
    kernel_function,
    outputs,
)
from linkwise.emit.c.robot_files import costs, header_view, most_kept, robot_view
from linkwise.emit.c.robot_tables import table_view
from linkwise.emit.c.sizes import link_spans
from linkwise.emit.c.stack import small_stack, straight_stack
from linkwise.emit.derivation import Derivation
from linkwise.escape import c_comment
from linkwise.render import render
from linkwise.symbolic.system import RigidSystem, System


def c_files(derivation: Derivation) -> Iterator[tuple[str, str]]:
    """Yield paths inside the package and texts."""
    system, name = derivation.system, derivation.package
    kernels = []
    for number, kernel in enumerate(derivation.kernels, 1):
        kernels.append(_link_kernels(system, kernel, number))
        yield f"c/link_{number}.h", _kernel_file(_link_view(system, number, kernels[-1], kernel.frame))
    links = link_spans(derivation.kernels)
    common = {"version": VERSION, "name": name}
    robot = common | robot_view(system, links, kernels)
    yield f"c/{name}.c", render("c/robot.c.j2", robot)
    yield f"c/{name}f.c", render("c/robotf.c.j2", common)
    names = common | {"upper": name.upper()}
    about = header_view(system, links, name) | costs(kernels)
    about["stack"] = f"{straight_stack(system, links):,}"
    about["small"] = small_stack(system, links, most_kept(kernels))
    yield f"c/{name}.h", render("c/robot.h.j2", names | about)
    tables = {"tables": list(header.index_tables(system, links))}
    yield f"c/{name}_index.h", render("c/index.h.j2", names | tables)
    if isinstance(system, RigidSystem):
        yield f"c/{name}_tree.h", render("c/tree.h.j2", common | table_view(system))


def _link_kernels(system: System, kernel: Kernel, number: int) -> LinkKernels:
    forms = kernel.forms[0]
    stem = f"link_{number}"
    results = decomposition_outputs(kernel, forms, number)
    torques = list(outputs("tau", forms.torque, number))
    gradients = list(outputs("c0", forms.position_gradient, number))
    return LinkKernels(
        kernel_function(system, kernel, f"{stem}_decomposition", "Decomposition", results),
        kernel_function(system, kernel, f"{stem}_torque", "Torques alone", torques),
        kernel_function(system, kernel, f"{stem}_position_gradient", "Position gradient", gradients),
    )


def _link_view(system: System, number: int, kernels: LinkKernels, frame: tuple[str, ...]) -> dict[str, Any]:
    return {
        "frame": frame,
        "title": f"Link {number}, {c_comment(system.links[number - 1].name)}",
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


def _kernel_file(view: Mapping[str, Any]) -> str:
    return render("c/link.h.j2", {"version": VERSION, **view})
