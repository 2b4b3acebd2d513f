"""One C function over a block of samples, from the nodes that it computes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from linkwise.dynamics.coefficients import LinkForms
from linkwise.dynamics.kernel import Kernel, parameter_names
from linkwise.emit.printer import CPrinter
from linkwise.emit.straight_line import Code, straight_line
from linkwise.expression.graph import Node
from linkwise.symbolic.system import System


@dataclass(frozen=True)
class KernelFunction:
    """One C function over a block: the lines that fetch its inputs, and those that compute and store.

    With `shares` it also takes x, what the shared part of a fused kernel has computed.
    """

    name: str
    arrays: tuple[str, ...]
    inputs: tuple[tuple[str, str], ...]
    statements: tuple[str, ...]
    unused: tuple[str, ...]
    shares: bool

    @property
    def parameters(self) -> str:
        """Declarations of the output arrays."""
        return ", ".join(f"real *restrict {array}" for array in self.arrays)


def turned(kernel: Kernel) -> dict[Node, str]:
    """Names of the sines and cosines of the coordinates, which kernels are given."""
    g = kernel.graph
    return {g.call(f, q): f"{f[0]}{k + 1}" for k, q in enumerate(kernel.inputs.q) for f in ("sin", "cos")}


def decomposition_groups(kernel: Kernel, forms: LinkForms) -> dict[str, list[Node]]:
    """Outputs of the full decomposition, by the array that they go to."""
    return {
        "acceleration": list(forms.acceleration.values()),
        "velocity": list(forms.velocity.values()),
        "gravity": list(forms.gravity.values()),
        "torque": list(forms.torque.values()),
        "linear": forms.linear_block(kernel.graph.zero),
    }


def kernel_function(
    system: System,
    kernel: Kernel,
    name: str,
    groups: dict[str, list[Node]],
    shared: Mapping[Node, str] | None = None,
) -> KernelFunction:
    """C function whose output arrays are `groups`; sines, cosines and what is `shared` are inputs."""
    nodes = [node for group in groups.values() for node in group]
    given = turned(kernel) | dict(shared or {})
    code = straight_line(kernel.graph, nodes, CPrinter(), given)
    sources = {
        f"{prefix}{k + 1}": f"{array}[{k} * W + b]"
        for prefix, array in (
            ("q", "q"),
            ("qd", "qd"),
            ("qdd", "qdd"),
            ("s", "sine"),
            ("c", "cosine"),
        )
        for k in range(len(system.coordinates))
    }
    # By name: where a parameter stands depends on the robot, and a link's file must not.
    sources |= {name: f"p[at_{name}]" for name in parameter_names(system).values()}
    sources |= {name: f"x[{at} * W + b]" for at, name in enumerate((shared or {}).values())}
    inputs = tuple((symbol, source) for symbol, source in sources.items() if symbol in code.symbols)
    places = [(array, at) for array, group in groups.items() for at in range(len(group))]
    used = {source.split("[")[0] for _, source in inputs}
    arrays = ["q", "qd", "qdd", "sine", "cosine", "p", *(["x"] if shared is not None else [])]
    unused = [a for a in arrays if a not in used]
    unused += [array for array, group in groups.items() if not group]
    statements = tuple(_statements(code, places))
    return KernelFunction(name, tuple(groups), inputs, statements, tuple(unused), shared is not None)


def _statements(code: Code, places: Sequence[tuple[str, int]]) -> Iterator[str]:
    """Assignments, and each output stored as soon as it can be: fewer values are then alive at a time."""
    waiting: dict[int, list[str]] = {}
    for (array, at), text, ready in zip(places, code.outputs, code.ready, strict=True):
        waiting.setdefault(ready, []).append(f"{array}[{at} * W + b] = {text};")
    yield from waiting.get(0, ())
    for number, (variable, text) in enumerate(code.assignments, 1):
        yield f"const real {variable} = {text};"
        yield from waiting.get(number, ())
