"""A graph as files: a picture by Graphviz, GraphML for graph programs, JSON for one's own."""

import shutil
import subprocess
from collections.abc import Iterable
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.escape import json_text, one_line, printable
from linkwise.extras import extra
from linkwise.graphs.dot_text import dot_text
from linkwise.graphs.folding import folded
from linkwise.graphs.overlay import KINDS, Overlay

FORMATS = ("svg", "png", "dot", "graphml", "json")
MOTIONS = {order: name for name, order in KINDS.items()}


def graph_files(graph: Overlay, formats: Iterable[str], fold: str | None = None) -> dict[str, bytes]:
    """Files by name, in these formats; `fold` is for pictures, None for the least that makes one legible.

    Raises LinkwiseError where a program or a library is missing.
    """
    texts: dict[str, bytes] = {}
    dot = dot_text(graph, folded(graph, fold))
    for kind in formats:
        match kind:
            case "svg" | "png":
                content = _drawn(dot, kind)
            case "dot":
                content = dot.encode()
            case "graphml":
                content = _graphml(graph)
            case "json":
                content = f"{json_text(graph_json(graph), indent=1)}\n".encode()
            case _:
                raise LinkwiseError(f"--format {kind!r} is not there; choose among {', '.join(FORMATS)}")
        texts[f"{file_name(graph)}.{kind}"] = content
    return texts


def file_name(graph: Overlay) -> str:
    """tau_1_2 for τ_1,2; tau_1_2_qdd_1 for a part of it."""
    words = ["tau", str(graph.joint + 1), *([] if graph.link is None else [str(graph.link + 1)])]
    if len(graph.parts) == 1:
        k, order = graph.coordinate(0), graph.parts[0].order
        words += ["gravity"] if k is None else [MOTIONS[order or 0], str(k + 1)]
    return "_".join(words)


def graph_json(graph: Overlay) -> dict[str, Any]:
    """The graph as JSON values: nodes have keys, the same in every graph of the robot; edges join these."""
    return {
        "schema": 1,
        "robot": graph.robot,
        "torque": graph.torque,
        "joint": graph.joints[graph.joint],
        "links": list(graph.links),
        "parts": [
            {
                "coordinate": part.coordinate,
                "order": part.order,
                "output": part.output,
                "operations": len(part.operations),
                "own": graph.own(number),
            }
            for number, part in enumerate(graph.parts)
        ],
        "nodes": [_node(graph, node) for node in graph.nodes.values()],
        "edges": [[a, b] for a, b in _edges(graph)],
    }


def _node(graph: Overlay, node: Any) -> dict[str, Any]:
    shared = {"key": node.key, "shape": list(node.shape), "parts": list(graph.users[node.key])}
    if not hasattr(node, "operands"):
        return shared | {"kind": node.kind, "name": node.name}
    return shared | {
        "kind": "operation",
        "name": node.name,
        "arguments": [_argument(value) for value in node.arguments],
        "source": node.source,
        "derivative": node.derivative,
    }


def _argument(value: Any) -> Any:
    """The key of a value, a number, a list of them, or else the text of what it is."""
    if hasattr(value, "key"):
        return value.key
    if isinstance(value, list | tuple):
        return [_argument(part) for part in value]
    return value if value is None or isinstance(value, bool | int | float) else str(value)


def _edges(graph: Overlay) -> list[tuple[str, str]]:
    return [(a, key) for key, node in graph.nodes.items() for a in getattr(node, "operands", ())]


def _graphml(graph: Overlay) -> bytes:
    networkx = extra("networkx")
    found = networkx.MultiDiGraph(robot=printable(graph.robot), torque=graph.torque)
    for node in graph.nodes.values():
        values = {k: v for k, v in _node(graph, node).items() if k not in ("key", "arguments")}
        texts = {k: v if isinstance(v, int) else printable(str(v)) for k, v in values.items()}
        found.add_node(printable(node.key), **texts)
    found.add_edges_from((printable(a), b) for a, b in _edges(graph))
    return "\n".join([*networkx.generate_graphml(found, named_key_ids=True), ""]).encode()


def _drawn(dot: str, kind: str) -> bytes:
    program = shutil.which("dot")
    if program is None:
        raise LinkwiseError(
            "the program dot of Graphviz, which draws graphs, is missing: install Graphviz, or take "
            "--format dot, graphml or json"
        )
    done = subprocess.run([program, f"-T{kind}"], input=dot.encode(), capture_output=True, check=False)
    if done.returncode:
        raise LinkwiseError(f"dot draws nothing: {one_line(done.stderr.decode(errors='replace'), 200)}")
    return done.stdout
