"""Texts about a package's parameters: their meaning, and the values that no body can have."""

from collections.abc import Sequence
from textwrap import wrap

import numpy as np
import sympy as sp
from linkwise_runtime.parameter_values import faults

from linkwise.emit.printer import PythonPrinter, Text
from linkwise.emit.shared_texts import BodyText
from linkwise.escape import python_docstring, python_literal
from linkwise.expression.expression_graph import Graph, Node, operands, reachable
from linkwise.expression.from_sympy import Lowering
from linkwise.robot.robot import Link, Scalar
from linkwise.symbolic.system import RigidSystem, System

NAMES = (
    "m_LINK is a mass in kg; c_LINK_x a centre of mass in m and I_LINK_xx an inertia about it in kg m^2, "
    "both in the link's own frame as the file has it; p_LINK_x the place of the joint that moves the link, "
    "in m in the frame of its parent in the file. Joints on the ground, whose place moves no torque, have no "
    "p, links with neither mass nor inertia nothing else."
)
FREE = "They are those of the energies: any finite value is taken."
ALLOWED = "Any finite value is taken, also such as no body has: generated with --allow-unphysical."
REFUSED = (
    "Values that no rigid body has are refused unless `allow_unphysical`: a negative mass, a negative "
    "principal moment of inertia, or one above the sum of the others. They are looked at here, not again "
    "when a tensor changes later, and not inside torch.func and torch.compile."
)
EXEMPT = "Free of that, as they break it in the file already: {}."
WIDTH = 108

ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def body_texts(system: System) -> tuple[BodyText, ...]:
    """Return the links whose values are checked: all that depend on parameters and are physical in the file.

    There are none where the robot allows bodies that cannot exist, nor for a user's own energies.
    """
    if not isinstance(system, RigidSystem) or system.robot.allow_unphysical:
        return ()
    links = [link for link in system.robot.links if _parameters(link)]
    return tuple(_text(link) for link in links if not faults(_numbers(link, system.parameters)))


def parameter_rules(system: System, checked: Sequence[BodyText]) -> list[str]:
    """Return lines of a docstring: the meaning of the parameters' names, and which values are refused."""
    if not system.parameters:
        return []
    if not isinstance(system, RigidSystem):
        return [FREE]
    links = [link.name for link in system.robot.links if _parameters(link)]
    kept = {body.link for body in checked}
    exempt = [name for name in links if python_literal(name) not in kept]
    made = any(note.kind == "promoted" for note in system.notes)
    rules = [NAMES] if made else []
    if system.robot.allow_unphysical:
        rules.append(ALLOWED)
    elif links:
        rules += [REFUSED, *([EXEMPT.format(", ".join(map(python_docstring, exempt)))] if exempt else [])]
    return [line for rule in rules for line in wrap(rule, WIDTH)]


def _entries(link: Link) -> tuple[Scalar, ...]:
    return link.mass, *(link.inertia[i][k] for i, k in ENTRIES)


def _parameters(link: Link) -> list[sp.Symbol]:
    """Return a link's parameters in order of appearance."""
    exprs = [entry for entry in _entries(link) if isinstance(entry, sp.Expr)]
    return list(dict.fromkeys(s for e in exprs for s in sorted(e.free_symbols, key=str)))


def _numbers(link: Link, values: dict[sp.Symbol, float]) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    return np.array([float(sp.sympify(entry).xreplace(values)) for entry in _entries(link)])


def _text(link: Link) -> BodyText:
    symbols, graph = _parameters(link), Graph()
    lower = Lowering(graph, {s: graph.symbol(f"p[{python_literal(s.name)}]") for s in symbols})
    names = tuple(python_literal(s.name) for s in symbols)
    values = tuple(_inline(graph, lower(entry)) for entry in _entries(link))
    return BodyText(python_literal(link.name), f"({', '.join(names)},)", values)


def _inline(graph: Graph, output: Node) -> str:
    """Return one expression for a node, whatever parts of it are shared."""
    printer, texts = PythonPrinter("np"), dict[Node, Text]()
    for node in reachable(graph, [output]):
        entry = graph.nodes[node]
        texts[node] = printer.print(entry, tuple(texts[o] for o in operands(entry)))
    return texts[output][0]
