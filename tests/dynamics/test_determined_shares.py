"""Shares that joint torques determine, whatever links weigh: docs/method.md says it with these numbers."""

from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from helpers.answers import random_states
from house.test_stated_figures import stated

Packages = Callable[[str], ModuleType]
NOTHING = 1e-10
"""Share below which a number is rounding."""
MOTION = np.array([[0.3, 0.5, -0.2], [1.0, 0.0, 2.0], [0.0, 0.0, 5.0]])
"""The README's."""


class Determined:
    """The row space of the map from all inertial parameters to the joint torques of random motions."""

    def __init__(self, robot: Any) -> None:
        self.motion = random_states(robot.n, 20 * robot.n)
        self.torques = robot.regressor(*self.motion)
        _, sizes, axes = np.linalg.svd(self.torques.reshape(-1, 10 * robot.N), full_matrices=False)
        self.axes = axes[sizes > NOTHING * sizes[0]]

    def has(self, rows: Any) -> bool:
        """Return whether these (samples, N, 10), one for each motion, are combinations of torques."""
        flat = rows.reshape(len(rows), -1)
        left = flat - flat @ self.axes.T @ self.axes
        return bool(abs(left).max() <= NOTHING * abs(flat).max())


def shares(rows: Any) -> Iterator[Any]:
    """Return the rows (samples, …, N, 10) of one link each that are not zero, and the other links' left
    out."""
    samples, links = len(rows), rows.shape[-2]
    for each in np.moveaxis(rows.reshape(samples, -1, links, 10), 1, 0):
        for j in range(links):
            if abs(each[:, j]).max() > NOTHING:
                yield np.where(np.arange(links)[:, None] == j, each, 0.0)


@pytest.mark.parametrize("name", ["planar3", "puma560"])
def test_joint_torques_determine_few_shares_by_link_and_all_sums(name: str, package_of: Packages) -> None:
    robot = package_of(name).load("numpy")
    known = Determined(robot)
    c2, c1, g = robot.coefficient_regressors(*known.motion[:2])
    torques = list(shares(known.torques))
    # (samples, i, k, j, 10): of each pair of joints a row by link
    causes = [rows for c in (c2, c1) for rows in shares(np.moveaxis(c, 3, 2))]
    said = stated(rf"\| `{name}` \| (\d+) of (\d+) \| (\d+) of (\d+) \| all \|")
    counts = (sum(map(known.has, torques)), len(torques), sum(map(known.has, causes)), len(causes))
    assert counts == said
    for whole in (known.torques, np.moveaxis(c2, 3, 2), np.moveaxis(c1, 3, 2), g):
        rows = whole.reshape(len(whole), -1, robot.N, 10)
        assert all(known.has(rows[:, k]) for k in range(rows.shape[1]) if abs(rows[:, k]).max() > NOTHING)


def spread(place: Any) -> Any:
    """The inertia of a unit point mass about the origin."""
    return place @ place * np.eye(3) - np.outer(place, place)


def test_mass_that_changes_links_at_a_joint_changes_shares_and_no_torque(package_of: Packages) -> None:
    package = package_of("planar3")
    given, (mass,) = package.load("numpy"), stated(r"(\d\.\d+) kg taken from link 3 of `planar3`")
    masses, centres, inertias = (np.array(part) for part in package.bodies())
    for link, place, more in ((1, np.array([0.25, 0.0, 0.0]), mass), (2, np.zeros(3), -mass)):
        about = inertias[link] + masses[link] * spread(centres[link]) + more * spread(place)
        centres[link] = (masses[link] * centres[link] + more * place) / (masses[link] + more)
        masses[link] += more
        inertias[link] = about - masses[link] * spread(centres[link])
        moments = np.linalg.eigvalsh(inertias[link])
        assert moments[0] >= 0
        assert moments[2] <= moments[:2].sum() * (1 + 1e-12)  # a body can have them
    moved = package.load("numpy", bodies=package.Bodies(masses, centres, inertias))
    motion = random_states(given.n, 50)
    torque = given.inverse_dynamics(*motion)
    np.testing.assert_allclose(moved.inverse_dynamics(*motion), torque, rtol=0, atol=1e-13)
    before, after = (robot.partial_torque(*MOTION) for robot in (given, moved))
    assert stated(r"τ_12 goes from (\d\.\d+) to (\d\.\d+) N m") == (
        round(before[0, 1], 3),
        round(after[0, 1], 3),
    )
    assert stated(r"τ_13 from (\d\.\d+) to (\d\.\d+)") == (round(before[0, 2], 3), round(after[0, 2], 3))


def test_at_the_order_of_position_terms_of_motion_do_not_vanish(package_of: Packages) -> None:
    robot = package_of("planar3").load("numpy")
    slope, at_rest = (
        robot.position_gradient(*motion)[0, 2, 2] for motion in (MOTION, MOTION * [[1], [0], [0]])
    )
    assert stated(r"∂τ_13/∂q_3 is (−\d\.\d+) where gravity's is (−\d\.\d+)") == (
        round(slope, 3),
        round(at_rest, 3),
    )
