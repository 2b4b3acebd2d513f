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

from numeric import oracle_models
from numeric.drawn_bodies import Oracle, agree
from numeric.pinocchio_model import PinocchioModel

STATES = 3
CRANE = DATA / "crane.urdf"
ROBOTS = ["planar3", "puma560", str(PANDA), str(CRANE)]
"""Two tables, an arm of a file, and a tree on a floating base, in which joints follow others."""


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


def oracle_of(robot: str, package: ModuleType) -> Oracle:
    """Pinocchio's model of a robot."""
    made = {
        "planar3": oracle_models.planar3,
        "puma560": oracle_models.puma560,
        str(PANDA): lambda: oracle_models.panda(PANDA),
        str(CRANE): lambda: PinocchioModel(CRANE, read_system(CRANE, Options(base="floating")), True),
    }
    return Oracle(made[robot](), package.tree.TREE)


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


@pytest.mark.parametrize("robot", ROBOTS, ids=["planar3", "puma560", "panda", "crane"])
def test_deviations_are_those_of_drawn_bodies(robot: str, package_at: Callable[[str], ModuleType]) -> None:
    package = package_at(robot)
    dynamics, oracle = package.load("numpy"), oracle_of(robot, package)
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


@pytest.mark.parametrize("robot", ["puma560", str(CRANE)])
def test_any_covariance_of_all_links_counts_as_its_draws_do(
    robot: str, package_at: Callable[[str], ModuleType]
) -> None:
    """Links are as good as opposite to each other, so that sums are far better known than shares."""
    package = package_at(robot)
    dynamics = package.load("numpy")
    own, draw = package.inertial_parameters(package.bodies()), np.random.default_rng(7)
    mixed = draw.normal(size=(10 * dynamics.N, 6))
    factor = 0.1 * (np.abs(own) + 0.01).reshape(-1, 1) * mixed
    motion = random_states(dynamics.n, STATES)
    rows = dynamics.regressor(*motion)
    flat = rows[0].reshape(dynamics.n, -1)
    factor -= np.linalg.pinv(flat, rcond=1e-9) @ (0.99 * flat @ factor)
    covariance = factor @ factor.T
    drawn = draw.multivariate_normal(np.zeros(len(factor)), covariance, 20_000, method="eigh")
    drawn = drawn.reshape(-1, dynamics.N, 10)
    whole = dynamics.uncertainty(*motion, UncertainBodies(parameters=covariance))
    c2, c1, g = dynamics.coefficient_regressors(*motion[:2])
    _, qd, qdd = motion
    for found, y, by in (
        (whole.torque, rows, 1.0),
        (whole.gravity, g, 1.0),
        (whole.acceleration, c2, qdd[:, None, None]),
        (whole.velocity, c1, qd[:, None, None]),
    ):
        shares = np.einsum("sij...p,djp->dsij...", y, drawn, optimize=True)
        agree(found, shares.std(0) * np.abs(by))
    summed = np.einsum("sijp,djp->dsi", rows, drawn, optimize=True).std(0)
    agree(whole.joint_torque, summed)
    assert summed[0].max() < 0.1 * whole.torque[0].max()
    for found, y, by in (
        (whole.joint_acceleration, c2, qdd[:, None]),
        (whole.joint_velocity, c1, qd[:, None]),
    ):
        agree(found, np.einsum("sijkp,djp->dsik", y, drawn, optimize=True).std(0) * np.abs(by))
    agree(whole.joint_gravity, np.einsum("sijp,djp->dsi", g, drawn, optimize=True).std(0))
    # With masses on top, which are independent of them, variances add; a factor says the same.
    masses = uncertain(dynamics.N)
    both = dynamics.uncertainty(
        *motion, masses._replace(parameters=factor.reshape(dynamics.N, 10, -1))
    ).joint_torque
    alone = dynamics.uncertainty(*motion, masses).joint_torque
    np.testing.assert_allclose(both**2, alone**2 + whole.joint_torque**2, rtol=1e-9)


@pytest.mark.parametrize("backend", ["numpy", "torch", "native"])
def test_a_covariance_of_motion_counts_as_its_draws_do(
    backend: str, package_at: Callable[[str], ModuleType]
) -> None:
    package = package_at("puma560")
    dynamics, draw = package.load(backend), np.random.default_rng(5)
    n, motion = dynamics.n, random_states(dynamics.n, 2)
    sizes = np.repeat([3e-3, 5e-2, 1.0], n)
    mixed = draw.normal(size=(2, 3 * n, 3 * n)) * sizes[:, None] / np.sqrt(3 * n)
    covariance = mixed @ mixed.mT
    tensors = pytest.importorskip("torch").tensor if backend == "torch" else np.array
    given = [tensors(a) for a in motion]
    found = dynamics.uncertainty(*given, motion=covariance)
    robot = package.load("numpy")
    for s in range(2):
        noise = draw.normal(size=(20_000, 3 * n)) @ mixed[s].T
        q, qd, qdd = (a[s] + noise[:, k * n : (k + 1) * n] for k, a in enumerate(motion))
        tau, (c2, c1, g) = robot.partial_torque(q, qd, qdd), robot.coefficients(q, qd)
        agree(found.torque[s], tau.std(0))
        agree(found.acceleration[s], (c2 * qdd[:, None, None]).std(0))
        agree(found.velocity[s], (c1 * qd[:, None, None]).std(0))
        agree(found.gravity[s], g.std(0))
        agree(found.joint_torque[s], tau.sum(-1).std(0))
        agree(found.joint_velocity[s], (c1 * qd[:, None, None]).sum(2).std(0))
        agree(found.power[s], (tau * qd[:, :, None]).std(0))
    bodies = UncertainBodies(0.1)
    both, alone = (dynamics.uncertainty(*given, bodies, one).torque for one in (covariance, None))
    np.testing.assert_allclose(both**2, alone**2 + found.torque**2, rtol=1e-9)


def test_at_rest_products_deviate_by_bodies_and_motion_together(
    package_at: Callable[[str], ModuleType],
) -> None:
    robot, draw = package_at("puma560").load("numpy"), np.random.default_rng(6)
    n, draws = robot.n, 20_000
    q, sizes = draw.uniform(-2.0, 2.0, n), np.repeat([3e-3, 5e-2, 1.0], n)
    found = robot.uncertainty(q, np.zeros(n), np.zeros(n), UncertainBodies(0.1), np.diag(sizes**2))
    noise = draw.normal(size=(draws, 3 * n)) * sizes
    heavier = 1.0 + 0.1 * draw.normal(size=(draws, 1, robot.N))
    at, qd, qdd = q + noise[:, :n], noise[:, n : 2 * n], noise[:, 2 * n :]
    c2, c1, _ = (a * heavier.reshape(draws, 1, -1, *[1] * (a.ndim - 3)) for a in robot.coefficients(at, qd))
    tau = robot.partial_torque(at, qd, qdd) * heavier
    agree(found.acceleration, (c2 * qdd[:, None, None]).std(0))
    agree(found.velocity, (c1 * qd[:, None, None]).std(0))
    agree(found.joint_acceleration, (c2 * qdd[:, None, None]).sum(2).std(0))
    agree(found.joint_power, (tau.sum(-1) * qd).std(0))


def test_a_share_of_two_uncertain_factors_deviates_as_their_product_does(
    package_at: Callable[[str], ModuleType],
) -> None:
    """Var(h a) = (1 + e^2) (a^2 + s^2) - a^2, for a mass h times the file's, with deviation e."""
    robot = package_at("puma560").load("numpy")
    n, e, s = robot.n, 0.5, 2e-3
    q, a = np.random.default_rng(6).uniform(-2.0, 2.0, (2, n))
    motion = np.diag(np.repeat([0.0, 0.0, s**2], n))
    found = robot.uncertainty(q, 0.0 * a, a, UncertainBodies(e), motion).acceleration
    expected = np.abs(robot.coefficients(q, a)[0]) * np.sqrt((1.0 + e**2) * (a**2 + s**2) - a**2)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_bodies_that_a_robot_was_loaded_with_are_those_that_are_uncertain(
    package_at: Callable[[str], ModuleType],
) -> None:
    package = package_at("puma560")
    own, motion = package.bodies(), random_states(6, 5)
    heavy = own._replace(masses=2.0 * own.masses, inertias=2.0 * own.inertias)
    light, twice = (
        package.load("numpy", bodies=bodies).uncertainty(*motion, UncertainBodies(0.1, 0.02, 0.1)).torque
        for bodies in (own, heavy)
    )
    np.testing.assert_allclose(twice, 2.0 * light, rtol=1e-12)


def test_large_batches_deviate_as_small_ones(
    package_at: Callable[[str], ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = package_at("puma560").load("numpy")
    motion = random_states(robot.n, 23)
    whole = robot.uncertainty(*motion, uncertain(robot.N))
    monkeypatch.setattr(type(robot.backend), "chunk", lambda self, motion, most: 5)
    for piece, one in zip(robot.uncertainty(*motion, uncertain(robot.N)), whole, strict=True):
        np.testing.assert_allclose(piece, one, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (np.eye(6), r"motion has shape \(6, 6\); a covariance of q, qd and qdd has \(9, 9\), or \(2, 9, 9\)"),
        (np.full((9, 9), np.nan), "motion has NaN or infinity"),
        (-np.eye(9), "motion is no covariance"),
        (np.eye(9) + np.eye(9, k=1), "motion is no covariance"),
        ("much", "motion is 'much'; give a covariance of q, qd and qdd"),
        (None, "nothing is uncertain; give bodies, motion or both"),
    ],
)
def test_covariances_of_motion_that_cannot_be_are_refused(
    given: Any, told: str, package_of: Callable[[str], ModuleType]
) -> None:
    with pytest.raises(ValueError, match=told):
        package_of("planar3").load("numpy").uncertainty(*random_states(3, 2), motion=given)


def test_no_samples_have_no_deviations(package_of: Callable[[str], ModuleType]) -> None:
    none = np.zeros((0, 3))
    found = package_of("planar3").load("numpy").uncertainty(none, none, none, motion=np.zeros((0, 9, 9)))
    assert found.torque.shape == (0, 3, 3)


def test_a_covariance_in_single_precision_has_its_rounding(package_of: Callable[[str], ModuleType]) -> None:
    """Eigenvalues but that of its one direction are rounding, on either side of zero."""
    robot, root = package_of("planar3").load("numpy"), np.random.default_rng(4).normal(size=(9, 1))
    motion = random_states(3, 2)
    exact, single = (
        robot.uncertainty(*motion, motion=(root @ root.T).astype(k)) for k in (float, np.float32)
    )
    np.testing.assert_allclose(single.torque, exact.torque, rtol=1e-5)


def test_lengths_count_by_slopes_of_robots_whose_joints_are_elsewhere(
    package_at: Callable[[str], ModuleType],
) -> None:
    package = package_at(str(CRANE))
    dynamics, oracle = package.load("numpy"), oracle_of(str(CRANE), package)
    names = dynamics.tree_joint_names
    lengths = np.zeros((len(names), 3))
    moved = {"pitch": np.array([0.003, 0.0, 0.01]), "level": np.array([0.002, 0.005, 0.004])}
    for name, sizes in moved.items():
        lengths[names.index(name)] = sizes
    motion = random_states(dynamics.n, 1)
    found = dynamics.uncertainty(*motion, UncertainBodies(lengths=lengths))
    q, qd, qdd = (a[0] for a in motion)
    pi = np.array([oracle.model.inertias[at].toDynamicParameters() for at in oracle.bodies])
    squares: list[Any] = [0.0] * 6
    for name, sizes in moved.items():
        at = oracle.model.getJointId(name)
        for axis in range(3):
            each = []
            for way in (0.01, -0.01):
                placement = oracle.model.jointPlacements[at].copy()
                # Along the axes of the body that carries the joint: Pinocchio's joint before it has these.
                oracle.model.jointPlacements[at].translation = placement.translation + way * np.eye(3)[axis]
                rows = [*oracle.shares(q, qd, qdd), oracle.rows(q, qd, qdd)]
                each.append([np.einsum("ij...p,jp->ij...", a, pi) for a in rows])
                oracle.model.jointPlacements[at] = placement
            slopes = [(a - b) / 0.02 * sizes[axis] for a, b in zip(*each, strict=True)]
            sums = slopes[3].sum(1), slopes[1].sum(1)
            squares = [a + b**2 for a, b in zip(squares, [*slopes, *sums], strict=True)]
    answers = (found.acceleration, found.velocity, found.gravity, found.torque)
    for value, square in zip((*answers, found.joint_torque, found.joint_velocity), squares, strict=True):
        np.testing.assert_allclose(value[0], np.sqrt(square), rtol=0, atol=1e-10 * np.sqrt(square).max())


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (
            {"masses": [0.1, -0.1, 0.1]},
            "bodies: masses of 'link2' is -0.1; a standard deviation is 0 or more",
        ),
        ({"centres": np.nan}, "bodies: centres has NaN or infinity; give finite numbers"),
        ({"radii": [0.1, 0.1]}, r"bodies: radii has shape \(2,\); it must be \(3,\) or one number"),
        ({"correlation": np.eye(2)}, r"correlation has shape \(2, 2\); it must be \(3, 3\)"),
        (
            {"correlation": [[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]]},
            "correlation cannot be: its smallest eigenvalue is -0.8",
        ),
        (
            {"correlation": [[1.0, 1.2, 0.0], [1.2, 1.0, 0.0], [0.0, 0.0, 1.0]]},
            "correlation of 'link1' and 'link2' is 1.2; give one from -1 to 1",
        ),
        ({"centres": np.array([np.diag([1.0, 1.0, -1.0])] * 3)}, "centres of 'link1' is not a covariance"),
        ({"lengths": -0.001}, "lengths has -0.001"),
        ({"parameters": np.eye(10)}, r"parameters has shape \(10, 10\); it must be a covariance, \(30, 30\)"),
        (
            {"parameters": np.diag([*[1.0] * 25, -1.0, *[1.0] * 4])},
            "parameters of 'link3' have the variance -1",
        ),
        ({"parameters": np.ones((30, 30)) + 0.5 * np.eye(30, k=3)}, "parameters is not symmetric"),
        ({"parameters": 3.0 - 2.0 * np.eye(30)}, "parameters is not a covariance: scaled to variances of 1"),
        ({"parameters": np.full((3, 10, 2), np.inf)}, "parameters has NaN or infinity"),
    ],
)
def test_deviations_that_cannot_be_are_refused_by_name(
    given: dict[str, Any], told: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3").load("numpy")
    with pytest.raises(ValueError, match=told) as info:
        robot.uncertainty(*random_states(3, 1), UncertainBodies(**given))
    assert "\n" not in str(info.value)


@pytest.mark.parametrize("backend", ["numpy", "torch", "native"])
def test_motion_that_is_no_number_has_no_certainty(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of("planar3").load(backend)
    tensors = pytest.importorskip("torch").tensor if backend == "torch" else np.array
    q, qd, qdd = random_states(3, 2)
    q[1, 2] = np.nan
    for given in ({"bodies": UncertainBodies(0.1)}, {"motion": 1e-4 * np.eye(9)}):
        found = np.array(robot.uncertainty(*map(tensors, (q, qd, qdd)), **given).joint_torque.tolist())
        assert np.isnan(found[1]).all()
        assert np.isfinite(found[0]).all()
        nothing = robot.uncertainty(*(tensors(a[:0]) for a in (q, qd, qdd)), **given)
        assert nothing.torque.shape == (0, 3, 3)


def test_bodies_of_each_sample_and_other_things_are_refused(package_of: Callable[[str], ModuleType]) -> None:
    package = package_of("planar3")
    own = package.bodies()
    several = own._replace(masses=np.stack([own.masses, own.masses]))
    with pytest.raises(ValueError, match="differs from sample to sample"):
        package.load("numpy", bodies=several).uncertainty(*random_states(3, 2), UncertainBodies(0.1))
    with pytest.raises(TypeError, match=r"bodies is 0\.1; give an UncertainBodies"):
        package.load("numpy").uncertainty(*random_states(3, 2), 0.1)
