"""The counts of a graph, in a few lines."""

from collections.abc import Iterator, Mapping
from typing import Any

from linkwise.graphs.overlay import Overlay, part_label


def graph_summary(graph: Overlay, whole: Any, elsewhere: Mapping[str, int]) -> Iterator[str]:
    """Yield lines of plain text.

    whole: graph of the torque itself, differentiated as it is defined and not split into parts
    elsewhere: operations that the other links' torques on this joint need too, by link
    """
    yield (
        f"{graph.torque} of {graph.robot}: joint {graph.joints[graph.joint]} through {', '.join(graph.links)}"
    )
    yield f"{'part':<16} {'operations':>10} {'its own':>8}  operations by name"
    for number, part in enumerate(graph.parts):
        names = ", ".join(f"{count} {name}" for name, count in part.counts().items())
        label = part_label(graph, number)
        yield f"{label:<16} {len(part.operations):>10} {graph.own(number):>8}  {names}"
    if len(graph.parts) > 1:
        yield f"{'all parts':<16} {graph.operations:>10}"
    yield f"{f'{graph.torque} unsplit':<16} {len(whole.operations):>10}"
    for name, count in elsewhere.items():
        yield f"{count} of these operations are in the torque through {name} too"
