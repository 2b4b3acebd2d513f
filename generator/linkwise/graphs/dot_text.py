"""A graph as text for Graphviz: from the motions on the left to the torque on the right.

Operations that one part alone needs have the colour of its motion, strong for an acceleration and light for a
velocity; operations that several parts need are grey, gravity is dark.
"""

import re
from collections.abc import Iterator
from typing import Any

from linkwise.escape import html_text, short
from linkwise.graphs.folding import Drawing, DrawnNode
from linkwise.graphs.overlay import DOTS, KINDS, Overlay, part_label
from linkwise.plotstyle import GRAVITY, INK, PALE, colour

SIGNS = {"mul": "×", "add": "+", "sub": "−", "neg": "−", "div": "÷", "pow": "^"}
PLACES = {0: "", 1: "∂", 2: "∂²", 3: "∂³"}
"""Marks of operations of a derivative, by its order."""
LIGHT = 0.6
"""Share of white in the colour of a velocity."""
FONT = "DejaVu Sans"
LOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
"""Subscript characters: browsers differ in how they lower the text of an SVG, and in how wide they set it."""


def dot_text(graph: Overlay, drawing: Drawing) -> str:
    """Return the drawing in Graphviz's language; numbers of joints and links count from 1."""
    lines = [
        "digraph torque {",
        f'graph [rankdir=LR, fontname="{FONT}", fontsize=11, labelloc=b, labeljust=l, nodesep=0.12,',
        f"ranksep=0.32, label=<{_legend(graph)}>];",
        f'node [fontname="{FONT}", fontsize=10, style=filled, margin="0.06,0.03", height=0.28, width=0.3,',
        f'color="{INK}", fontcolor="{INK}", penwidth=0.7];',
        f'edge [color="#888888", arrowsize=0.5, penwidth=0.7, fontname="{FONT}", fontsize=8];',
    ]
    lines += [_node(graph, at, node) for at, node in enumerate(drawing.nodes)]
    leaves = [f"n{at}" for at, node in enumerate(drawing.nodes) if _is_leaf(node)]
    lines.append(f"{{rank=same; {'; '.join(leaves)}}}")
    for a, b, count in drawing.edges():
        second = _subtracted(drawing.nodes[b], drawing, a)
        # x + x and x · x have an arrow for each operand; in a folded node, one stands for all.
        whole = len(drawing.nodes[b].inner) == 1
        width = [f"penwidth={min(0.7 + 0.1 * (count - 1), 3):.2g}"] * (count > 1 and not whole)
        marks = width + ["arrowhead=tee"] * second
        arrow = f"n{a} -> n{b} [{', '.join(marks)}];" if marks else f"n{a} -> n{b};"
        lines += [arrow] * (count if whole else 1)
    lines += _results(graph, drawing)
    return "\n".join([*lines, "}", ""])


def part_colour(graph: Overlay, part: int) -> str:
    """Return the fill colour of nodes that only this part needs."""
    k, order = graph.coordinate(part), graph.parts[part].order
    return GRAVITY if k is None and order == 0 else _motion_colour(k or 0, 2 if order is None else order)


def _motion_colour(k: int, order: int) -> str:
    strong = colour(k)
    if order == 2:
        return strong
    channels = [int(strong[at : at + 2], 16) for at in (1, 3, 5)]
    return "#" + "".join(f"{round(value + LIGHT * (255 - value)):02X}" for value in channels)


def _node(graph: Overlay, at: int, node: DrawnNode) -> str:
    fill = PALE if node.part is None else part_colour(graph, node.part)
    shape, text, tip = "ellipse", "", ""
    if _is_leaf(node):
        (leaf,) = node.inner
        shape, text, tip = "box", _leaf(graph, leaf), leaf.name
        fill = "white"
        if KINDS.get(leaf.kind):
            fill = _motion_colour(graph.joints.index(leaf.name), KINDS[leaf.kind])
    elif len(node.inner) == 1:
        text = _operation(node.inner[0])
        tip = f"{PLACES[node.derivative]} {node.source}".strip()
    else:
        shape = "folder"
        place = f"{PLACES[node.derivative]} {node.source}".strip()
        tip = place if node.source else _purpose(graph, node)
        text = f"{html_text(place) if node.source else _written(tip)}<BR/>{len(node.inner)} operations"
    return (
        f'n{at} [shape={shape}, label=<{text}>, fillcolor="{fill}", fontcolor="{_ink(fill)}", '
        f'tooltip="{_quoted(tip)}"];'
    )


def _purpose(graph: Overlay, node: DrawnNode) -> str:
    """Return the purpose of folded operations of several lines, or of none."""
    if node.part is None:
        return "for several parts"
    order, k = graph.parts[node.part].order, graph.coordinate(node.part)
    if k is None or order is None:
        return f"for {part_label(graph, node.part)} alone"
    return f"for {DOTS[order]}_{k + 1} alone"


def _results(graph: Overlay, drawing: Drawing) -> Iterator[str]:
    """Yield boxes of the parts, and of the torque that they sum to."""
    for number, part in enumerate(graph.parts):
        fill = part_colour(graph, number)
        text = f"<B>{_written(part_label(graph, number))}</B>"
        yield (
            f'part{number} [shape=box, label=<{text}>, fillcolor="{fill}", fontcolor="{_ink(fill)}", '
            'style="filled,rounded"];'
        )
        if isinstance(part.output, str):
            yield f"n{drawing.place[part.output]} -> part{number};"
    if len(graph.parts) > 1:
        yield f"{{rank=same; {'; '.join(f'part{number}' for number in range(len(graph.parts)))}}}"
        yield f'torque [shape=box, label=<<B>{_written(graph.torque)}</B>>, fillcolor="white", penwidth=1.6];'
        yield from (f"part{number} -> torque [penwidth=1.4];" for number in range(len(graph.parts)))


def _legend(graph: Overlay) -> str:
    through = f"link {(graph.link or 0) + 1}, {graph.links[0]}" if graph.link is not None else "all links"
    title = (
        f"{_written(graph.torque)} of {html_text(short(graph.robot))}: torque on joint {graph.joint + 1}, "
    )
    title += html_text(f"{short(graph.joints[graph.joint])}, through {short(through, 40)}")
    rows = []
    for number, part in enumerate(graph.parts):
        fill = part_colour(graph, number)
        name = "" if part.coordinate is None else f", {short(part.coordinate)}"
        text = f"{_written(part_label(graph, number))}{html_text(name)}: {len(part.operations)} operations"
        text += f", {graph.own(number)} of its own" if len(graph.parts) > 1 else ""
        rows.append(f'<TR><TD BGCOLOR="{fill}" WIDTH="18"> </TD><TD ALIGN="LEFT">{text}</TD></TR>')
    if len(graph.parts) > 1:
        shared = sum(len(users) > 1 for key, users in graph.users.items() if _computed(graph, key))
        rows.append(
            f'<TR><TD BGCOLOR="{PALE}" WIDTH="18"> </TD><TD ALIGN="LEFT">needed by several parts: '
            f"{shared} of {graph.operations} operations</TD></TR>"
        )
    head = f'<TR><TD COLSPAN="2" ALIGN="LEFT"><B>{title}</B></TD></TR>'
    return f'<TABLE BORDER="0" CELLSPACING="2" CELLPADDING="1">{head}{"".join(rows)}</TABLE>'


def _computed(graph: Overlay, key: str) -> bool:
    return hasattr(graph.nodes[key], "operands")


def _is_leaf(node: DrawnNode) -> bool:
    return not hasattr(node.inner[0], "operands")


def _leaf(graph: Overlay, leaf: Any) -> str:
    if leaf.kind not in KINDS:
        return html_text(short(leaf.name))
    return _written(f"{DOTS[KINDS[leaf.kind]]}_{graph.joints.index(leaf.name) + 1}")


def _operation(operation: Any) -> str:
    """Return the text of an operation, with the numbers that it computes with."""
    sign = SIGNS.get(operation.name, html_text(operation.name))
    numbers = [value for value in operation.arguments if isinstance(value, float | int)]
    if operation.name == "add" and numbers and numbers[0] < 0:
        return f"− {-numbers[0]:.6g}"
    return " ".join([sign, *(f"{value:.6g}".replace("-", "−") for value in numbers)])


def _subtracted(node: DrawnNode, drawing: Drawing, before: int) -> bool:
    """Return whether the value of the node `before` is subtracted, or a divisor."""
    if len(node.inner) > 1 or node.inner[0].name not in ("sub", "div"):
        return False
    operands = node.inner[0].operands
    return len(operands) == 2 and drawing.place[operands[1]] == before


def _written(text: str) -> str:
    """Return a formula with its indices as subscripts, and commas between them only if one has two digits."""

    def low(found: re.Match[str]) -> str:
        indices = found[1].split(",")
        return ("," if any(len(index) > 1 for index in indices) else "").join(indices).translate(LOW)

    return re.sub(r"_([\d,]+)", low, html_text(text))


def _quoted(text: str) -> str:
    return html_text(text).replace("\\", "&#92;")


def _ink(fill: str) -> str:
    """Return black or white, whichever is legible on a colour."""
    if not fill.startswith("#"):
        return INK
    red, green, blue = (int(fill[at : at + 2], 16) for at in (1, 3, 5))
    return INK if 0.299 * red + 0.587 * green + 0.114 * blue > 140 else "white"
