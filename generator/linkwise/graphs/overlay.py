"""Graphs of several parts of one torque, overlaid: what each part has for itself, and what they share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from linkwise.package.share_word import share_word

if TYPE_CHECKING:
    from linkwise_runtime.lagrangians.graph_calls import TorqueGraph

DOTS = {0: "q", 1: "q\N{COMBINING DOT ABOVE}", 2: "q\N{COMBINING DIAERESIS}"}
"""Letters of a motion by its order."""
KINDS = {"q": 0, "qd": 1, "qdd": 2}
"""Order of a motion by its name in calls."""


@dataclass(frozen=True)
class Overlay:
    """Parts of the torque on one joint; indices count from 0.

    nodes: leaves and operations by key, operands first
    users: for each node the numbers of the parts that need it
    """

    robot: str
    joints: tuple[str, ...]
    joint: int
    links: tuple[str, ...]
    """Names of the links through which it is loaded: one, or all."""
    link: int | None
    potential: str
    """Name of the part without any motion."""
    parts: tuple[TorqueGraph, ...]
    nodes: dict[str, Any]
    users: dict[str, tuple[int, ...]]

    @property
    def torque(self) -> str:
        """Formula of the torque, such as τ_1,2."""
        return f"τ_{self.joint + 1}" + ("" if self.link is None else f",{self.link + 1}")

    @property
    def operations(self) -> int:
        """Number of operations of all parts together."""
        return sum(hasattr(node, "operands") for node in self.nodes.values())

    def own(self, part: int) -> int:
        """Return the number of operations that only this part needs."""
        return sum(self.users[node.key] == (part,) for node in self.parts[part].operations)

    def coordinate(self, part: int) -> int | None:
        """Return coordinate k of a part; None for a part of no single coordinate."""
        name = self.parts[part].coordinate
        return None if name is None else self.joints.index(name)


def overlay(robot: Any, joint: int, link: int | None, parts: Sequence[TorqueGraph]) -> Overlay:
    """Overlay graphs; `robot` is the package's robot, on its autograd back end."""
    nodes: dict[str, Any] = {}
    users: dict[str, list[int]] = {}
    written = robot.structure.shares
    for number, part in enumerate(parts):
        for node in part.nodes:
            nodes.setdefault(node.key, node)
            users.setdefault(node.key, []).append(number)
    return Overlay(
        robot.name,
        tuple(robot.joint_names),
        joint,
        tuple(robot.link_names) if link is None else (robot.link_names[link],),
        link,
        share_word(robot.structure.share_names if link is None or not written else written[link]),
        tuple(parts),
        nodes,
        {key: tuple(numbers) for key, numbers in users.items()},
    )


def part_label(graph: Overlay, part: int) -> str:
    """Return the formula of a part, c2 q̈_1, or its name, such as gravity."""
    order, k = graph.parts[part].order, graph.coordinate(part)
    if k is None:
        return {None: graph.torque, 0: graph.potential, 1: "all velocities", 2: "all accelerations"}[order]
    if order is None:
        return f"motion of joint {k + 1}"
    through = "" if graph.link is None else f"{graph.link + 1},"
    return f"c{order}_{graph.joint + 1},{through}{k + 1} {DOTS[order]}_{k + 1}"


def recorded_summary(graph: Overlay, recorded: Any) -> str:
    """Return a line on torch's own graph of the torque."""
    names = ", ".join(f"{count} {name}" for name, count in [*recorded.counts().items()][:3])
    return (
        f"torch itself recorded {len(recorded)} nodes for {graph.torque}, as partial_torque answers it: "
        f"{names} and others"
    )


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
