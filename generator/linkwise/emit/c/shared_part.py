"""The kernel in which links share work: what several need is computed once, by a function of its own."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from linkwise.dynamics.kernel import Kernel
from linkwise.emit.c.kernel_function import (
    KernelFunction,
    Output,
    decomposition_outputs,
    kernel_function,
    symbols,
    turned,
)
from linkwise.expression.graph import Node, operands, reachable
from linkwise.symbolic.system import System

SHARED_FILE = "links_together.h"
"""Name of the file; it is there only where links share work."""


@dataclass(frozen=True)
class SharedWork:
    """The function of the shared part, those of each link's rest, how many values they share, their frame."""

    part: KernelFunction
    rests: tuple[KernelFunction, ...]
    values: int
    frame: tuple[str, ...]


def shared_work(system: System, kernel: Kernel) -> SharedWork:
    """Functions of the kernel of all links."""
    given = turned(kernel)
    outputs = [list(forms.decomposition()) for forms in kernel.forms]
    shared = _shared(kernel, outputs, given)
    names = _names(kernel, shared, symbols(system))
    values = [Output("shared", entry, name, node) for entry, (node, name) in enumerate(names.items())]
    part = kernel_function(system, kernel, "shared_part", "What several links need", values)
    rests = tuple(
        kernel_function(
            system,
            kernel,
            f"link_{number}_rest",
            f"Decomposition of link {number} from the shared part on",
            decomposition_outputs(kernel, forms, number),
            names,
        )
        for number, forms in enumerate(kernel.forms, 1)
    )
    return SharedWork(part, rests, len(shared), kernel.frame)


def _names(kernel: Kernel, shared: Sequence[Node], taken: Iterable[str]) -> dict[Node, str]:
    """Name each shared value as the graph suggests, or shared_30, by its place, where the graph does not."""
    names: dict[Node, str] = {}
    used = {*taken, *(f"shared_{place}" for place in range(len(shared)))}
    for place, node in enumerate(shared):
        suggested = kernel.graph.names.get(node)
        names[node] = f"shared_{place}" if suggested is None or suggested in used else suggested
        used.add(names[node])
    return names


def _shared(kernel: Kernel, outputs: list[list[Node]], given: dict[Node, str]) -> list[Node]:
    """Values that at least two links need, and that something outside the shared part uses directly."""
    nodes = kernel.graph.nodes
    needs = [set(reachable(kernel.graph, group, given)) for group in outputs]
    times = Counter(node for need in needs for node in need)
    common = {
        node
        for node, count in times.items()
        if count > 1 and node not in given and nodes[node][0] not in ("const", "symbol", "neg")
    }
    used = {o for node in times if node not in common and node not in given for o in operands(nodes[node])}
    used |= {node for group in outputs for node in group}
    return sorted(common & used)
