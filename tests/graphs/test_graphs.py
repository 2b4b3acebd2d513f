"""Autograd's graphs: each part runs to the number that closed forms give, and is told as it was recorded."""

import json
import pickle
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import networkx
import numpy as np
import pytest
import torch
from conftest import DATA
from helpers.answers import random_states
from helpers.needed import needs
from house.test_names import HOSTILE, chain
from linkwise import Options, generate, read_system, write_package
from linkwise.cli.app import main
from linkwise.errors import LinkwiseError
from linkwise.graphs import FOLDS, dot_text, folded, graph_files, graph_json, overlay
from linkwise.graphs.folding import LEGIBLE, Drawing
from linkwise.graphs.overlay import Overlay
from linkwise.package.load import import_package
from linkwise.progress import silent
from linkwise.report import count_polynomial, reduction_json, reduction_markdown, study
from linkwise.report.recorded_operations import recorded_operations
from linkwise.robot import read_robot
from linkwise.symbolic.system import rigid_system

Packages = Callable[[str], ModuleType]
needs_graphviz = needs("dot")
TURNTABLE = str(DATA / "turntable.py")


def held(package: ModuleType, samples: int = 20) -> Any:
    """The robot on autograd, a motion, and what closed forms make of it: c2 q̈, c1 q̇ and g."""
    robot, motion = package.load("autograd"), random_states(package.load("numpy").n, samples)
    return robot, motion, package.load("numpy").propagation(*motion)


@pytest.mark.parametrize("name", ["planar3", "puma560", TURNTABLE])
def test_the_graph_of_each_part_runs_to_its_share_of_the_torque(name: str, package_of: Packages) -> None:
    robot, motion, share = held(package_of(name))
    for i in range(robot.n):
        for j in range(robot.N):
            parts = {(part.coordinate, part.order): part for part in robot.graph_parts(i, j)}
            wanted = {(None, 0): share.gravity[:, i, j]}
            for k, joint in enumerate(robot.joint_names):
                wanted[joint, 2] = share.acceleration[:, i, j, k]
                wanted[joint, 1] = share.velocity[:, i, j, k]
            assert parts.keys() <= wanted.keys()
            for part, value in wanted.items():
                found = parts[part].evaluate(*motion) if part in parts else np.zeros(len(value))
                np.testing.assert_allclose(found, value, rtol=0, atol=1e-13, err_msg=f"{i} {j} {part}")


def test_a_whole_torque_an_order_a_motion_and_a_stiffness_run_too(package_of: Packages) -> None:
    robot, motion, share = held(package_of("puma560"))
    exact = package_of("puma560").load("numpy")
    stiffness = exact.position_gradient(*motion)[:, 1, 4, 3] * motion[0][:, 3]
    wanted = {
        (1, 4): exact.partial_torque(*motion)[:, 1, 4],
        (1,): exact.inverse_dynamics(*motion)[:, 1],
        (1, None, 3, 2): share.acceleration[:, 1, :, 3].sum(-1),
        (1, (2, "link5"), 3, 1): share.velocity[:, 1, [2, 4], 3].sum(-1),
        (1, 4, None, 1): share.velocity[:, 1, 4].sum(-1),
        (1, 4, None, 2): share.acceleration[:, 1, 4].sum(-1),
        (1, 4, "joint4"): (share.velocity + share.acceleration)[:, 1, 4, 3],
        (1, 4, 3, 0): stiffness,
    }
    for asked, value in wanted.items():
        found = robot.graph(*asked).evaluate(*motion)
        np.testing.assert_allclose(found, value, rtol=0, atol=1e-13, err_msg=str(asked))


def test_the_part_of_an_acceleration_is_cut_out_of_the_torques_graph(package_of: Packages) -> None:
    robot = package_of("planar3").load("autograd")
    whole, part = robot.graph(0, 1), robot.graph(0, 1, 0, 2)
    assert part.shared_with(whole) == part.operations
    assert sum(part.counts().values()) == len(part.operations) < len(whole.operations)
    assert {leaf.key for leaf in part.leaves} == {"q[1]", "qdd[0]"}
    assert {key for edge in part.edges for key in edge} == {node.key for node in part.nodes}
    off_path = robot.graph(1, 0)
    assert (off_path.nodes, off_path.output) == ((), 0.0)
    assert off_path.evaluate(*random_states(3, 2)).tolist() == [0.0, 0.0]


def test_an_operation_names_the_file_of_its_line(package_of: Packages) -> None:
    robot = package_of("planar3").load("autograd")
    graph = robot.graph(0, 1)
    sine = next(node for node in graph.operations if node.name == "sin" and node.operands == ("q[1]",))
    assert re.fullmatch(r"link_2\.py:\d+", sine.source)
    assert (sine.derivative, sine.shape, sine.pointwise) == (0, (), True)
    assert {node.source.partition(":")[0] for node in graph.operations} == {"link_1.py", "link_2.py", ""}
    # Only products with motions and their sums come from no line.
    assert all(node.source for node in graph.operations if node.derivative)
    assert sine in graph.shared_with(robot.graph(0, 2))


def test_an_operation_says_how_often_the_energy_was_differentiated(package_of: Packages) -> None:
    robot = package_of("planar3").load("autograd")
    most = {(0, 1, None, 0): 1, (0, 1, 1, 2): 2, (0, 1): 2, (0, 1, 1, 1): 3, (0, 1, 1, 0): 3}
    for asked, order in most.items():
        found = {node.derivative for node in robot.graph(*asked).operations}
        assert found == {0, order} if asked == (0, 1, 1, 2) else found == {*range(order + 1)}, asked


def test_parameters_are_leaves_and_get_gradients(package_of: Packages) -> None:
    package = package_of("planar3 symbolic")
    masses = torch.tensor([0.4, 0.9], dtype=torch.float64, requires_grad=True)
    q, qd, qdd = (torch.from_numpy(a) for a in random_states(3, 2))
    found = package.load("autograd", {"m_2": masses}).graph(0, 1, 1, 2)
    assert "m_2" in {leaf.name for leaf in found.leaves if leaf.kind == "parameter"}
    value = found.evaluate(q, qd, qdd.requires_grad_())
    expected = package.load("torch", {"m_2": masses}).propagation(q, qd, qdd).acceleration[:, 0, 1, 1]
    torch.testing.assert_close(value, expected, rtol=0, atol=1e-13)
    given = masses, qdd
    for one, other in zip(*(torch.autograd.grad(a.sum(), given) for a in (value, expected)), strict=True):
        torch.testing.assert_close(one, other, rtol=0, atol=1e-13)


def test_what_is_learned_of_a_link_is_a_leaf_as_it_is_now_and_gets_gradients(package_of: Packages) -> None:
    package = package_of("planar3")
    robot, motion = package.load("autograd", requires_grad=("mass", "com")), random_states(3, 2)
    part = robot.graph(0, 1, 0, 2)
    assert [leaf.name for leaf in part.leaves if leaf.kind == "parameter"] == [
        "links.link2.mass",
        "links.link2.com[0]",
        "links.link2.com[1]",
    ]
    learned = dict(robot.named_parameters())
    with torch.no_grad():
        learned["links.link2.mass"].fill_(0.9)
        learned["links.link2.com"].copy_(torch.tensor([0.1, 0.2, 0.3], dtype=torch.float64))
    value = part.evaluate(*motion)
    bodies = package.bodies()
    bodies.masses[1], bodies.centres[1] = 0.9, [0.1, 0.2, 0.3]
    bodies = type(bodies)(*(torch.from_numpy(a).requires_grad_() for a in bodies))
    expected = package.load("torch", bodies=bodies).propagation(*motion).acceleration[:, 0, 1, 0]
    torch.testing.assert_close(value, expected, rtol=0, atol=1e-13)
    slopes = torch.autograd.grad(expected.sum(), bodies[:2])
    names = ("links.link2.mass", "links.link2.com")
    found = torch.autograd.grad(value.sum(), [learned[name] for name in names])
    for one, other in zip(found, slopes, strict=True):
        torch.testing.assert_close(one, other[1], rtol=0, atol=1e-13)
    graph = overlay(robot, 0, 1, [part])
    assert "links.link2.mass" in dot_text(graph, folded(graph))


def test_any_batch_and_either_precision(package_of: Packages) -> None:
    robot, motion, share = held(package_of("planar3"), 6)
    part = robot.graph("joint1", "link3", "joint2", 1)
    single = part.evaluate(*(a.astype(np.float32).reshape(2, 3, 3) for a in motion))
    assert (single.dtype, single.shape) == (torch.float32, (2, 3))
    np.testing.assert_allclose(single.reshape(-1), share.velocity[:, 0, 2, 1], rtol=0, atol=1e-5)
    alone = part.evaluate(*(a[4] for a in motion))
    np.testing.assert_allclose(alone, share.velocity[4, 0, 2, 1], rtol=0, atol=1e-13)


def edited(directory: Path, energy: str) -> tuple[Any, str]:
    """One joint with a kinetic energy of somebody's own, and the line that it is written in."""
    write_package(generate(read_system("planar1"), ["autograd"]), directory)
    path = directory / "energies/link_1.py"
    own = f"Lagrangian.kinetic = lambda self, q, qd, *p, **by_name: {energy}"
    text = f"{path.read_text()}\n\nimport torch\n{own}\n"
    path.write_text(text)
    sys.path.insert(0, str(directory.parent))
    try:
        return __import__(directory.name).load("autograd"), f"link_1.py:{text.count(chr(10))}"
    finally:
        sys.path.pop(0)


@pytest.mark.parametrize(
    ("name", "energy", "inertia", "slope"),
    [
        (
            "vectors",
            "(torch.stack([qd[0], 2.0 * qd[0] * q[0]]) ** 2).sum()",
            lambda q: 2 + 8 * q**2,
            lambda q: 16 * q,
        ),
        (
            "special",
            "qd[0] ** 2 * torch.hypot(q[0], torch.tensor(2.0, dtype=q[0].dtype))",
            lambda q: 2 * np.hypot(q, 2),
            lambda q: 2 * q / np.hypot(q, 2),
        ),
        (
            "options",
            "qd[0] ** 2 * torch.add(q[0], q[0] ** 2, alpha=3.0)",
            lambda q: 2 * q + 6 * q**2,
            lambda q: 2 + 12 * q,
        ),
    ],
)
def test_an_edited_energy_may_compute_by_any_operation(
    name: str, energy: str, inertia: Callable[[Any], Any], slope: Callable[[Any], Any], tmp_path: Path
) -> None:
    robot, line = edited(tmp_path / name, energy)
    q, qd, qdd = random_states(1, 5)
    part, force = robot.graph(0, 0, 0, 2), robot.graph(0, 0, 0, 1)
    np.testing.assert_allclose(part.evaluate(q, qd, qdd), (inertia(q) * qdd)[:, 0], rtol=1e-14, atol=0)
    np.testing.assert_allclose(force.evaluate(q, qd, qdd), (slope(q) * qd**2 / 2)[:, 0], rtol=1e-14, atol=0)
    assert {node.source for node in part.operations if node.derivative} == {line}
    assert any(node.shape for node in part.operations) is (name == "vectors")
    with torch.inference_mode():
        assert robot.graph(0, 0, 0, 2).evaluate(q[0], qd[0], qdd[0]).shape == ()


def test_a_slope_is_of_the_line_that_it_differentiates(tmp_path: Path) -> None:
    energy = """qd[0] ** 2 * (
            torch.exp(q[0])
            + torch.sinh(q[0])
            + torch.sin(q[0])
        )"""
    robot, _ = edited(tmp_path / "lines", energy)
    inertia, damping = (
        {node.name: node for node in robot.graph(0, 0, 0, m).operations if node.operands == ("q[0]",)}
        for m in (2, 1)
    )
    for function, slope in (("sinh", "cosh"), ("sin", "cos")):
        assert damping[slope].source == inertia[function].source
        assert damping[slope].derivative > inertia[function].derivative == 0
    assert inertia["sin"].source != inertia["sinh"].source


def test_a_number_that_is_taken_off_is_drawn_with_its_sign(tmp_path: Path) -> None:
    robot, _ = edited(tmp_path / "shifted", "qd[0] ** 2 * (q[0] + -0.25)")
    graph = overlay(robot, 0, 0, [robot.graph(0, 0, 0, 2)])
    assert re.search(r"label=<[−+] −?0.25>", dot_text(graph, folded(graph, "none")))[0] == "label=<− 0.25>"
    robot, _ = edited(tmp_path / "less", "qd[0] ** 2 * (torch.cos(q[0]) - torch.exp(q[0]))")
    graph = overlay(robot, 0, 0, [robot.graph(0, 0, 0, 2)])
    drawing = folded(graph, "none")
    (less,) = (node for node in graph.nodes.values() if node.name == "sub")
    marked = re.findall(r"^(n\d+ -> n\d+) \[.*arrowhead=tee", dot_text(graph, drawing), re.MULTILINE)
    assert marked == [f"n{drawing.place[less.operands[1]]} -> n{drawing.place[less.key]}"]


def test_an_energy_that_writes_in_place_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="writes into a tensor, which a graph cannot show"):
        edited(tmp_path / "in_place", "(qd[0] * 1.5).square_()")[0].graph(0, 0)


@pytest.mark.parametrize(
    ("asked", "complaint"),
    [
        ((3, 0), "i is 3; choose a joint by number, 0..2, or by name: joint1, joint2, joint3"),
        ((0, "elbow"), "j is 'elbow'; choose a link by number, 0..2, or by name: link1, link2, link3"),
        ((0, 0, True), "k is True; choose a joint"),
        ((0, 0, 0, 3), "m is 3; choose 2 for acceleration, 1 for velocity, 0 for position and gravity"),
        ((0, 0, 0, True), "m is True; choose 2 for acceleration"),
        ((0, 0, 0, 2.0), "m is 2.0; choose 2 for acceleration"),
        ((0, [1, "link2"]), "j names link link2 twice; give each link once"),
    ],
)
def test_what_is_not_there_is_refused_by_name(
    asked: tuple[Any, ...], complaint: str, package_of: Packages
) -> None:
    with pytest.raises(ValueError, match=re.escape(complaint)):
        package_of("planar3").load("autograd").graph(*asked)


def test_indices_of_numpy_are_integers_too(package_of: Packages) -> None:
    robot = package_of("planar3").load("autograd")
    same = robot.graph(np.int64(0), np.array([1, 2]), np.uint8(1), np.int32(2))
    assert same.output == robot.graph(0, [1, 2], 1, 2).output


def test_a_graph_is_told_in_a_line_and_refuses_in_one(package_of: Packages) -> None:
    part = package_of("puma560").load("autograd").graph(0, 5, 1, 2)
    sizes = f"{len(part.operations)} operations, {len(part.leaves)} leaves"
    assert repr(part) == f"<TorqueGraph: torque on joint1 through link6, acceleration of joint2: {sizes}>"
    with pytest.raises(
        TypeError, match=r"^a TorqueGraph holds functions of torch, which are neither pick.*$"
    ):
        pickle.dumps(part)
    with pytest.raises(TypeError, match=r"^shared_with takes other graphs, .*, and got 3$"):
        part.shared_with(3)


def test_other_back_ends_record_nothing(package_of: Packages) -> None:
    with pytest.raises(TypeError, match="numpy records no operations; load autograd for graphs"):
        package_of("planar3").load("numpy").graph(0, 0)


def test_a_picture_shows_every_operation_once_and_folds_no_colour(package_of: Packages) -> None:
    robot = package_of("puma560").load("autograd")
    graph = overlay(robot, 1, 5, robot.graph_parts(1, 5))
    drawings = [folded(graph, fold) for fold in FOLDS]
    for drawing in drawings:
        assert sorted(node.key for one in drawing.nodes for node in one.inner) == sorted(graph.nodes)
        for one in drawing.nodes:
            users = {graph.users[node.key] for node in one.inner}
            assert users == {(one.part,)} if one.part is not None else all(len(u) > 1 for u in users)
    sizes = [len(drawing.nodes) for drawing in drawings]
    assert sizes == sorted(sizes, reverse=True)
    assert folded(graph) == next(drawing for drawing in drawings if len(drawing.nodes) <= LEGIBLE)
    text = dot_text(graph, drawings[2])
    inertial = robot.graph(1, 5, 1, 2)
    alone = graph.own([part.output for part in graph.parts].index(inertial.output))
    assert f"label=<for q\u0308₂ alone<BR/>{alone} operations>" in text
    assert not re.search(r"label=<\d+ operations", text)
    assert len(re.findall(r"^part\d+ \[", text, re.MULTILINE)) == len(graph.parts) == 13
    assert sum(len(part.operations) for part in graph.parts) > graph.operations


def test_json_and_graphml_hold_the_whole_graph(package_of: Packages) -> None:
    robot = package_of("planar3").load("autograd")
    graph = overlay(robot, 0, 1, robot.graph_parts(0, 1))
    files = graph_files(graph, ["json", "graphml", "dot"])
    assert files.keys() == {"tau_1_2.json", "tau_1_2.graphml", "tau_1_2.dot"}
    data = json.loads(files["tau_1_2.json"])
    assert data == graph_json(graph)
    parts = data["graph"]["parts"]
    assert [(p["coordinate"], p["order"], p["operations"]) for p in parts] == [
        (part.coordinate, part.order, len(part.operations)) for part in graph.parts
    ]
    values = {"q[0]": 0.3, "q[1]": 0.5, "qd[0]": 1.0, "qd[1]": 2.0, "qdd[0]": 3.0, "qdd[1]": 4.0}
    calls: dict[str, Callable[..., float]] = {
        "sin": np.sin,
        "cos": np.cos,
        "neg": np.negative,
        "add": np.add,
        "mul": np.multiply,
    }
    read = networkx.parse_graphml(files["tau_1_2.graphml"].decode(), force_multigraph=True)
    for key, node in read.nodes.items():
        if node["kind"] == "operation":
            values[key] = calls[node["name"]](*(values.get(a, a) for a in json.loads(node["arguments"])))
    torque = robot.partial_torque([0.3, 0.5, 0.0], [1.0, 2.0, 0.0], [3.0, 4.0, 0.0])[0, 1]
    assert json.loads(read.graph["parts"]) == parts
    assert sum(values[part["output"]] for part in parts) == pytest.approx(float(torque), abs=1e-13)
    linked = networkx.node_link_graph(data, edges="edges")
    assert linked.is_directed()
    assert set(read.nodes) == set(linked.nodes)
    assert sorted(read.edges(data="position")) == sorted(linked.edges(data="position"))


@pytest.mark.parametrize(
    ("k", "m", "name"),
    [
        (None, None, "tau_1_2"),
        (0, None, "tau_1_2_motion_1"),
        (0, 2, "tau_1_2_qdd_1"),
        (None, 2, "tau_1_2_qdd"),
    ],
)
def test_what_is_asked_for_names_the_files(
    package_of: Packages, k: int | None, m: int | None, name: str
) -> None:
    robot = package_of("planar3").load("autograd")
    wanted = None if k is None else robot.joint_names[k]
    parts = [p for p in robot.graph_parts(0, 1) if wanted in (None, p.coordinate) and m in (None, p.order)]
    assert graph_files(overlay(robot, 0, 1, parts), ["dot"]).keys() == {f"{name}.dot"}


def test_a_value_added_to_itself_is_drawn_with_two_arrows(package_of: Packages) -> None:
    robot = package_of("planar3").load("autograd")
    graph = overlay(robot, 0, 1, robot.graph_parts(0, 1))
    drawing = folded(graph, "none")
    arrows = re.findall(r"^(n\d+ -> n\d+)", dot_text(graph, drawing), re.MULTILINE)
    assert len(arrows) == sum(count for _, _, count in drawing.edges()) > len(set(arrows))


def test_the_legend_counts_what_parts_share_and_labels_say_which_coefficient(package_of: Packages) -> None:
    robot = package_of("planar3").load("autograd")
    graph = overlay(robot, 0, 1, robot.graph_parts(0, 1))
    users = [graph.users[key] for key, node in graph.nodes.items() if hasattr(node, "operands")]
    shared = sum(len(parts) > 1 for parts in users)
    assert 0 < shared < len(users)
    text = dot_text(graph, folded(graph))
    assert f"needed by several parts: {shared} of {len(users)} operations" in text
    assert "<B>c2₁₂₁ q\u0308₁</B>" in text
    assert "<B>c1₁₂₂ q\u0307₂</B>" in text
    assert "<B>τ₁₂</B>" in text


@pytest.mark.parametrize(("joint", "link", "shown"), [(0, 1, "τ₁₂"), (0, 9, "τ₁,₁₀"), (10, 11, "τ₁₁,₁₂")])
def test_indices_of_two_digits_stand_apart(joint: int, link: int, shown: str) -> None:
    joints = tuple(f"joint{k}" for k in range(1, 13))
    empty = Overlay("arm", joints, joint, (f"link{link + 1}",), link, "gravity", (), {}, {})
    assert f"<B>{shown} of arm: torque on joint {joint + 1}, " in dot_text(empty, Drawing((), {}))


def test_what_is_subtracted_or_divided_by_and_nothing_else_ends_in_a_bar(tmp_path: Path) -> None:
    robot, _ = edited(tmp_path / "bars", "qd[0] ** 2 * (q[0].sin() - q[0].cos()) / (2.0 + q[0])")
    graph = overlay(robot, 0, 0, robot.graph_parts(0, 0))
    drawing = folded(graph, "none")
    bars = re.findall(r"^n(\d+) -> n(\d+) \[arrowhead=tee\];", dot_text(graph, drawing), re.MULTILINE)
    two = [node for node in graph.nodes.values() if len(getattr(node, "operands", ())) == 2]
    taken_away = [node for node in two if node.name in ("sub", "div")]
    assert {node.name for node in taken_away} == {"sub", "div"} < {node.name for node in two}
    places = {(drawing.place[node.operands[1]], drawing.place[node.key]) for node in taken_away}
    assert {(int(a), int(b)) for a, b in bars} == places


@needs_graphviz
def test_a_picture_says_that_it_is_being_drawn(package_of: Packages) -> None:
    robot, told = package_of("planar3").load("autograd"), list[tuple[str, int, int]]()
    graph = overlay(robot, 0, 1, robot.graph_parts(0, 1))
    graph_files(graph, ["json", "svg"], "none", lambda *step: told.append(step))
    stage = f"draw {len(graph.nodes)} nodes"
    assert told == [(stage, 0, 1), (stage, 1, 1)]


@needs_graphviz
def test_names_of_any_kind_are_drawn(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(chain(HOSTILE[1], HOSTILE[:4]), encoding="utf-8")
    write_package(generate(read_system(path, Options("symbolic")), ["autograd"]), tmp_path / "hostile")
    robot = import_package(tmp_path / "hostile").load("autograd")
    graph = overlay(robot, 0, 3, robot.graph_parts(0, 3))
    files = graph_files(graph, ["svg", "graphml"])
    assert b"hostile" not in files["tau_1_4.svg"]
    assert files["tau_1_4.svg"].count(b'class="node"') == len(folded(graph).nodes) + len(graph.parts) + 1
    assert len(networkx.parse_graphml(files["tau_1_4.graphml"].decode())) == len(graph.nodes)


def test_without_graphviz_one_line_says_what_to_do(
    package_of: Packages, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")
    robot = package_of("planar3").load("autograd")
    graph = overlay(robot, 0, 0, robot.graph_parts(0, 0))
    with pytest.raises(LinkwiseError, match="install Graphviz, or take --format dot, graphml or json"):
        graph_files(graph, ["svg"])


@pytest.fixture
def command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """Call `linkwise graph`: exit status, what it printed, what it complained."""

    def call(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["linkwise", "graph", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        status: Any = ended.value.code
        return (status, *capsys.readouterr())

    return call


Command = Callable[..., tuple[int, str, str]]


def test_the_command_counts_and_writes(
    directory_of: Callable[[str], Path], package_of: Packages, command: Command, tmp_path: Path
) -> None:
    robot = package_of("planar3").load("autograd")
    part, whole = (len(graph.operations) for graph in (robot.graph(0, 1, 1, 2), robot.graph(0, 1)))
    asked = ("--joint", "1", "--link", "link2", "--coordinate", "joint2", "--order", "2", "--format", "dot")
    status, told, complaint = command(str(directory_of("planar3")), *asked, "--out", str(tmp_path / "out"))
    assert (status, complaint) == (0, "")
    rows = [line.split()[:4] for line in told.splitlines()]
    assert ["c2_1,2,2", "q̈_2", str(part), str(part)] in rows
    assert ["τ_1,2", "unsplit", str(whole)] in rows
    assert "all parts" not in told, "there is one"
    through = {node.key for node in robot.graph(0, 2).operations}
    there = sum(node.key in through for node in robot.graph(0, 1, 1, 2).operations)
    beside = [row for row in told.splitlines() if row.endswith(" too")]
    assert beside == [f"{there} of these operations are in the torque through link3 too"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["tau_1_2_qdd_2.dot"]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--joint", "4"), "--joint '4' is not there; choose 1..3"),
        (("--joint", "2", "--link", "1"), "through link link1 has no such part: it is always zero"),
        (("--order", "3"), "--order '3' is not there; choose among all, 0, 1, 2"),
        (("--format", "pdf"), "--format 'pdf' is not there; choose among svg, png, dot, graphml, json"),
    ],
)
def test_a_mistake_is_one_line(
    arguments: tuple[str, ...],
    complaint: str,
    directory_of: Callable[[str], Path],
    command: Command,
    tmp_path: Path,
) -> None:
    status, told, said = command(str(directory_of("planar3")), *arguments, "--out", str(tmp_path / "out"))
    assert (status, told, said.count("\n")) == (2, "", 1)
    assert complaint in said
    assert not (tmp_path / "out").exists()


def test_a_package_without_autograd_is_told_how_to_get_it(command: Command, tmp_path: Path) -> None:
    write_package(generate(read_system("planar1"), ["numpy"]), tmp_path / "arm")
    status, _, said = command(str(tmp_path / "arm"))
    assert status == 2
    assert "generate it with --backend autograd" in said


REPORTS = " ".join((Path(__file__).parents[2] / "docs/reports.md").read_text(encoding="utf-8").split())


def test_the_reduction_in_nodes_of_the_graph() -> None:
    """One joint, counted by hand: (m r² + I) q̈ is one product, m g r cos q a cosine and one, and a sum is
    left."""
    arm = rigid_system(read_robot("planar10", Options("symbolic")))
    pairs = list(recorded_operations(arm, 10, silent))
    assert (pairs[0].total, pairs[0].kept) == (4, 1)
    stated = re.search(
        r"equal ones counted once, the part saves (\d+) % at 10 joints, which tends to ([\d.]+) % with more; "
        r"of torch's own nodes, ([\d,]+) for the torque and (\d+) for its part, it saves (\d+) %",
        REPORTS,
    )
    assert stated is not None
    nodes = pairs[9].nodes
    assert [f"{nodes.total:,}", str(nodes.kept)] == [stated[3], stated[4]]
    assert round(100 * nodes.reduction) == int(stated[5])
    assert round(100 * pairs[9].reduction) == int(stated[1])
    total, kept = (count_polynomial([getattr(p, name) for p in pairs[1:]]) for name in ("total", "kept"))
    assert total is not None
    assert kept is not None
    assert round(float(100 * (1 - kept.leading / total.leading)), 1) == float(stated[2])


def test_the_page_says_how_much_of_torchs_own_graph_is_shown(package_of: Packages) -> None:
    page = " ".join((Path(__file__).parents[2] / "docs/graphs.md").read_text(encoding="utf-8").split())
    robot = package_of("planar3").load("autograd")
    own = robot.graph(0, 1).recorded(*torch.full((3, 3), 0.3, dtype=torch.float64))
    found = re.findall(r"τ_12 takes (\d+) operations so\. Torch's own graph .*? has (\d+) nodes", page)[0]
    assert (len(robot.graph(0, 1).operations), len(own)) == tuple(map(int, found))
    part, parts = re.findall(r"The part of q̈₂ takes (\d+) of (\d+) operations", page)[0]
    drawn = {operation.key for each in robot.graph_parts(0, 1) for operation in each.operations}
    assert (len(robot.graph(0, 1, 1, 2).operations), len(drawn)) == (int(part), int(parts))


def test_the_page_shows_the_nodes_where_they_were_counted() -> None:
    arm = rigid_system(read_robot("planar3", Options("symbolic")))
    result = study("arm", arm, 2, 3, 3, 10**6, silent, graphs=True)
    two, three = result.recorded
    page, data = reduction_markdown(result), reduction_json(result)
    assert f"| 3 | {three.total} | {three.kept} | {three.reduction:.4f} |" in page
    assert f"takes for τ_1 at 3 DoF, equal ones counted once, its q̈_1 part needs {three.kept}" in page
    nodes = f"0.76 at 2 DoF ({two.nodes.total} and {two.nodes.kept}), 0.77 at 3 DoF ({three.nodes.total} and "
    assert nodes in page
    assert data["recorded"]["points"][1]["kept_nodes"] == three.nodes.kept
    assert [(row["dof"], row["operations"], row["kept"]) for row in data["recorded"]["points"]] == [
        (2, two.total, two.kept),
        (3, three.total, three.kept),
    ]
