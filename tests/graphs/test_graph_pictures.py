"""Pictures of autograd's graphs: colours, counts and arrows are those of the parts that need an operation."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from linkwise import LinkwiseError
from linkwise.escape import html_text
from linkwise.graphs import dot_text, folded, graph_files, overlay
from linkwise.graphs.graph_files import _drawn
from linkwise.plotstyle import COLOURS, GRAVITY, PALE

LOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
LETTERS = {1: "q\u0307", 2: "q\u0308"}


@pytest.fixture(scope="module")
def robot(package_of: Callable[[str], ModuleType]) -> Any:
    return package_of("planar3").load("autograd")


@pytest.fixture(scope="module")
def parts(robot: Any) -> list[Any]:
    """Return the parts of τ_1,2: gravity, two accelerations and two velocities."""
    return list(robot.graph_parts(0, 1))


@pytest.fixture(scope="module")
def text(robot: Any, parts: list[Any]) -> str:
    graph = overlay(robot, 0, 1, parts)
    return dot_text(graph, folded(graph, "none"))


def colour_of(joint: str | None, order: int) -> str:
    """Strong for an acceleration, three fifths of the way to white for a velocity, grey for gravity."""
    if joint is None:
        return GRAVITY
    strong = COLOURS[int(joint[-1]) - 1]
    channels = [int(strong[at : at + 2], 16) for at in (1, 3, 5)]
    share = 0.0 if order == 2 else 0.6
    return "#" + "".join(f"{round(x + share * (255 - x)):02X}" for x in channels)


def needing(parts: list[Any]) -> dict[str, list[int]]:
    """Numbers of the parts in which each leaf or operation is, by key."""
    every = dict.fromkeys(node.key for part in parts for node in part.nodes)
    return {key: [at for at, part in enumerate(parts) if key in {n.key for n in part.nodes}] for key in every}


def test_what_one_part_needs_has_its_colour_and_motions_have_theirs(text: str, parts: list[Any]) -> None:
    by_key = {node.key: node for part in parts for node in part.nodes}
    shown = re.findall(r'^n\d+ \[shape=(\w+), label=<(.*?)>, fillcolor="(.*?)"', text, re.MULTILINE)
    users = needing(parts)
    assert len(shown) == len(users)
    seen = set()
    for (shape, label, fill), (key, needed) in zip(shown, users.items(), strict=True):
        node = by_key[key]
        if hasattr(node, "operands"):
            one = parts[needed[0]]
            expected = "ellipse", colour_of(one.coordinate, one.order) if len(needed) == 1 else PALE
        elif node.kind in ("qd", "qdd"):
            order = len(node.kind) - 1
            expected = "box", colour_of(node.name, order)
            assert label == LETTERS[order] + node.name[-1].translate(LOW)
        else:
            expected = "box", "white"
        assert (shape, fill) == expected, key
        seen.add(fill)
    assert {PALE, "white", colour_of("joint2", 1), colour_of("joint2", 2)} <= seen


def test_the_legend_counts_operations_of_each_part_and_those_of_several(text: str, parts: list[Any]) -> None:
    users = {key: needed for key, needed in needing(parts).items() if key not in leaves(parts)}
    rows = re.findall(r'<TD BGCOLOR="(.*?)" WIDTH="18"> </TD><TD ALIGN="LEFT">(.*?)</TD>', text)
    for at, (part, (fill, told)) in enumerate(zip(parts, rows, strict=False)):
        own = sum(needed == [at] for needed in users.values())
        assert told.endswith(f": {len(part.operations)} operations, {own} of its own")
        assert fill == colour_of(part.coordinate, part.order)
        if part.coordinate is not None:
            assert f"{LETTERS[part.order]}{part.coordinate[-1].translate(LOW)}, {part.coordinate}:" in told
    several = sum(len(needed) > 1 for needed in users.values())
    assert rows[-1] == (PALE, f"needed by several parts: {several} of {len(users)} operations")
    assert 0 < several < len(users)


def leaves(parts: list[Any]) -> set[str]:
    return {leaf.key for part in parts for leaf in part.leaves}


def test_each_part_ends_where_it_was_recorded_and_what_is_taken_off_is_marked(
    robot: Any, parts: list[Any], text: str
) -> None:
    graph = overlay(robot, 0, 1, parts)
    place = folded(graph, "none").place
    ends = dict(re.findall(r"^(n\d+) -> (part\d+);", text, re.MULTILINE))
    assert ends == {f"n{place[part.output]}": f"part{at}" for at, part in enumerate(parts)}
    marked = set(re.findall(r"^(n\d+ -> n\d+) \[.*arrowhead=tee", text, re.MULTILINE))
    taken = {
        f"n{place[node.operands[1]]} -> n{place[node.key]}"
        for part in parts
        for node in part.operations
        if node.name in ("sub", "div") and len(node.operands) == 2
    }
    assert marked == taken


def test_why_dot_draws_nothing_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "dot").write_text("#!/bin/sh\necho no fonts here >&2\nexit 3\n")
    (tmp_path / "dot").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    with pytest.raises(LinkwiseError, match=r"^dot draws nothing: no fonts here$"):
        _drawn("digraph {}", "svg")


def test_a_part_by_position_names_its_file_by_its_joint(robot: Any) -> None:
    for asked, name in (((None, 0), "tau_1_2_gravity"), ((1, 0), "tau_1_2_q_2")):
        graph = overlay(robot, 0, 1, [robot.graph(0, 1, *asked)])
        assert graph_files(graph, ["dot"]).keys() == {f"{name}.dot"}
        assert html_text("link2") in dot_text(graph, folded(graph))
