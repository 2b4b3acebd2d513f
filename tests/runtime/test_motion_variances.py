"""Deviations by uncertain motion from the compiled C against those of NumPy, which perturbs shares."""

from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from helpers.answers import random_states
from helpers.urdf_text import chain, joint, mimic
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies
from linkwise_runtime.native import motion_variances

pytestmark = needs_compiler

FOLLOWED = chain(
    joint("ab", "a", "b"),
    joint("bc", "b", "c", type="prismatic"),
    joint("cd", "c", "d", inner=mimic("ab", -0.7)),
    joint("de", "d", "e"),
)
"""An arm with a slide, in which a joint follows another of its own path."""
ROBOTS = {
    "straight": ("puma560", {}, "straight"),
    "loops": ("puma560", {}, "loops"),
    "symbolic": ("planar3", {"parameters": "symbolic"}, "auto"),
    "floating tree": (str(DATA / "crane.urdf"), {"base": "floating"}, "loops"),
    "followers": (FOLLOWED, {}, "auto"),
}
"""Robots, how they are read, and their kernels."""


@pytest.fixture(scope="module", params=ROBOTS)
def package(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    robot, how, kernel = ROBOTS[request.param]
    folder = tmp_path_factory.mktemp("moved")
    if robot is FOLLOWED:
        (folder / "arm.urdf").write_text(FOLLOWED)
        robot = str(folder / "arm.urdf")
    system = read_system(robot, Options(**how))
    write_package(generate(system, ["numpy", "native"], "moved", kernel=kernel), folder / "moved")
    return import_package(folder / "moved")


def covariances(n: int, samples: int, rank: int | None = None) -> Any:
    """A covariance of q, qd and qdd for each sample, of this rank; some of them leave positions alone."""
    size = 3 * n
    root = 0.1 * np.random.default_rng(3).normal(size=(samples, size, size if rank is None else rank))
    root[::3, :n] = 0.0
    root[::4, : 2 * n] = 0.0
    root[1::5, n - 1 :: n] = 0.0
    return root @ root.mT


def agree(found: Any, expected: Any, error: float = 1e-12) -> None:
    """Squares agree but for `error` of the largest of each kind."""
    for name, own, other in zip(expected._fields, found, expected, strict=True):
        own, other = np.asarray(own, float) ** 2, np.asarray(other, float) ** 2
        assert own.shape == other.shape, name
        assert np.abs(own - other).max(initial=0.0) <= error * other.max(initial=0.0), name


@pytest.mark.parametrize("batch", [(), (1,), (8,), (19,), (2, 7)])
def test_c_answers_as_perturbed_shares_do(batch: tuple[int, ...], package: ModuleType) -> None:
    own, other = package.load("native"), package.load("numpy")
    samples = int(np.prod(batch))
    motion = [a.reshape(*batch, -1) for a in random_states(own.n, samples)]
    for rank in (None, 2, 0):
        given = covariances(own.n, samples, rank).reshape(*batch, 3 * own.n, 3 * own.n)
        agree(own.uncertainty(*motion, motion=given), other.uncertainty(*motion, motion=given))
    same = covariances(own.n, 2)[1]
    agree(own.uncertainty(*motion, motion=same), other.uncertainty(*motion, motion=same))
    bodies = UncertainBodies(0.1, 0.01, 0.1, 0.05)
    both = own.uncertainty(*motion, bodies, same)
    agree(both, other.uncertainty(*motion, bodies, same))


def test_many_samples_go_in_pieces_on_threads(package: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    own = package.load("native")
    motion, given = random_states(own.n, 75), covariances(own.n, 75)
    whole = own.uncertainty(*motion, motion=given)
    one = own.uncertainty(*motion, motion=given[1])
    own.backend.threads = 3
    monkeypatch.setattr(motion_variances, "AT_ONCE", 40)
    monkeypatch.setattr("linkwise_runtime.native.calls.PER_THREAD", 1)
    agree(own.uncertainty(*motion, motion=given), whole, 0.0)
    agree(own.uncertainty(*motion, motion=given[1]), one, 0.0)
    nothing = own.uncertainty(*(a[:0] for a in motion), motion=given[1])
    assert nothing.c2.shape == (0, own.n, own.N, own.n)


def test_single_precision_has_its_own_blocks(package: ModuleType) -> None:
    own = package.load("native")
    motion, given = random_states(own.n, 21), covariances(own.n, 21)
    found = own.uncertainty(*(a.astype(np.float32) for a in motion), motion=given)
    assert found.power.dtype == np.float32
    agree(found, own.uncertainty(*motion, motion=given), 1e-4)


def test_only_what_is_asked_for_is_answered(package: ModuleType) -> None:
    own = package.load("native")
    motion, roots = random_states(own.n, 5), np.eye(3 * own.n)[None]
    found = own.backend.motion_variances(motion, roots, ["torque", "joint_motion"])
    assert set(found) == {"torque", "joint_motion"}
    assert found["torque"].shape == (len(own.layout.torque), 5)
    assert found["joint_motion"].shape == (3 * own.n, 5)
    assert package.load("numpy").backend.motion_variances(motion, roots, ["torque"]) is None


def test_torques_vary_with_the_motion_of_their_joints_as_differences_do(package: ModuleType) -> None:
    """Covariances that need no recursion: of a root in which every direction moves all that there is."""
    own, other = package.load("native"), package.load("numpy")
    (q, qd, qdd), n = random_states(own.n, 4), own.n
    root = 0.1 * np.random.default_rng(4).normal(size=(4, 3 * n, 3 * n))
    found = own.backend.motion_variances((q, qd, qdd), root, ["joint_motion"])["joint_motion"]
    expected = np.zeros((4, 3, n))
    for direction in np.moveaxis(root, -1, 0):
        by = direction.reshape(4, 3, n)
        ahead, behind = (
            other.inverse_dynamics(*(a + sign * 3**0.5 * by[:, x] for x, a in enumerate((q, qd, qdd))))
            for sign in (1.0, -1.0)
        )
        expected += by * ((ahead - behind) / 12**0.5)[:, None]
    np.testing.assert_allclose(found.T, expected.reshape(4, -1), rtol=0, atol=1e-11 * np.abs(expected).max())
