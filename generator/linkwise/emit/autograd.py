"""Lagrangians as torch modules, one file per link; a rigid link's energies continue those of its parent."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from linkwise_runtime.structure import IMPOSED_MOTION
from linkwise_runtime.version import VERSION

from linkwise.dynamics.link_forms import lowering
from linkwise.emit.printer import PythonPrinter
from linkwise.emit.rigid_energy import rigid_energy
from linkwise.emit.straight_line import fetched, straight_line
from linkwise.escape import python_literal
from linkwise.render import render
from linkwise.symbolic.system import EnergySystem, LinkTerms, System

Lines = tuple[str, ...]


METHODS = {
    "potentials": "Potential energies in J, by share.",
    "motions": "Terms of the Lagrangian in J of degree one or none in the velocities, by share.",
    "dissipations": "Rayleigh's dissipation in W, by share: its slope is what a joint gives.",
    "forces": "Generalised forces in N m or N, by share and coordinate, counted from 0.",
}


@dataclass(frozen=True)
class Method:
    """A method of a link's class that returns what its shares have of one kind."""

    name: str
    lines: Lines

    @property
    def arguments(self) -> str:
        """Arguments before the parameters."""
        return "q: Values" if self.name == "potentials" else "q: Values, qd: Values"

    @property
    def doc(self) -> str:
        """Documentation."""
        return METHODS[self.name]


def autograd_files(system: System, nonquadratic: frozenset[int]) -> Iterator[tuple[str, str]]:
    """Yield paths inside the package and texts."""
    for j, name in enumerate(system.link_names):
        view = {
            "number": j + 1,
            "version": VERSION,
            "name": python_literal(name),
            "path": repr(system.path(j)),
        }
        if isinstance(system, EnergySystem):
            text = _written(system, j, view, j in nonquadratic)
        else:
            text = render("energies/rigid_link.py.j2", view | {"energy": rigid_energy(system, j)})
        yield f"energies/link_{j + 1}.py", text
    rigid = not isinstance(system, EnergySystem)
    init = {"version": VERSION, "numbers": range(1, len(system.links) + 1), "rigid": rigid}
    yield "energies/__init__.py", render("energies/init.py.j2", init)


def _written(system: EnergySystem, link: int, view: dict[str, object], uneven: bool) -> str:
    """Return the module of a link whose energies a user wrote."""
    terms = system.links[link]
    names = [share.name for share in terms.shares]
    imposed = IMPOSED_MOTION in names and system.time is not None and terms.kinetic.has(system.time)
    attributes = {
        "degree": terms.degree if terms.degree > 2 else None,
        "imposed": IMPOSED_MOTION if imposed else None,
        "uneven": uneven or None,
        "time": system.time.name if system.time is not None and system.time in terms.symbols() else None,
    }
    kinetic, methods = _body(system, terms.kinetic), tuple(_methods(system, terms))
    lines = [*kinetic, *(line for method in methods for line in method.lines)]
    own = {
        "shares": f"({', '.join(map(python_literal, names))}{',' if len(names) == 1 else ''})",
        "attributes": [(what, _literal(value)) for what, value in attributes.items() if value is not None],
        "kinetic": kinetic,
        "methods": methods,
        "uses_torch": any("torch." in line for line in lines),
    }
    return render("energies/link.py.j2", view | own)


def _methods(system: EnergySystem, terms: LinkTerms) -> Iterator[Method]:
    """Yield the methods of what a link's shares have."""
    kinds = {
        "potentials": [(share.name, share.potential) for share in terms.shares],
        "motions": [(share.name, share.motion) for share in terms.shares],
        "dissipations": [(share.name, share.dissipation) for share in terms.shares],
    }
    for name, found in kinds.items():
        there = [(share, expr) for share, expr in found if expr != 0]
        if there:
            code, lines = _lines(system, [expr for _, expr in there])
            entries = [
                f"{python_literal(share)}: {text}," for (share, _), text in zip(there, code, strict=True)
            ]
            yield Method(name, (*lines, "return {", *(f"    {entry}" for entry in entries), "}"))
    forces = [(share.name, share.forces) for share in terms.shares if share.forces]
    if forces:
        code, lines = _lines(system, [expr for _, by_joint in forces for expr in by_joint.values()])
        texts, entries = iter(code), []
        for share, by_joint in forces:
            of_joints = ", ".join(f"{i}: {next(texts)}" for i in by_joint)
            entries.append(f"    {python_literal(share)}: {{{of_joints}}},")
        yield Method("forces", (*lines, "return {", *entries, "}"))


def _literal(value: object) -> str:
    return python_literal(value) if isinstance(value, str) else repr(value)


def _body(system: EnergySystem, expr: object) -> Lines:
    """Return the lines of a function that returns the value of an expression."""
    (text,), lines = _lines(system, [expr])
    return (*lines, f"return {text}")


def _lines(system: EnergySystem, exprs: Sequence[Any]) -> tuple[tuple[str, ...], Lines]:
    """Return texts of expressions, and the lines that compute what they have in common."""
    lower = lowering(system)[0]
    code = straight_line(lower.graph, [lower(expr) for expr in exprs], PythonPrinter("torch"))
    assigned = (f"{name} = {text}" for name, text in code.assignments)
    return code.outputs, (*fetched(system, code), *assigned)
