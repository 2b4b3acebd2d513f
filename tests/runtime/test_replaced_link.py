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
    with pytest.raises(TypeError, match="Slow, is no quadratic form of the velocities"):
        robot.links[1] = Slow()
    with pytest.raises(TypeError, match=r"kinetic answers with shape \(\) where each"):
        robot.links[1] = Summed()
    with pytest.raises(ValueError, match="elbow"):
        robot.links["elbow"] = Learned()


class Odd(Learned):
    """A kinetic energy that is no quadratic form of the velocities, unless its weight is zero."""

    def __init__(self, odd: Callable[[Any, Any], Any], weight: float = 0.0) -> None:
        super().__init__()
        self.odd, self.weight = odd, torch.nn.Parameter(torch.tensor(weight, dtype=torch.float64))

    def kinetic(self, q: Any, qd: Any, p: Any) -> Any:
        return super().kinetic(q, qd, p) + self.weight * self.odd(q, qd)


ODD: dict[str, Callable[[Any, Any], Any]] = {
    "of degree two, but no form": lambda q, qd: qd[0] ** 4 / (qd[0] ** 2 + qd[1] ** 2),
    "of sizes": lambda q, qd: abs(qd[0]) * abs(qd[1]),
    "to one side": lambda q, qd: torch.relu(-qd[0]) ** 4,
    "at some places": lambda q, qd: torch.relu(-q[0]) * qd[0] ** 4,
    "of degree one": lambda q, qd: qd[0] * q[0],
}


@pytest.mark.parametrize("odd", ODD)
def test_kinetic_energy_that_training_makes_odd_is_refused_where_shares_are_asked_for(
    odd: str, package_of: Packages, motion: Any
) -> None:
    robot = package_of("planar3").load("autograd")
    with pytest.raises(TypeError, match="is no quadratic form of the velocities"):
        robot.links["link2"] = Odd(ODD[odd], 0.1)
    robot.links["link2"] = learned = Odd(ODD[odd])
    robot.propagation(*motion)
    with torch.no_grad():
        learned.weight.fill_(0.1)
    assert robot.partial_torque(*motion).isfinite().all()
    q, qd, _ = motion
    calls = [(robot.propagation, motion), (robot.coefficients, (q, qd)), (robot.forward_dynamics, motion)]
    for call, given in calls:
        with pytest.raises(ValueError, match="of a replaced link, Odd, is no quadratic form"):
            call(*given)


class Detached(Learned):
    def potential(self, q: Any, p: Any) -> Any:
        return super().potential(q, p).detach()


class OfNumPy(Learned):
    def potential(self, q: Any, p: Any) -> Any:
        return q[0].detach().numpy() ** 2


class OfNothing(Learned):
    def potential(self, q: Any, p: Any) -> Any:
        return None


@pytest.mark.parametrize(
    ("module", "told"),
    [
        (Detached, "potential changes with the motion, but torch cannot differentiate it by q"),
        (OfNumPy, "potential answers with ndarray; give a tensor"),
        (OfNothing, "potential answers with NoneType; give a tensor"),
    ],
)
def test_energies_without_a_slope_are_refused(module: type, told: str, package_of: Packages) -> None:
    robot = package_of("planar3").load("autograd")
    with pytest.raises(TypeError, match=told):
        robot.links["link2"] = module()


def test_a_robot_at_other_values_keeps_its_modules_and_what_was_learned(
    package_of: Packages, motion: Any
) -> None:
    robot = package_of("planar3 symbolic").load("autograd", requires_grad=True)
    robot.links["link2"] = spring = Sprung(robot.links["link2"], 3.0)
    with torch.no_grad():
        robot.values["m_3"].mul_(1.5)
    heavy = robot.at(m_1=2.0)
    fresh = package_of("planar3 symbolic").load(
        "autograd", parameters={"m_1": 2.0, "m_3": robot.values["m_3"].item()}
    )
    expected = fresh.partial_torque(*motion)
    expected[:, 1, 1] += 3.0 * motion[0][:, 1]
    found = heavy.partial_torque(*motion)
    assert relative_error(found.detach(), expected) <= 1e-13
    alone = heavy.links["link1"].torque(*motion)
    assert relative_error(alone.detach(), expected[..., 0]) <= 1e-13, "a link alone has the values too"
    found.sum().backward()
    assert spring.stiffness.grad is not None
    assert robot.values["m_3"].grad is not None
    assert robot.values["m_1"].grad is None, "another value stands there"


def test_the_packages_own_module_undoes_a_replacement(package_of: Packages, motion: Any) -> None:
    robot, before = (package_of("planar3").load("autograd") for _ in range(2))
    own = robot.links["link2"]
    robot.links.link2 = Learned()
    assert isinstance(robot.links["link2"].module, Learned)
    robot.links["link2"] = own
    assert list(robot.state_dict()) == list(before.state_dict())
    assert torch.equal(robot.partial_torque(*motion), before.partial_torque(*motion))
    with pytest.raises(AttributeError, match=r"one by one: robot.links\[j\] = module"):
        robot.links = torch.nn.ModuleList()
