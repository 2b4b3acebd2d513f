"""Closed forms as Python functions over an array namespace, NumPy or torch, one file per link."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from linkwise_runtime.version import VERSION

from linkwise.dynamics.link_forms import LinkForms
from linkwise.emit.legend import names_told
from linkwise.emit.printer import PythonPrinter
from linkwise.emit.straight_line import fetched, straight_line
from linkwise.escape import python_literal
from linkwise.expression.count import count_operations, in_words
from linkwise.expression.expression_graph import Graph, Node
from linkwise.render import render
from linkwise.symbolic.system import System

Rows = Sequence[tuple[str, Node]]
"""Labels of outputs, such as c2(1, 3, 2) for joint, link and coordinate, and their nodes."""

MOTION = ("q", "qd", "qdd")


@dataclass(frozen=True)
class FormFunction:
    """An emitted function; each group of its results is a tuple of (expression, label)."""

    name: str
    arguments: str
    """Motion that it is given, as its signature has it."""
    doc: str
    cost: str
    operations: int
    """Number of all operations, sines and the like included."""
    inputs: tuple[str, ...]
    assignments: tuple[tuple[str, str], ...]
    groups: tuple[tuple[tuple[str, str], ...], ...]


def closed_form_files(system: System, links: Sequence[LinkForms]) -> Iterator[tuple[str, str]]:
    """Yield paths inside the package and texts."""
    for j, forms in enumerate(links):
        functions = list(_functions(system, forms, j + 1))
        view = {
            "number": j + 1,
            "version": VERSION,
            "name": python_literal(system.link_names[j]),
            "path": repr(forms.path),
            "frame": forms.frame,
            "operations": [(one.name, one.operations) for one in functions],
            "functions": functions_text(functions),
        }
        yield f"forms/link_{j + 1}.py", render("closed_forms/link.py.j2", view)
    numbers = range(1, len(links) + 1)
    legend = names_told(any(forms.frame for forms in links))
    view = {"version": VERSION, "numbers": numbers, "legend": legend}
    yield "forms/__init__.py", render("closed_forms/init.py.j2", view)


def functions_text(functions: Sequence[FormFunction]) -> str:
    """Return the text of functions, one below the other."""
    return render("closed_forms/functions.py.j2", {"functions": functions})


def _functions(system: System, forms: LinkForms, j: int) -> Iterator[FormFunction]:
    groups = labelled(forms, j)
    whole = [groups[name] for name in ("c2", "c1", "g", "tau", "h1") if groups[name]]
    doc = "Return c2 (for i <= k: it is symmetric), c1, g and tau"
    if groups["h1"]:
        doc += ", and h1 = 2 c1 - d(tau)/d(qd)"
    yield form_function(system, forms.graph, "decomposition", doc, whole)
    yield form_function(system, forms.graph, "torque", "Return tau", [groups["torque"]])
    yield form_function(system, forms.graph, "position_gradient", "Return c0 = d(tau)/d(q)", [groups["c0"]])
    if forms.energy:
        energies = [(f"{'KPR'[at]}({j})", node) for at, node in forms.energy.items()]
        doc = "Return kinetic energy K and potential energy P in J, and R in W: d(K + P)/dt = tau . qd + R"
        yield form_function(system, forms.graph, "energy", doc, [energies], MOTION[:2])
        shares = [(f"{name}, {i + 1}", node) for (i, name), node in forms.shares.items()]
        doc = "Return the shares with names of their own, which sum to g, name by name"
        yield form_function(system, forms.graph, "named_shares", doc, [shares], MOTION[:2])


def labelled(forms: LinkForms, j: int) -> dict[str, Rows]:
    """Return the outputs of link j, counted from 1, by quantity; h1 is empty without linear energy terms."""

    def triples(name: str, nodes: dict[tuple[int, int], Node]) -> Rows:
        return [(f"{name}({i + 1}, {j}, {k + 1})", node) for (i, k), node in nodes.items()]

    def pairs(name: str, nodes: dict[int, Node]) -> Rows:
        return [(f"{name}({i + 1}, {j})", node) for i, node in nodes.items()]

    return {
        "c2": triples("c2", forms.acceleration),
        "c1": triples("c1", forms.velocity),
        "g": pairs("g", forms.gravity),
        "tau": pairs("tau", forms.decomposed_torque),
        "torque": pairs("tau", forms.torque),
        "h1": triples("h1", forms.velocity_excess),
        "c0": triples("c0", forms.position_gradient),
    }


def form_function(
    system: System,
    graph: Graph,
    name: str,
    doc: str,
    groups: Sequence[Rows],
    motion: Sequence[str] = MOTION,
) -> FormFunction:
    """Return a function of the motion, in groups of results."""
    nodes = [node for rows in groups for _, node in rows]
    code = straight_line(graph, nodes, PythonPrinter("xp"))
    cost = count_operations(graph, nodes)
    texts = iter(code.outputs)
    results = tuple(tuple((next(texts), label) for label, _ in rows) for rows in groups)
    inputs = fetched(system, code, "[..., {}]")
    operations = cost.arithmetic + cost.functions
    arguments = ", ".join(f"{one}: Any" for one in motion)
    return FormFunction(name, arguments, doc, in_words(cost), operations, inputs, code.assignments, results)
