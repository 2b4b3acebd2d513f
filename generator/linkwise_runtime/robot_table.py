"""A robot as a notebook shows it: its joints and its links."""

from collections.abc import Iterable, Sequence
from math import isinf

from .html_tables import page_part, table
from .structure import Structure


def robot_table(structure: Structure, title: str) -> str:
    """HTML of joints with their units and limits, and of links with the joints that move them."""
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
    """HTML of joints; limits: lower, upper, velocity and effort of each, infinite or not there at all."""
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
