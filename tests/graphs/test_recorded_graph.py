"""Torch's own graph of a torque: every node that a walk along `grad_fn` meets."""

import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from helpers.answers import random_states
from helpers.command_line import run_linkwise

torch = pytest.importorskip("torch")


def walked(value: Any) -> dict[str, int]:
    """Torch's names of the nodes behind a value."""
    seen, waiting = set(), [value.grad_fn]
    while waiting:
        node = waiting.pop()
        if node not in seen:
            seen.add(node)
            waiting += [one for one, _ in node.next_functions if one is not None]
    return Counter(node.name() for node in seen)


@pytest.mark.parametrize(("robot", "through"), [("planar3", 1), ("planar3", None), ("torso", 4)])
def test_it_has_the_nodes_of_a_walk(
    robot: str, through: int | None, package_of: Callable[[str], ModuleType]
) -> None:
    model = package_of(robot).load("autograd", requires_grad="mass")
    motion = [torch.from_numpy(a[0]) for a in random_states(model.n, 1)]
    leaves = [a.clone().requires_grad_() for a in motion]
    tau = model.partial_torque(*leaves)
    found = model.graph(0, through).recorded(*motion)
    expected = tau[..., 0, list(range(tau.shape[-1]))].sum(-1) if through is None else tau[..., 0, through]
    assert found.counts() == walked(expected)
    assert all(operand < at for at, node in enumerate(found.nodes) for operand in node.operands)
    named = {node.leaf for node in found.nodes if node.leaf}
    assert {"q", "qd", "qdd"} < named
    assert all(name.split(".")[-1] == "mass" for name in named - {"q", "qd", "qdd"})


def test_a_part_of_a_torque_has_none(package_of: Callable[[str], ModuleType]) -> None:
    model = package_of("planar3").load("autograd")
    motion = [torch.zeros(3, dtype=torch.float64)] * 3
    with pytest.raises(ValueError, match="none answers a part of a torque alone"):
        model.graph(0, 1, k=1, m=2).recorded(*motion)


def test_the_command_tells_and_writes_it(directory_of: Callable[[str], Path], tmp_path: Path) -> None:
    options = ("--joint", "1", "--link", "2", "--recorded", "--format", "json", "--format", "dot")
    done = run_linkwise("graph", directory_of("planar3"), *options, "--out", "out", folder=tmp_path)
    assert "torch itself recorded 286 nodes for τ_1,2" in done.stdout
    data = json.loads((tmp_path / "out/tau_1_2_recorded.json").read_text())
    assert len(data["nodes"]) == 286
    assert (tmp_path / "out/tau_1_2_recorded.dot").read_text().count("tooltip") == 286
    assert (tmp_path / "out/tau_1_2.json").exists()
