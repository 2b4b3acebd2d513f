"""Closed forms as Python functions over arrays of a namespace `xp`, NumPy or torch, one file a link."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from linkwise.dynamics.kernel import Kernel
from linkwise.emit.energies import fetched
from linkwise.emit.printer import PythonPrinter
from linkwise.emit.render import render
from linkwise.emit.straight_line import straight_line
from linkwise.expression.graph import Node
from linkwise.symbolic.system import System
from linkwise.version import VERSION


@dataclass(frozen=True)
class FormFunction:
    """One emitted function; each group of outputs is returned as a tuple."""

    name: str
    doc: str
    inputs: tuple[str, ...]
    assignments: tuple[tuple[str, str], ...]
    groups: tuple[str, ...]


def closed_form_files(system: System, kernels: Sequence[Kernel]) -> Iterator[tuple[str, str]]:
    """Paths inside the package and texts."""
    for j, kernel in enumerate(kernels):
        view = {
            "number": j + 1,
            "version": VERSION,
            "name": ascii(system.links[j].name),
            "path": repr(kernel.forms[0].path),
            "functions": list(_functions(system, kernel, PythonPrinter("xp"))),
        }
        yield f"forms/link_{j + 1}.py", render("closed_forms/link.py.j2", view)
    numbers = range(1, len(kernels) + 1)
    init = {"version": VERSION, "numbers": numbers}
    yield "forms/__init__.py", render("closed_forms/init.py.j2", init)


def _functions(system: System, kernel: Kernel, printer: PythonPrinter) -> Iterator[FormFunction]:
    forms = kernel.forms[0]
    linear = forms.linear_block(kernel.graph.zero)
    groups: Mapping[str, tuple[str, list[Sequence[Node]]]] = {
        "decomposition": (
            "c2_ik for i <= k, c1_ik, g_i, tau_i"
            + (", and h1_ik, the part of c1 linear in qd." if linear else "."),
            [
                list(forms.acceleration.values()),
                list(forms.velocity.values()),
                list(forms.gravity.values()),
                list(forms.torque.values()),
                *([linear] if linear else []),
            ],
        ),
        "torque": ("tau_i.", [list(forms.torque.values())]),
        "position_gradient": (
            "c0_ik = d(tau_i)/d(q_k).",
            [list(forms.position_gradient.values())],
        ),
    }
    for name, (doc, outputs) in groups.items():
        code = straight_line(kernel.graph, [node for group in outputs for node in group], printer)
        texts = iter(code.outputs)
        packed = tuple(_tuple([next(texts) for _ in group]) for group in outputs)
        yield FormFunction(name, doc, fetched(system, code, "[..., {}]"), code.assignments, packed)


def _tuple(texts: Sequence[str]) -> str:
    """Tuple display, one entry a line where it is long."""
    if len(texts) == 0:
        return "()"
    if sum(map(len, texts)) < 60:
        return f"({', '.join(texts)},)"
    return "(\n" + "".join(f"            {text},\n" for text in texts) + "        )"
