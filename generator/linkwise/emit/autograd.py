"""Lagrangians as torch modules, one file per link; a rigid link's energies continue those of its parent."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import sympy as sp

from linkwise.dynamics.kernel import lowering
from linkwise.emit.printer import PythonPrinter
from linkwise.emit.render import render
from linkwise.emit.straight_line import fetched, straight_line
from linkwise.escape import python_literal
from linkwise.symbolic.link_energy import Steps, StepwiseEnergy, exact, link_energies
from linkwise.symbolic.system import EnergySystem, RigidSystem, System
from linkwise.version import VERSION


@dataclass(frozen=True)
class EnergyFunction:
    """One emitted function: its signature, the lines that fetch its inputs, its code and its result."""

    name: str
    arguments: str
    doc: str
    inputs: tuple[str, ...]
    assignments: tuple[tuple[str, str], ...]
    result: str

    @property
    def signature(self) -> str:
        """The arguments with their types."""
        types = {"q": "Values", "qd": "Values", "p": "Parameters"}
        return ", ".join(f"{name}: {types[name]}" for name in self.arguments.split(", "))

    @property
    def carried(self) -> bool:
        """Whether it says how the link's frame moves, on which the links further out depend too."""
        return self.name in ("twist", "height")

    @property
    def calls_torch(self) -> bool:
        """Whether a line of it needs torch."""
        return any("torch." in text for text in (self.result, *(text for _, text in self.assignments)))


def autograd_files(system: System, linear: frozenset[int]) -> Iterator[tuple[str, str]]:
    """Paths inside the package and texts."""
    energies = link_energies(system)
    for j, energy in enumerate(energies):
        functions = _functions(system, energies, j)
        view = {
            "number": j + 1,
            "version": VERSION,
            "twist": not isinstance(system, EnergySystem),
            "uses_torch": any(function.calls_torch for function in functions),
            "parent": None if energy.parent is None else energy.parent + 1,
            "name": python_literal(energy.name),
            "functions": functions,
            "path": repr(system.path(j)),
            "linear": j in linear,
        }
        yield f"energies/link_{j + 1}.py", render("energies/link.py.j2", view)
    init = {"version": VERSION, "numbers": range(1, len(system.links) + 1)}
    yield "energies/__init__.py", render("energies/init.py.j2", init)


def _functions(system: System, energies: Sequence[StepwiseEnergy], link: int) -> list[EnergyFunction]:
    """Functions twist, height, kinetic and potential of a link; hand-written energies have the last two."""
    energy = energies[link]
    potential = _energy(system, energy.potential, "potential", "q, p", "height", energy.height.exports)
    if isinstance(system, EnergySystem):
        return [_energy(system, energy.kinetic, "kinetic", "q, qd, p", "twist", ()), potential]
    parent = None if energy.parent is None else energies[energy.parent]
    before = (Steps(), Steps()) if parent is None else (parent.twist, parent.height)
    call = f"link_{(energy.parent or 0) + 1}"
    return [
        _state(
            system,
            "twist",
            "q, qd, p",
            (before[0], f"{call}.twist(q, qd, p)"),
            energy.twist,
            "Velocity of the link's frame",
        ),
        _state(
            system,
            "height",
            "q, p",
            (before[1], f"{call}.height(q, p)"),
            energy.height,
            "Gravity seen from the link's frame",
        ),
        _kinetic(system, link, energy),
        potential,
    ]


def _state(
    system: System, name: str, arguments: str, before: tuple[Steps, str], steps: Steps, doc: str
) -> EnergyFunction:
    """Function of what is carried along the chain; `before` is the parent's, and the call that gives it."""
    given, call = before
    lower = lowering(system)[0]
    lower.symbols |= {symbol: lower.graph.symbol(symbol.name) for symbol in given.exports}
    lower.define(steps.definitions)
    code = straight_line(
        lower.graph, [lower.symbols[symbol] for symbol in steps.exports], PythonPrinter("torch")
    )
    what = ", ".join(symbol.name for symbol in steps.exports) or "nothing but numbers"
    used = [symbol.name in code.symbols for symbol in given.exports]
    inputs = (*_unpacked(given.exports, call, used), *fetched(system, code))
    result = f"({', '.join(code.outputs)}{',' if len(code.outputs) == 1 else ''})"
    return EnergyFunction(name, arguments, f"{doc}: {what}.", inputs, code.assignments, result)


def _energy(
    system: System, expr: sp.Expr, name: str, arguments: str, state: str, exports: Sequence[sp.Symbol]
) -> EnergyFunction:
    lower = lowering(system)[0]
    lower.symbols |= {symbol: lower.graph.symbol(symbol.name) for symbol in exports}
    code = straight_line(lower.graph, [lower(expr)], PythonPrinter("torch"))
    used = [symbol.name in code.symbols for symbol in exports]
    inputs = (*_unpacked(exports, f"{state}({arguments})", used), *fetched(system, code))
    doc = f"{name.capitalize()} energy in J."
    return EnergyFunction(name, arguments, doc, inputs, code.assignments, code.outputs[0])


def _kinetic(system: RigidSystem, link: int, energy: StepwiseEnergy) -> EnergyFunction:
    """Kinetic energy of a rigid body, from what it weighs and how its frame moves."""
    body = system.links[link]
    lower = lowering(system)[0]
    rows = ((body.mass, 0, 0), body.com, *body.inertia)
    scalars = [lower(entry) for row in rows for entry in exact(row)]
    code = straight_line(lower.graph, scalars, PythonPrinter("torch"))
    mass, _, _, *numbers = code.outputs
    com, *inertia = (f"({', '.join(numbers[at : at + 3])})" for at in (0, 3, 6, 9))
    names = {symbol.name for symbol in energy.twist.exports}
    parts = (f"{part}{link + 1}_{axis}" for part in "wv" for axis in "xyz")
    speeds = [name if name in names else "0.0" for name in parts]
    lines = (
        "kinetic_energy(",
        f"    ({', '.join(speeds[:3])}),",
        f"    ({', '.join(speeds[3:])}),",
        f"    mass={mass},",
        f"    com={com},",
        "    inertia=(",
        *(f"        {row}," for row in inertia),
        "    ),",
        ")",
    )
    inputs = (*_unpacked(energy.twist.exports, "twist(q, qd, p)"), *fetched(system, code))
    doc = "Kinetic energy in J."
    return EnergyFunction("kinetic", "q, qd, p", doc, inputs, code.assignments, "\n    ".join(lines))


def _unpacked(symbols: Sequence[sp.Symbol], call: str, used: Sequence[bool] = ()) -> tuple[str, ...]:
    """Return the line that takes over another function's results, those that are `used`, or all of them."""
    if not symbols or (used and not any(used)):
        return ()
    kept = used or [True] * len(symbols)
    names = ", ".join(symbol.name if keep else "_" for symbol, keep in zip(symbols, kept, strict=True))
    return (f"({names},) = {call}" if len(symbols) == 1 else f"{names} = {call}",)
