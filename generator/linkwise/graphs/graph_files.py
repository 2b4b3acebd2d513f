"""A graph as files: a picture by Graphviz, GraphML for graph programs, JSON for programs of one's own."""

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
from linkwise.graphs.recorded_dot import recorded_dot, recorded_json
from linkwise.progress import Progress, silent

FORMATS = ("svg", "png", "dot", "graphml", "json")
MOTIONS = {order: name for name, order in KINDS.items()}


def graph_files(
    graph: Overlay, formats: Iterable[str], fold: str | None = None, progress: Progress = silent
) -> dict[str, bytes]:
    """Return files by name, in these formats.

    fold: for pictures; None for the least that makes one legible

    Raises LinkwiseError where a program or a library is missing.
    """
    texts: dict[str, bytes] = {}
    drawing = folded(graph, fold)
    dot = dot_text(graph, drawing)
    stage = f"draw {len(drawing.nodes):,} nodes"
    for kind in formats:
        match kind:
            case "svg" | "png":
                # Graphviz reports no progress, and needs minutes for thousands of nodes.
                progress(stage, 0, 1)
                content = _drawn(dot, kind)
                progress(stage, 1, 1)
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


def recorded_files(
    graph: Overlay, recorded: Any, formats: Iterable[str], progress: Progress = silent
) -> dict[str, bytes]:
    """Return files of torch's own graph of a torque, by name; GraphML is left to the other graph."""
    texts: dict[str, bytes] = {}
    stage = f"draw {len(recorded):,} recorded nodes"
    whole = "_".join(["tau", str(graph.joint + 1), *([] if graph.link is None else [str(graph.link + 1)])])
    for kind in formats:
        if kind in ("svg", "png"):
            progress(stage, 0, 1)
            content = _drawn(recorded_dot(recorded), kind)
            progress(stage, 1, 1)
        elif kind == "dot":
            content = recorded_dot(recorded).encode()
        elif kind == "json":
            content = f"{json_text(recorded_json(recorded), indent=1)}\n".encode()
        else:
            continue
        texts[f"{whole}_recorded.{kind}"] = content
    return texts


def file_name(graph: Overlay) -> str:
    """Return tau_1_2 for τ_1,2, tau_1_2_qdd_1 for a part of it.

    Several parts have names such as tau_1_2_motion_1 and tau_1_2_qdd.
    """
    words = ["tau", str(graph.joint + 1), *([] if graph.link is None else [str(graph.link + 1)])]
    coordinates = {graph.coordinate(number) for number in range(len(graph.parts))}
    orders = {part.order for part in graph.parts}
    k = coordinates.pop() if len(coordinates) == 1 else None
    order = orders.pop() if len(orders) == 1 else None
    if order is not None:
        still = "gravity" if graph.potential == "gravity" else "named"
        words.append(still if k is None and order == 0 else MOTIONS[order])
    elif k is not None:
        words.append("motion")
    return "_".join([*words, *([] if k is None else [str(k + 1)])])


def graph_json(graph: Overlay) -> dict[str, Any]:
    """Return the graph as JSON values, in the node-link format that networkx and D3 read.

    An id is the same in every graph of the robot; `position` numbers an operation's operands from 0.
    """
    return {
        "directed": True,
        "multigraph": True,
        "graph": _about(graph),
        "nodes": [_node(graph, node) for node in graph.nodes.values()],
        "edges": [{"source": a, "target": b, "position": at} for a, b, at in _edges(graph)],
    }


def _about(graph: Overlay) -> dict[str, Any]:
    return {
        "schema": 2,
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
    }


def _node(graph: Overlay, node: Any) -> dict[str, Any]:
    shared = {"id": node.key, "shape": list(node.shape), "parts": list(graph.users[node.key])}
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
    """Return the key of a value, a number, a list of these, or else the argument's text."""
    if hasattr(value, "key"):
        return value.key
    if isinstance(value, list | tuple):
        return [_argument(part) for part in value]
    return value if value is None or isinstance(value, bool | int | float) else str(value)


def _edges(graph: Overlay) -> list[tuple[str, str, int]]:
    """Return edges (from, to, position among the operands)."""
    return [
        (a, key, at)
        for key, node in graph.nodes.items()
        for at, a in enumerate(getattr(node, "operands", ()))
    ]


def _graphml(graph: Overlay) -> bytes:
    """Return the graph as GraphML; attributes that are lists, such as parts and arguments, are JSON texts."""
    networkx = extra("networkx")
    found = networkx.MultiDiGraph(**_flat(_about(graph)))
    for node in graph.nodes.values():
        values = _flat(_node(graph, node))
        found.add_node(values.pop("id"), **values)
    found.add_edges_from((printable(a), b, {"position": at}) for a, b, at in _edges(graph))
    return "\n".join([*networkx.generate_graphml(found, named_key_ids=True), ""]).encode()


def _flat(values: dict[str, Any]) -> dict[str, int | str]:
    return {
        key: value
        if isinstance(value, int)
        else printable(value if isinstance(value, str) else json_text(value))
        for key, value in values.items()
    }


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
