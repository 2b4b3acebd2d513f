"""Standard deviations of shares against draws of bodies, whose torques are Pinocchio's."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, PANDA
from helpers.answers import random_states
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

pytest.importorskip("pinocchio")

import pinocchio as pin
from numeric import oracle_models
from numeric.pinocchio_model import PinocchioModel

DRAWS, STATES = 20_000, 3
CRANE = DATA / "crane.urdf"
ROBOTS = ["planar3", "puma560", str(PANDA), str(CRANE)]
"""Two tables, an arm of a file, and a tree on a floating base, in which joints follow others."""


class Oracle:
    """Pinocchio's torques of bodies that are drawn, link by link."""

    def __init__(self, robot: str, package: ModuleType) -> None:
        own = package.tree.TREE
        if robot == str(CRANE):
            options = Options(base="floating")
            whole = PinocchioModel(CRANE, read_system(CRANE, options), True)
            self.model, self.n, self.state, self.tie = whole.model, whole.n, whole._state, whole.tie
        else:
            made = {"planar3": oracle_models.planar3, "puma560": oracle_models.puma560}
            self.model = made[robot]() if robot in made else oracle_models.panda(PANDA)
            self.n, self.tie = self.model.nv, np.eye(self.model.nv)
            self.state = lambda *motion: motion
        self.data = self.model.createData()
        self.bodies = [self.model.getJointId(own.joints[link.joint].name) for link in own.links]

    def rows(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Y (n, N, 10) in the frames of Pinocchio's joints."""
        full = pin.computeJointTorqueRegressor(self.model, self.data, *self.state(q, qd, qdd))
        return (self.tie.T @ full).reshape(self.n, -1, 10)[:, [at - 1 for at in self.bodies]]

    def shares(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, Any, Any]:
        """Y of c2_ijk qdd_k and c1_ijk qd_k (n, N, n, 10) and of g_ij (n, N, 10), by differences."""
        rest, units = np.zeros(self.n), np.eye(self.n)
        weight, speed = self.rows(q, rest, rest), self.rows(q, qd, rest)
        c2 = np.stack([self.rows(q, rest, e) - weight for e in units], 2)
        # 1/2 dh/dqd_k = 1/2 (h(qd + e_k) - h(qd) - h(e_k)) of an h that is quadratic
        faster = [self.rows(q, qd + e, rest) - self.rows(q, e, rest) for e in units]
        c1 = np.stack([0.5 * (f - speed + weight) for f in faster], 2)
        return c2 * qdd[:, None], c1 * qd[:, None], weight

    def drawn(self, given: UncertainBodies, seed: int) -> Any:
        """Parameters of all links, (draws, N, 10), by the law that docs/method.md states."""
        draw, count = np.random.default_rng(seed), len(self.bodies)
        together = np.eye(count) if given.correlation is None else np.array(given.correlation)
        own = draw.multivariate_normal(np.zeros(count), together, DRAWS) * given.masses
        whole = 1.0 + given.body_mass * draw.normal(size=(DRAWS, 1)) * given.segments
        every = []
        for j, at in enumerate(self.bodies):
            inertia = self.model.inertias[at]
            m = np.full(DRAWS, inertia.mass)
            c = inertia.lever + given.centres[j] * draw.normal(size=(DRAWS, 3))
            moments = inertia.inertia
            plain = np.abs(moments - np.diag(np.diag(moments))).max() < 1e-9 * np.abs(moments).max()
            principal, axes = (np.diag(moments), np.eye(3)) if plain else np.linalg.eigh(moments)
            longer = 1.0 + given.radii[j] * draw.normal(size=(DRAWS, 3))
            i = np.einsum("dx,ax,bx->dab", longer**2 * principal, axes, axes)
            i += inertia.mass * (c**2).sum(1)[:, None, None] * np.eye(3)
            i -= inertia.mass * c[:, :, None] * c[:, None]
            entries = [i[:, a, b] for a, b in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
            heavier = (whole * (1.0 + own))[:, j, None]
            every.append(heavier * np.stack([m, *(m * x for x in c.T), *entries], 1))
        return np.stack(every, 1)


@pytest.fixture(scope="module")
def package_at(
    tmp_path_factory: pytest.TempPathFactory, package_of: Callable[[str], ModuleType]
) -> Callable[[str], ModuleType]:
    """Package of a robot, the crane on a floating base."""

    def make(robot: str) -> ModuleType:
        if robot != str(CRANE):
            return package_of(robot)
        folder = tmp_path_factory.mktemp("floating") / "crane"
        system = read_system(CRANE, Options(base="floating"))
        write_package(generate(system, ["numpy"], "crane", kernel="loops"), folder)
        return import_package(folder)

    return make


def uncertain(count: int) -> UncertainBodies:
    """Masses that go together, and everything else on its own."""
    draw = np.random.default_rng(5)
    mixed = draw.normal(size=(count, 2 * count))
    scale = np.sqrt((mixed**2).sum(1))
    correlation = mixed @ mixed.T / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    some = draw.integers(0, 2, count)
    return UncertainBodies(
        draw.uniform(0.05, 0.15, count),
        draw.uniform(0.003, 0.02, (count, 3)),
        draw.uniform(0.05, 0.15, count),
        0.08,
        some,
        correlation,
    )


def agree(found: Any, drawn: Any) -> None:
    """Hold deviations to those of draws: within 5 % for 95 % of entries, within 20 % where they count."""
    found, drawn = np.ravel(found), np.ravel(drawn)
    there = drawn > 1e-10 * drawn.max()  # off the path, and where only rounding is
    assert found[~there].max(initial=0.0) <= 1e-10 * drawn.max()
    apart = np.abs(found[there] / drawn[there] - 1.0)
    assert np.quantile(apart, 0.95) <= 0.05
    assert apart[drawn[there] > 1e-3 * drawn.max()].max() <= 0.20


@pytest.mark.parametrize("robot", ROBOTS, ids=["planar3", "puma560", "panda", "crane"])
def test_deviations_are_those_of_drawn_bodies(robot: str, package_at: Callable[[str], ModuleType]) -> None:
    package = package_at(robot)
    dynamics, oracle = package.load("numpy"), Oracle(robot, package)
    given, motion = uncertain(dynamics.N), random_states(dynamics.n, STATES)
    found, drawn = dynamics.uncertainty(*motion, given), oracle.drawn(given, 1)
    for s in range(STATES):
        q, qd, qdd = (a[s] for a in motion)
        c2, c1, g = oracle.shares(q, qd, qdd)
        whole = oracle.rows(q, qd, qdd)

        def spread(rows: Any, links: bool = False) -> Any:
            values = np.einsum("ij...p,djp->dij...", rows, drawn, optimize=True)
            return (values if links else values.sum(2)).std(0)

        agree(found.torque[s], spread(whole, True))
        agree(found.acceleration[s], spread(c2, True))
        agree(found.velocity[s], spread(c1, True))
        agree(found.gravity[s], spread(g, True))
        agree(found.joint_torque[s], spread(whole))
        agree(found.joint_acceleration[s], spread(c2))
        agree(found.joint_velocity[s], spread(c1))
        agree(found.joint_gravity[s], spread(g))
        agree(found.joint_power[s], spread(whole) * np.abs(qd))
        agree(found.power[s], spread(whole, True) * np.abs(qd)[:, None])
        agree(found.c1[s] * np.abs(qd), spread(c1, True))
