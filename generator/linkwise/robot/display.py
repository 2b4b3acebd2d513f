"""HTML for robots and links of a description, as a notebook shows them."""

from collections.abc import Iterable
from dataclasses import astuple
from typing import Any

from linkwise_runtime.html_tables import joint_table, page_part, table

SHOWN = 30
"""Most letters of a formula that are shown."""


def description_table(robot: Any) -> str:
    """Return the HTML of a `Robot`: joints with their limits, links with mass and parent, and constraints."""
    names = [coordinate.name for coordinate in robot.coordinates]
    links = (
        (str(j), link.name, _number(link.mass), _on(robot, link), link.joint.name)
        for j, link in enumerate(robot.links)
    )
    held = [(tie.name, tie.kind) for tie in robot.ties] + [(one.name, "coupling") for one in robot.couplings]
    limits = [astuple(limits) for limits in robot.joint_limits]
    return page_part(
        f"{robot.name}: {_counted(names, 'joint')}, {_counted(robot.links, 'link')}",
        joint_table(names, [coordinate.unit for coordinate in robot.coordinates], limits),
        table(("", "link", "mass, kg", "on", "by joint"), links),
        *([table(("constraint", "kind"), held)] if held else []),
    )


def link_table(link: Any) -> str:
    """Return the HTML of a `Link`."""
    rows = [
        ("joint", f"{link.joint.name}, {link.joint.kind}"),
        ("mass, kg", _number(link.mass)),
        ("centre of mass, m", _numbers(link.com)),
        ("inertia about it, kg m²", _numbers(link.inertia[0])),
        ("", _numbers(link.inertia[1])),
        ("", _numbers(link.inertia[2])),
    ]
    return page_part(f"link {link.name}", table(("", "in the joint's axes"), rows))


def _on(robot: Any, link: Any) -> str:
    return "the ground" if link.parent is None else str(robot.links[link.parent].name)


def _counted(items: Iterable[object], what: str) -> str:
    count = len(list(items))
    return f"{count} {what}{'s' * (count != 1)}"


def _numbers(values: Iterable[Any]) -> str:
    return ", ".join(map(_number, values))


def _number(value: Any) -> str:
    """Return a number as it is read, or a formula in parameters as it stands."""
    text = f"{float(value):.5g}" if getattr(value, "is_number", True) else str(value)
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 1]}…"
