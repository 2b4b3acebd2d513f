"""The energies of a link as Python functions that continue those of its parent."""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from linkwise.dynamics.kernel import lowering, parameter_names
from linkwise.emit.printer import PythonPrinter
from linkwise.emit.straight_line import Code, straight_line
from linkwise.expression.from_sympy import Lowering
from linkwise.symbolic.system import LinkEnergy, Steps, System


@dataclass(frozen=True)
class Function:
    """One emitted function: its signature, the lines that fetch its inputs, its code and its result."""

    name: str
    arguments: str
    doc: str
    inherited: tuple[str, ...]
    code: Code
    result: str

    @property
    def signature(self) -> str:
        """The arguments with their types."""
        types = {"q": "Values", "qd": "Values", "p": "Parameters"}
        return ", ".join(f"{name}: {types[name]}" for name in self.arguments.split(", "))


def energy_functions(system: System, link: int) -> tuple[Function, ...]:
    """Functions twist, height, kinetic and potential of a link; the first two for a rigid link only."""
    energy = system.links[link]
    functions = []
    if energy.body is not None:
        functions = [
            _state(system, energy, "twist", "q, qd, p", energy.twist, "Velocity of the link's frame"),
            _state(
                system,
                energy,
                "height",
                "q, p",
                energy.height,
                "Gravity seen from the link's frame",
            ),
        ]
    kinetic = _energy(system, energy.kinetic, "kinetic", "q, qd, p", "twist", energy.twist.exports)
    potential = _energy(system, energy.potential, "potential", "q, p", "height", energy.height.exports)
    return (*functions, kinetic, potential)


def _state(system: System, energy: LinkEnergy, name: str, arguments: str, steps: Steps, doc: str) -> Function:
    lower = _lowering(system)
    before: Sequence[sp.Symbol] = ()
    if energy.parent is not None:
        before = getattr(system.links[energy.parent], name).exports
    lower.symbols |= {symbol: lower.graph.symbol(symbol.name) for symbol in before}
    lower.define(steps.definitions)
    outputs = [lower.symbols[symbol] for symbol in steps.exports]
    code = straight_line(lower.graph, outputs, PythonPrinter("torch"))
    call = f"link_{(energy.parent or 0) + 1}.{name}({arguments})"
    what = ", ".join(symbol.name for symbol in steps.exports)
    return Function(
        name,
        arguments,
        f"{doc}: {what or 'nothing but numbers'}.",
        (*_unpacked(before, call, code), *fetched(system, code)),
        code,
        _tuple(code.outputs),
    )


def _energy(
    system: System,
    expr: sp.Expr,
    name: str,
    arguments: str,
    state: str,
    exports: Sequence[sp.Symbol],
) -> Function:
    lower = _lowering(system)
    lower.symbols |= {symbol: lower.graph.symbol(symbol.name) for symbol in exports}
    code = straight_line(lower.graph, [lower(expr)], PythonPrinter("torch"))
    lines = (*_unpacked(exports, f"{state}({arguments})", code), *fetched(system, code))
    return Function(name, arguments, f"{name.capitalize()} energy in J.", lines, code, code.outputs[0])


def _lowering(system: System) -> Lowering:
    return lowering(system)[0]


def _unpacked(symbols: Sequence[sp.Symbol], call: str, code: Code) -> tuple[str, ...]:
    """Return the line that takes over another function's results, if any is used."""
    if not any(symbol.name in code.symbols for symbol in symbols):
        return ()
    names = ", ".join(symbol.name if symbol.name in code.symbols else "_" for symbol in symbols)
    return (f"{names}{',' if len(symbols) == 1 else ''} = {call}",)


def fetched(system: System, code: Code, subscript: str = "[{}]") -> tuple[str, ...]:
    """Lines that take coordinates, velocities and parameters out of q, qd, qdd and p."""
    lines = []
    for prefix in ("q", "qd", "qdd"):
        used = [k for k in range(len(system.coordinates)) if f"{prefix}{k + 1}" in code.symbols]
        lines += [f"{prefix}{k + 1} = {prefix}{subscript.format(k)}" for k in used]
    for symbol, name in parameter_names(system).items():
        if name in code.symbols:
            lines.append(f"{name} = p[{symbol.name!a}]")
    return tuple(lines)


def _tuple(texts: Sequence[str]) -> str:
    return f"({texts[0]},)" if len(texts) == 1 else f"({', '.join(texts)})"
