"""Torch's own graph of a torque, as text for Graphviz and as JSON: every node that torch recorded."""

from typing import Any

from linkwise.escape import printable

SHORT = "Backward"


def recorded_dot(graph: Any) -> str:
    """Return the graph as text for Graphviz, from the motions on the left to the torque on the right."""
    lines = [
        "digraph recorded {",
        "  rankdir=LR; nodesep=0.08; ranksep=0.3; bgcolor=white;",
        '  node [shape=box, style="filled,rounded", fillcolor="#eef2f7", color="#9aa7b8", height=0.25,'
        ' fontname="Helvetica", fontsize=10, margin="0.06,0.03"];',
        '  edge [color="#9aa7b8", arrowsize=0.5];',
        f"  labelloc=t; label={_quoted(f'{graph.title}: {len(graph)} nodes, as torch recorded them')};",
    ]
    for at, node in enumerate(graph.nodes):
        name, colour = (node.leaf, ', fillcolor="#ffd9a8"') if node.leaf else (node.name.split(SHORT)[0], "")
        if at == len(graph) - 1:
            colour = ', fillcolor="#bfe3c0"'
        lines.append(f"  n{at} [label={_quoted(name)}, tooltip={_quoted(node.name)}{colour}];")
    lines += [f"  n{a} -> n{at};" for at, node in enumerate(graph.nodes) for a in node.operands]
    return "\n".join([*lines, "}", ""])


def recorded_json(graph: Any) -> dict[str, Any]:
    """Return the graph as JSON values, in the node-link format that networkx and D3 read."""
    return {
        "directed": True,
        "multigraph": True,
        "graph": {"title": graph.title},
        "nodes": [
            {"id": at, "name": node.name, **({"leaf": node.leaf} if node.leaf else {})}
            for at, node in enumerate(graph.nodes)
        ],
        "edges": [
            {"source": a, "target": at, "position": place}
            for at, node in enumerate(graph.nodes)
            for place, a in enumerate(node.operands)
        ],
    }


def _quoted(text: str) -> str:
    escaped = printable(text).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
