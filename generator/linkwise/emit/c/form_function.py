"""Closed forms as a C function over W samples, from the nodes that it computes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from linkwise.dynamics.link_forms import LinkForms, parameter_names
from linkwise.emit.printer import CPrinter
from linkwise.emit.straight_line import Code, straight_line
from linkwise.expression.count import count_operations
from linkwise.expression.expression_graph import Node
from linkwise.symbolic.system import System

READS = ("q", "qd", "qdd", "sine", "cosine", "p")
"""Arrays that a function may read, in the order of its parameters."""


@dataclass(frozen=True)
class Output:
    """A value to be stored: its array, its entry there, and its label."""

    array: str
    entry: int
    label: str
    node: Node


@dataclass(frozen=True)
class CFormFunction:
    """One C function over W samples: the lines that fetch its inputs, and those that compute and store.

    It takes the arrays that it reads and those that it writes, and no others. `arithmetic` is its number of
    additions, multiplications and divisions for each sample.
    """

    name: str
    what: str
    cost: str
    arithmetic: int
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    inputs: tuple[tuple[str, str], ...]
    statements: tuple[str, ...]

    @property
    def parameters(self) -> str:
        """Declarations of its parameters."""
        reads = [f"const real *RESTRICT {array}" for array in self.reads]
        writes = [f"real *RESTRICT {array}" for array in self.writes]
        return ",\n    ".join(filter(None, (", ".join(reads), ", ".join(writes))))


def sine_cosine_names(forms: LinkForms) -> dict[Node, str]:
    """Return the names of the sines and cosines of the coordinates, which functions are given."""
    return {q.call(f).node: f"{f}{k + 1}" for k, q in enumerate(forms.inputs.q) for f in ("sin", "cos")}


def decomposition_outputs(forms: LinkForms, number: int) -> list[Output]:
    """Return the outputs of the full decomposition of link `number`."""
    return [
        *outputs("c2", forms.acceleration, number),
        *outputs("c1", forms.velocity, number),
        *outputs("g", forms.gravity, number),
        *outputs("tau", forms.decomposed_torque, number),
        *outputs("h1", forms.velocity_excess, number),
    ]


def outputs(
    array: str, values: Mapping[int, Node] | Mapping[tuple[int, int], Node], number: int
) -> Iterator[Output]:
    """Yield the outputs of one quantity of link `number`.

    Keys are i, or i and k, counted from 0, and labels count from 1.
    """
    for entry, (key, node) in enumerate(values.items()):
        i, *k = key if isinstance(key, tuple) else (key,)
        indices = (i + 1, number, *(x + 1 for x in k))
        yield Output(array, entry, f"{array}({', '.join(map(str, indices))})", node)


def form_function(
    system: System,
    forms: LinkForms,
    name: str,
    what: str,
    results: Sequence[Output],
) -> CFormFunction:
    """Return the C function that stores `results`; sines and cosines are inputs."""
    given = sine_cosine_names(forms)
    nodes = [output.node for output in results]
    code = straight_line(forms.graph, nodes, CPrinter(), given)
    inputs = tuple((symbol, source) for symbol, source in symbols(system).items() if symbol in code.symbols)
    used = {source.split("[")[0] for _, source in inputs}
    sines = sum(source.startswith(("sine", "cosine")) for _, source in inputs)
    count = count_operations(forms.graph, nodes, given)
    kinds = [
        (count.additions + count.multiplications, "additions and multiplications"),
        (count.divisions, "divisions"),
        (count.functions, "functions"),
    ]
    cost = ", ".join(f"{times} {kind}" for times, kind in kinds if times or kind.startswith("add"))
    cost += f", {sines} sines and cosines apart" if sines else ""
    return CFormFunction(
        name,
        what,
        cost,
        count.arithmetic,
        tuple(array for array in READS if array in used),
        tuple(dict.fromkeys(output.array for output in results)),
        inputs,
        tuple(_statements(code, results)),
    )


def symbols(system: System) -> dict[str, str]:
    """Return the source in C of each symbol that a function may use."""
    arrays = {"q": "q", "qd": "qd", "qdd": "qdd", "sin": "sine", "cos": "cosine"}
    sources = {
        f"{prefix}{k + 1}": f"{array}[{k} * W + b]"
        for prefix, array in arrays.items()
        for k in range(len(system.coordinates))
    }
    # By name: a parameter's position depends on the robot, and a link's file must not.
    return sources | {name: f"p[at_{name}]" for name in parameter_names(system).values()}


def _statements(code: Code, results: Sequence[Output]) -> Iterator[str]:
    """Yield assignments, each output stored as soon as it is known: fewer values are then alive at a time."""
    waiting: dict[int, list[str]] = {}
    for output, text, ready in zip(results, code.outputs, code.ready, strict=True):
        place = f"{output.array}[{output.entry} * W + b]"
        waiting.setdefault(ready, []).append(f"{place} = {text}; /* {output.label} */")
    yield from waiting.get(0, ())
    for number, (variable, text) in enumerate(code.assignments, 1):
        yield f"const real {variable} = {text};"
        yield from waiting.get(number, ())
