"""Two derivations of one thing: the rigid-link rule, and Euler–Lagrange on the energy of the same link."""

import numpy as np
import pytest
from answers import random_states, relative_error
from conftest import DATA, LOCKED_FINGERS, PANDA
from evaluation import evaluate
from linkwise import Options, read_system
from linkwise.dynamics.coefficients import LinkForms
from linkwise.dynamics.derive import derive, link_kernel
from linkwise.dynamics.euler_lagrange import euler_lagrange
from linkwise.dynamics.kernel import lowering
from linkwise.expression.count import count_operations
from linkwise.expression.graph import Graph
from linkwise.symbolic.link_energy import lineage, link_energies
from linkwise.symbolic.system import System

BLOCKS = ("acceleration", "velocity", "gravity", "torque", "position_gradient")


def from_the_energy(system: System, link: int) -> tuple[Graph, LinkForms]:
    """Forms by differentiating the link's Lagrangian, its definitions lowered one after another."""
    lower, x = lowering(system)
    for energy in lineage(link_energies(system), link):
        lower.define(energy.twist.definitions)
    kinetic = lower(energy.kinetic)
    for energy in lineage(link_energies(system), link):
        lower.define(energy.height.definitions)
    lagrangian = lower.graph.sub(kinetic, lower(energy.potential))
    return lower.graph, euler_lagrange(lower.graph, lagrangian, system.path(link), x)


def numbers(graph: Graph, forms: LinkForms, block: str, states: list[dict[str, float]]) -> np.ndarray:
    values = getattr(forms, block).values()
    return np.array([evaluate(graph, values, state) for state in states])


@pytest.mark.parametrize("block", BLOCKS)
def test_rigid_link_rule_is_euler_lagrange_of_the_energy(block: str) -> None:
    system = read_system(DATA / "skew.toml")
    states = [
        {
            f"{kind}{k + 1}": row[k]
            for kind, row in zip(("q", "qd", "qdd"), rows, strict=True)
            for k in range(3)
        }
        for rows in zip(*random_states(3, 10), strict=True)
    ]
    by_rule, by_energy = [], []
    for link in range(3):
        kernel = link_kernel(system, link)
        graph, forms = from_the_energy(system, link)
        assert kernel.forms[0].path == forms.path
        by_rule.append(numbers(kernel.graph, kernel.forms[0], block, states))
        by_energy.append(numbers(graph, forms, block, states))
    assert relative_error(np.hstack(by_rule), np.hstack(by_energy)) <= 1e-12


@pytest.mark.parametrize(
    ("robot", "options", "most"),
    [("planar3", Options(), 200), (PANDA, Options(lock=LOCKED_FINGERS), 4700)],
    ids=["planar3", "panda"],
)
def test_full_decomposition_stays_cheap(robot: str, options: Options, most: int) -> None:
    kernels = derive(read_system(robot, options))
    total = sum(count_operations(k.graph, k.forms[0].decomposition()).arithmetic for k in kernels)
    assert total <= most
