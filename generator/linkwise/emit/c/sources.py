"""Closed forms in C: a robot's file to compile, in double or float, and headers.

The text of a link's functions does not say how many samples they take nor which numbers: the file that
includes it does. So one text serves one sample and many, float and double, and a link's file stays the same
in a longer robot.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from linkwise_runtime.version import VERSION

from linkwise.dynamics.link_forms import LinkForms
from linkwise.emit.c import header
from linkwise.emit.c.calls import LinkFormFunctions
from linkwise.emit.c.form_function import (
    decomposition_outputs,
    form_function,
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
    functions = []
    for number, forms in enumerate(derivation.forms, 1):
        functions.append(_link_functions(system, forms, number))
        yield f"c/link_{number}.h", _link_file(_link_view(system, number, functions[-1], forms.frame))
    links = link_spans(derivation.forms)
    common = {"version": VERSION, "name": name}
    robot = common | robot_view(system, links, functions)
    yield f"c/{name}.c", render("c/robot.c.j2", robot)
    yield f"c/{name}f.c", render("c/robotf.c.j2", common)
    names = common | {"upper": name.upper()}
    about = header_view(system, links, name) | costs(functions)
    about["stack"] = f"{straight_stack(system, links):,}"
    about["small"] = small_stack(system, links, most_kept(functions))
    yield f"c/{name}.h", render("c/robot.h.j2", names | about)
    tables = {"tables": list(header.index_tables(system, links))}
    yield f"c/{name}_index.h", render("c/index.h.j2", names | tables)
    if isinstance(system, RigidSystem):
        yield f"c/{name}_tree.h", render("c/tree.h.j2", common | table_view(system))


def _link_functions(system: System, forms: LinkForms, number: int) -> LinkFormFunctions:
    stem = f"link_{number}"
    results = decomposition_outputs(forms, number)
    torques = list(outputs("tau", forms.torque, number))
    gradients = list(outputs("c0", forms.position_gradient, number))
    return LinkFormFunctions(
        form_function(system, forms, f"{stem}_decomposition", "Decomposition", results),
        form_function(system, forms, f"{stem}_torque", "Torques alone", torques),
        form_function(system, forms, f"{stem}_position_gradient", "Position gradient", gradients),
    )


def _link_view(
    system: System, number: int, functions: LinkFormFunctions, frame: tuple[str, ...]
) -> dict[str, Any]:
    return {
        "frame": frame,
        "title": f"Link {number}, {c_comment(system.links[number - 1].name)}",
        "about": (
            "The file that includes this one asks for functions by WANT_DECOMPOSITION, WANT_TORQUE and",
            "WANT_POSITION_GRADIENT, and says how many samples W they take; LINK_FUNCTION declares them.",
        ),
        "functions": (
            ("WANT_DECOMPOSITION", functions.decomposition),
            ("WANT_TORQUE", functions.torque),
            ("WANT_POSITION_GRADIENT", functions.position_gradient),
        ),
    }


def _link_file(view: Mapping[str, Any]) -> str:
    return render("c/link.h.j2", {"version": VERSION, **view})
