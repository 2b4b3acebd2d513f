"""Fields from which a robot's own C file and its header are rendered."""

from collections.abc import Sequence
from itertools import accumulate
from typing import Any

from linkwise_runtime.native.library import MOST_CONTACTS

from linkwise.dynamics.link_forms import parameter_names
from linkwise.emit.c import header
from linkwise.emit.c.calls import LinkFormFunctions, group_calls, link_calls, motions, total
from linkwise.emit.c.prototypes import at_position, cost, functions, pointers, under_torque
from linkwise.emit.c.quantity_table import causes, potential, quantity_lines
from linkwise.emit.c.sizes import EntryCounts, Span, groups, most_counts, tile, waiting_counts, whole
from linkwise.emit.c.tie_tables import has_tied_functions, scratch
from linkwise.escape import c_string
from linkwise.symbolic.system import EnergySystem, RigidSystem, System


def robot_view(
    system: System, links: Sequence[Span], functions: Sequence[LinkFormFunctions]
) -> dict[str, Any]:
    """Return the fields of NAME.c but for its name."""
    robot = whole(links)
    arrays = robot.size.arrays
    n = len(system.coordinates)
    one = most_counts([link.size for link in links])
    parts = tuple(groups(links))
    waiting = waiting_counts(links)
    names = list(parameter_names(system).values())
    motion = input_arrays(system)
    calls = [link_calls(link, own) for link, own in zip(links, functions, strict=True)]
    return path_fields(system) | {
        "n": n,
        "nonquadratic": ", ".join("1" if link.size.h1 else "0" for link in links),
        "totals": totals(robot.size),
        "total": robot.size.total,
        "parameters": [(name, place) for place, name in enumerate(names)],
        "link_files": f"link_1.h to link_{len(links)}.h" if len(links) > 1 else "link_1.h",
        "inputs": pointers("const real", motion),
        "outputs": pointers("real", arrays),
        "motions": motions(motion),
        "pointers": ", ".join(f"*{array}" for array in arrays),
        "passed": ", ".join((*motion, *arrays)),
        "passed_motion": ", ".join(motion),
        "rows_from_s": rows_from_s(motion),
        "results_from_s": ", ".join(f"{array} + s * {total(array)}" for array in arrays),
        "inputs_at_rest": pointers("const real", (array for array in motion if array != "qdd")),
        "passed_at_rest": ", ".join("qd" if array == "qdd" else array for array in motion),
        "inputs_at_position": pointers("const real", at_position(motion)),
        "inputs_under_torque": pointers("const real", under_torque(motion)),
        "links": calls,
        "groups": [group_calls(part, functions, arrays) for part in parts],
        "tile": tile(waiting),
        "room": [(array, waiting.of(array)) for array in arrays],
        "room_of_one": [(array, one.of(array)) for array in arrays],
        "results_of_one": ", ".join(arrays),
        "waiting": ", ".join(f"room->{array}[t]" for array in arrays),
        "lines": " && ".join(f"starts_line({array})" for array in arrays),
        "streams": len(parts) == 1,
        "slopes": "r->h1" if robot.size.h1 else "NULL",
        "largest": max(waiting.of(array) for array in arrays),
        "rigid": isinstance(system, RigidSystem),
        "free": free(system),
        "constrained": has_tied_functions(system),
        "of_sample": [(array, total(array)) for array in arrays],
        "largest_gradient": max(link.size.c1 for link in links),
    }


def path_fields(system: System) -> dict[str, Any]:
    """Return the fields of NAME.c that say which joints move each link."""
    paths = [system.path(j) for j in range(len(system.links))]
    return {
        "paths": [", ".join(map(str, path)) for path in paths if path],
        "path_starts": ", ".join(map(str, accumulate(map(len, paths), initial=0))),
        "longest": max(map(len, paths)),
    }


def header_view(system: System, links: Sequence[Span], name: str) -> dict[str, Any]:
    """Return the fields of NAME.h but for its name, its costs and its stack."""
    robot = whole(links)
    nonquadratic = bool(robot.size.h1)
    return {
        "commands": header.commands(name),
        "cpp_command": header.cpp_command(name),
        "tuned": header.TUNED,
        "tuned_arm": header.TUNED_ARM,
        "n": len(system.coordinates),
        "totals": totals(robot.size),
        "full": ", ".join(array for array in ("c1", "c0", "h1") if robot.size.of(array)),
        "causes": causes(system),
        "potential": potential(system),
        "quantities": list(quantity_lines(system, nonquadratic)),
        "links": list(header.link_lines(system, links)),
        "joints": list(header.joint_lines(system)),
        "names": [c_string(c.name) for c in system.coordinates],
        "ties": list(header.tie_lines(system)),
        "limits": list(header.limit_tables(system)),
        "parameters": header.parameter_lines(system),
        "blocks": tuple(header.BLOCK.values()),
        "rigid": isinstance(system, RigidSystem),
        "free": free(system),
        "constrained": has_tied_functions(system),
        "contacts": MOST_CONTACTS,
        "scratch": scratch(system) if isinstance(system, RigidSystem) else 0,
        "varying": isinstance(system, EnergySystem) and any(link.degree > 2 for link in system.links),
        "passive": isinstance(system, RigidSystem) and bool(system.robot.passive),
        "frames": list(header.frame_lines(system)) if isinstance(system, RigidSystem) else [],
        "functions": list(functions(input_arrays(system), robot, links)),
    }


def costs(functions: Sequence[LinkFormFunctions]) -> dict[str, int]:
    """Return the arithmetic operations of a sample in NAME.h."""
    return {
        "decomposition_cost": cost(own.decomposition for own in functions),
        "torque_cost": cost(own.torque for own in functions),
        "gradient_cost": cost(own.position_gradient for own in functions),
    }


def most_kept(functions: Sequence[LinkFormFunctions]) -> int:
    """Return how many values a function keeps at a time, at most: inputs, and a fourth of its statements."""
    every = (f for own in functions for f in (own.decomposition, own.torque, own.position_gradient))
    return max(len(f.inputs) + len(f.statements) // 4 for f in every)


def input_arrays(system: System) -> tuple[str, ...]:
    """Return the arrays that every function takes."""
    return ("q", "qd", "qdd", "p") if system.parameters else ("q", "qd", "qdd")


def rows_from_s(inputs: Sequence[str]) -> str:
    """Return the arrays from row s on; run-time parameters are the same for all rows."""
    return ", ".join(array if array == "p" else f"{array} + s * N" for array in inputs)


def free(system: System) -> bool:
    """Return whether each joint may have an impedance of its own: nothing ties one to others."""
    if isinstance(system, EnergySystem):
        return not system.constraints
    return not (system.robot.ties or system.robot.couplings)


def totals(size: EntryCounts) -> list[tuple[str, int]]:
    """Return names in C and values of the robot's numbers of entries."""
    return [(total(array), size.of(array)) for array in size.arrays if array != "tau"]
