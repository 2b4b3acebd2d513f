"""Lagrangians as torch modules, one file per link; a rigid link's energies continue those of its parent."""

from collections.abc import Iterator

from linkwise_runtime.version import VERSION

from linkwise.dynamics.link_forms import lowering
from linkwise.emit.printer import PythonPrinter
from linkwise.emit.rigid_energy import rigid_energy
from linkwise.emit.straight_line import fetched, straight_line
from linkwise.escape import python_literal
from linkwise.render import render
from linkwise.symbolic.system import EnergySystem, System

Lines = tuple[str, ...]


def autograd_files(system: System, linear: frozenset[int]) -> Iterator[tuple[str, str]]:
    """Yield paths inside the package and texts."""
    for j, name in enumerate(system.link_names):
        view = {
            "number": j + 1,
            "version": VERSION,
            "name": python_literal(name),
            "path": repr(system.path(j)),
            "linear": j in linear,
        }
        if isinstance(system, EnergySystem):
            yield f"energies/link_{j + 1}.py", _written(system, j, view)
        else:
            energy = rigid_energy(system, j)
            text = render("energies/rigid_link.py.j2", view | {"energy": energy})
            yield f"energies/link_{j + 1}.py", text
    rigid = not isinstance(system, EnergySystem)
    init = {"version": VERSION, "numbers": range(1, len(system.links) + 1), "rigid": rigid}
    yield "energies/__init__.py", render("energies/init.py.j2", init)


def _written(system: EnergySystem, link: int, view: dict[str, object]) -> str:
    """Return the module of a link whose energies a user wrote."""
    energy = system.links[link]
    bodies = {"kinetic": _body(system, energy.kinetic), "potential": _body(system, energy.potential)}
    uses_torch = any("torch." in line for body in bodies.values() for line in body)
    return render("energies/link.py.j2", view | bodies | {"uses_torch": uses_torch})


def _body(system: EnergySystem, expr: object) -> Lines:
    """Return the lines of a function that returns the value of an expression."""
    lower = lowering(system)[0]
    code = straight_line(lower.graph, [lower(expr)], PythonPrinter("torch"))
    assigned = (f"{name} = {text}" for name, text in code.assignments)
    return (*fetched(system, code), *assigned, f"return {code.outputs[0]}")
