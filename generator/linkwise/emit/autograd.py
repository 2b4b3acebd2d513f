"""Lagrangians as torch modules, one file a link."""

from collections.abc import Iterator

from linkwise.emit.energies import Function, energy_functions
from linkwise.emit.render import render
from linkwise.symbolic.system import System
from linkwise.version import VERSION


def autograd_files(system: System, linear: frozenset[int]) -> Iterator[tuple[str, str]]:
    """Paths inside the package and texts."""
    for j, energy in enumerate(system.links):
        functions = energy_functions(system, j)
        view = {
            "number": j + 1,
            "version": VERSION,
            "twist": energy.body is not None,
            "uses_torch": any(_calls(function) for function in functions),
            "parent": None if energy.parent is None else energy.parent + 1,
            "name": ascii(energy.name),
            "functions": functions,
            "path": repr(system.path(j)),
            "linear": j in linear,
        }
        yield f"energies/link_{j + 1}.py", render("energies/link.py.j2", view)
    init = {"version": VERSION, "numbers": range(1, len(system.links) + 1)}
    yield "energies/__init__.py", render("energies/init.py.j2", init)


def _calls(function: Function) -> bool:
    """Whether the function's code calls torch."""
    return any("torch." in text for _, text in function.code.assignments) or any(
        "torch." in text for text in function.code.outputs
    )
