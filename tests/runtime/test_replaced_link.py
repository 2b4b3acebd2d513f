"""A link whose energies are those of a module of the user's: one that is learned, say."""

import copy
from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest
from helpers.answers import random_states, relative_error

torch = pytest.importorskip("torch")
Packages = Callable[[str], ModuleType]


class Sprung(torch.nn.Module):  # type: ignore[misc]
    """A link with a spring between it and the one before, whose stiffness is learned."""

    def __init__(self, own: Any, stiffness: float = 0.0) -> None:
        super().__init__()
        self.own, self.stiffness = own, torch.nn.Parameter(torch.tensor(stiffness, dtype=torch.float64))

    def kinetic(self, q: Any, qd: Any, p: Any) -> Any:
        return self.own.kinetic(q, qd, p)

    def potential(self, q: Any, p: Any) -> Any:
        return self.own.potential(q, p) + self.stiffness * q[1] ** 2 / 2


class Learned(torch.nn.Module):  # type: ignore[misc]
    """A link whose mass matrix and potential are networks of its two angles."""

    def __init__(self) -> None:
        super().__init__()
        self.layers = torch.nn.Sequential(
            torch.nn.Linear(2, 8), torch.nn.Tanh(), torch.nn.Linear(8, 4)
        ).double()

    def kinetic(self, q: Any, qd: Any, p: Any) -> Any:
        a, b, c, _ = self.layers(torch.stack([q[0], q[1]], -1)).unbind(-1)
        return (a * qd[0] + b * qd[1]) ** 2 + (c * qd[1]) ** 2

    def potential(self, q: Any, p: Any) -> Any:
        return self.layers(torch.stack([q[0], q[1]], -1))[..., 3]


class Summed(Learned):
    """Energy of all samples in one, from which no sample has its own."""

    def kinetic(self, q: Any, qd: Any, p: Any) -> Any:
        return (qd[0] ** 2).sum()


class Slow(Learned):
    def kinetic(self, q: Any, qd: Any, p: Any) -> Any:
        return qd[0] ** 4


@pytest.fixture
def motion() -> list[Any]:
    return [torch.from_numpy(a) for a in random_states(3, 12)]


def test_torques_and_shares_follow_and_other_links_stay(
    package_of: Callable[[str], ModuleType], motion: Any
) -> None:
    robot, before = (package_of("planar3").load("autograd") for _ in range(2))
    robot.links["link2"] = Sprung(robot.links["link2"], 3.0)
    spring = robot.partial_torque(*motion) - before.partial_torque(*motion)
    expected = torch.zeros_like(spring)
    expected[:, 1, 1] = 3.0 * motion[0][:, 1]
    assert relative_error(spring.detach(), expected) <= 1e-14
    assert (
        relative_error(
            (robot.propagation(*motion).gravity - before.propagation(*motion).gravity).detach(), expected
        )
        <= 1e-14
    )
    graph = robot.graph("joint2", "link2")
    assert (
        relative_error(graph.evaluate(*motion).detach(), robot.partial_torque(*motion)[:, 1, 1].detach())
        <= 1e-13
    )
    again = copy.deepcopy(robot)
    assert torch.equal(again.partial_torque(*motion), robot.partial_torque(*motion))
    assert "links.link2.module.stiffness" in robot.state_dict()
    poses = robot.kinematics.poses(motion[0])
    assert torch.equal(poses, before.kinematics.poses(motion[0]))


def test_a_spring_is_learned_from_torques(package_of: Packages, motion: Any) -> None:
    robot, before = (package_of("planar3").load("autograd") for _ in range(2))
    measured = before.inverse_dynamics(*motion).detach()
    measured[:, 1] += 7.5 * motion[0][:, 1]
    robot.links[1] = Sprung(robot.links[1])
    optimiser = torch.optim.LBFGS(robot.parameters(), max_iter=20, line_search_fn="strong_wolfe")

    def loss() -> Any:
        optimiser.zero_grad()
        found = ((robot.inverse_dynamics(*motion) - measured) ** 2).mean()
        found.backward()
        return found

    optimiser.step(loss)
    assert abs(robot.links[1].module.stiffness.item() - 7.5) <= 1e-6


def test_a_network_is_a_link_whose_parts_sum_to_its_torque(
    package_of: Callable[[str], ModuleType], motion: Any
) -> None:
    robot = package_of("planar3").load("autograd")
    torch.manual_seed(1)
    robot.links[1] = Learned()
    parts, tau = robot.propagation(*motion), robot.partial_torque(*motion)
    total = parts.acceleration.sum(-1) + parts.velocity.sum(-1) + parts.gravity
    assert relative_error(total.detach(), tau.detach()) <= 1e-12
    energy, link = robot.energy(*motion[:2]), robot.links[1].module
    alone = link.kinetic(*(part.unbind(-1) for part in motion[:2]), {})
    assert relative_error(energy.kinetic[:, 1].detach(), alone.detach()) <= 1e-14
    compiled = []

    def kept(graph: Any, _: Any) -> Any:
        compiled.append(graph)
        return graph.forward

    torch._dynamo.reset()
    run = torch.compile(robot.partial_torque, fullgraph=True, backend=kept)
    for _ in range(2):
        assert relative_error(run(*motion).detach(), tau.detach()) <= 1e-12
    assert len(compiled) == 1


def test_what_is_no_link_is_refused(package_of: Packages) -> None:
    robot = package_of("planar3").load("autograd")
    with pytest.raises(TypeError, match="this is Linear without kinetic and potential"):
        robot.links[1] = torch.nn.Linear(2, 2)
    with pytest.raises(TypeError, match="not of degree two in the velocities"):
        robot.links[1] = Slow()
    with pytest.raises(TypeError, match=r"kinetic answers with shape \(\) where each"):
        robot.links[1] = Summed()
    with pytest.raises(ValueError, match="elbow"):
        robot.links["elbow"] = Learned()
