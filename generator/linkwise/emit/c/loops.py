"""Loops in C: the robot in tables, and fixed files that work on them."""

from collections.abc import Iterator, Sequence
from typing import Any

from linkwise_runtime.version import VERSION

from linkwise.dynamics.link_forms import parameter_names
from linkwise.emit.c import header
from linkwise.emit.c.loop_costs import decomposition_cost, gradient_cost, torque_cost
from linkwise.emit.c.prototypes import at_position, pointers, under_torque
from linkwise.emit.c.robot_files import free, header_view, input_arrays, path_fields, rows_from_s, totals
from linkwise.emit.c.robot_tables import path_spans, table_view
from linkwise.emit.c.sizes import Span, whole
from linkwise.emit.c.stack import loops_stack, small_stack
from linkwise.emit.c.tie_tables import has_tied_functions
from linkwise.emit.derivation import Derivation
from linkwise.render import render
from linkwise.symbolic.system import RigidSystem


def loop_files(derivation: Derivation) -> Iterator[tuple[str, str]]:
    """Yield paths inside the package and texts.

    Raises TypeError for what is not rigid bodies.
    """
    system, name = derivation.system, derivation.package
    if not isinstance(system, RigidSystem):
        raise TypeError("a kernel in loops goes over rigid bodies")
    links = path_spans(system)
    common = {"version": VERSION, "name": name}
    yield f"c/{name}.c", render("c/robot_loops.c.j2", common | _robot_view(system, links))
    yield f"c/{name}_tree.h", render("c/tree.h.j2", common | table_view(system))
    yield f"c/{name}f.c", render("c/robotf.c.j2", common)
    names = common | {"upper": name.upper()}
    costs = {
        "decomposition_cost": decomposition_cost(system),
        "torque_cost": torque_cost(system),
        "gradient_cost": gradient_cost(system),
        "stack": f"{loops_stack(system):,}",
        "small": small_stack(system, links, 0),
    }
    yield f"c/{name}.h", render("c/robot.h.j2", names | header_view(system, links, name) | costs)
    tables = {"tables": list(header.index_tables(system, links))}
    yield f"c/{name}_index.h", render("c/index.h.j2", names | tables)


def _robot_view(system: RigidSystem, links: Sequence[Span]) -> dict[str, Any]:
    """Return the fields of NAME.c but for its name."""
    robot, motion = whole(links), input_arrays(system)
    return path_fields(system) | {
        "n": len(system.coordinates),
        "links": len(links),
        "free": free(system),
        "constrained": has_tied_functions(system),
        "totals": totals(robot.size),
        "parameters": list(enumerate(parameter_names(system).values())),
        "inputs": pointers("const real", motion),
        "passed": ", ".join(motion),
        "rows_from_s": rows_from_s(motion),
        "inputs_at_rest": pointers("const real", (array for array in motion if array != "qdd")),
        "passed_at_rest": ", ".join("qd" if array == "qdd" else array for array in motion),
        "inputs_at_position": pointers("const real", at_position(motion)),
        "inputs_under_torque": pointers("const real", under_torque(motion)),
    }
