"""Small HTML tables for notebooks, with one of a robot; they have no colours, to fit light and dark pages."""

import html
from collections.abc import Iterable, Sequence
from math import isinf

from .structure import Structure

MOST_ROWS, LONGEST = 60, 80
"""Most rows of a table, beyond which their number is given, and most letters of a cell."""
CELL = "text-align:left;vertical-align:top;padding:.15em 1em .15em 0;white-space:nowrap"
HEAD = f"{CELL};font-weight:normal;opacity:.65"
LINE = "border-bottom:1px solid;border-color:color-mix(in srgb,currentColor 25%,transparent)"
TITLE = "margin:0 0 .4em;font-weight:600"


def page_part(title: str, *tables: str) -> str:
    """Return HTML of a title, and of tables side by side as far as there is room."""
    beside = "".join(tables)
    return (
        f'<div><p style="{TITLE}">{text(title)}</p>'
        f'<div style="display:flex;flex-wrap:wrap;gap:1em 2.5em;align-items:flex-start">{beside}</div></div>'
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return HTML of a table of texts."""
    every = list(rows)
    more = [[f"and {len(every) - MOST_ROWS} more", *[""] * (len(head) - 1)]] if len(every) > MOST_ROWS else []
    heads = "".join(f'<th style="{HEAD};{LINE}">{text(cell)}</th>' for cell in head)
    lines = (
        "".join(f'<td style="{CELL}">{text(_short(cell))}</td>' for cell in row)
        for row in [*every[:MOST_ROWS], *more]
    )
    body = "".join(f'<tr style="background:none">{line}</tr>' for line in lines)
    return f'<table style="border-collapse:collapse;margin:0"><tr>{heads}</tr>{body}</table>'


def text(cell: str) -> str:
    """Return text as HTML, in which characters that cannot be seen are written out."""
    return html.escape(cell if cell.isprintable() else repr(cell))


def remark(*lines: str) -> str:
    """Return HTML of small lines below a table."""
    told = "<br>".join(map(text, lines))
    return f'<p style="margin:.5em 0 0;font-size:.85em;opacity:.7">{told}</p>'


def _short(cell: str) -> str:
    return cell if len(cell) <= LONGEST else f"{cell[: LONGEST - 3]}..."


def robot_table(structure: Structure, title: str) -> str:
    """Return HTML of joints with their units and limits, and of links with the joints that move them."""
    links = [
        (str(j), name, ", ".join(structure.joint_names[i] for i in path))
        for j, (name, path) in enumerate(zip(structure.link_names, structure.paths, strict=True))
    ]
    joints = structure.joint_names, structure.joint_units, list(zip(*structure.joint_limits, strict=True))
    parameters = [(name, f"{value:g}") for name, value in structure.parameters.items()]
    return page_part(
        title,
        joint_table(*joints),
        table(("j", "link", "moved by"), links),
        *([table(("parameter", "value"), parameters)] if parameters else []),
    )


def joint_table(names: Sequence[str], units: Sequence[str], limits: Iterable[Sequence[float]]) -> str:
    """Return HTML of a table of joints.

    limits: lower, upper, velocity and effort of each joint, infinite where it has none; or empty
    """
    of_joint = list(limits)
    limited = any(not isinf(limit) for row in of_joint for limit in row)
    told = [_limits(*row) if limited else () for row in of_joint] or [()] * len(names)
    rows = [(str(i), *row[:2], *row[2]) for i, row in enumerate(zip(names, units, told, strict=True))]
    return table(("i", "joint", "unit", *(("position", "speed", "effort") if limited else ())), rows)


def _limits(lower: float, upper: float, velocity: float, effort: float) -> tuple[str, ...]:
    ends = ["" if isinf(end) else f"{end:.4g}" for end in (lower, upper)]
    return " to ".join(ends) if any(ends) else "", *(
        "" if isinf(m) else f"{m:.4g}" for m in (velocity, effort)
    )
