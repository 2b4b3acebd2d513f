"""Sums over the links of a generated package: shapes, places, dtypes, gradients, names and messages."""

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, PANDA, needs_compiler
from helpers.answers import relative_error
from linkwise import Coordinate, LinkEnergy, energy_system, generate, write_package
from linkwise.package.load import import_package
from linkwise_runtime.answers.inertia_solve import solve_inertia

torch = pytest.importorskip("torch")

Packages = Callable[[str], ModuleType]
BACKENDS = (
    "numpy by straight",
    "numpy by rule",
    "torch by rule",
    "autograd",
    pytest.param("native", marks=needs_compiler),
)
TREE = "torso"
"""Joints on two arms, whose matrices have zeros."""


def loaded(package: ModuleType, backend: str) -> Any:
    name, _, kernel = backend.partition(" by ")
    return package.load(name, kernel=kernel or "auto")


def motion_of(robot: Any, *batch: int, dtype: str = "float64") -> tuple[Any, ...]:
    arrays = np.random.default_rng(3).uniform(-2.0, 2.0, (3, *batch, robot.n)).astype(dtype)
    return tuple(torch.from_numpy(arrays)) if robot.backend.takes_tensors else tuple(arrays)


def calls_of(robot: Any, q: Any, qd: Any, tau: Any) -> dict[str, Callable[..., Any]]:
    """Each sum as a function of `out` and `by_link`, for those that have it."""
    return {
        "mass_matrix": lambda **how: robot.mass_matrix(q, **how),
        "coriolis_matrix": lambda **how: robot.coriolis_matrix(q, qd, **how),
        "gravity_torque": lambda **how: robot.gravity_torque(q, **how),
        "christoffel": lambda **how: robot.christoffel(q, **how),
        "energy": lambda **how: robot.energy(q, qd, **how),
        "power": lambda **how: robot.power(q, qd, tau, **how),
        "forward_dynamics": lambda **how: robot.forward_dynamics(q, qd, tau, **how),
    }


@pytest.mark.parametrize("backend", ["numpy", "torch", "autograd"])
def test_christoffel_symbols_are_those_of_each_samples_parameters(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3 symbolic")
    name, value = next((k, v) for k, v in package.parameters.items() if v)
    values = value * np.array([1.0, 1.1, 1.3])  # as many as there are joints, too
    q = np.random.default_rng(2).normal(size=(2, 3, 3))
    many = package.load(backend, {name: values}).christoffel(q)
    for k, one in enumerate(values):
        alone = package.load(backend, {name: float(one)}).christoffel(q[:, k])
        assert relative_error(many[:, k], alone) <= 1e-12


@pytest.mark.parametrize("robot", [TREE, str(DATA / "turntable.py")])
@pytest.mark.parametrize("backend", BACKENDS)
def test_sums_are_those_of_the_shares(backend: str, robot: str, package_of: Packages) -> None:
    if robot != TREE and backend.endswith("rule"):
        with pytest.raises(ValueError, match="this package is of energies, which have closed forms alone"):
            loaded(package_of(robot), backend)
        return
    model = loaded(package_of(robot), backend)
    n, links = model.n, model.N
    q, qd, tau = motion_of(model, 2, 3)
    c2, c1, _ = map(np.asarray, model.coefficients(q, qd))
    calls = calls_of(model, q, qd, tau)
    for name, shares, axis in (
        ("mass_matrix", c2, -2),
        ("coriolis_matrix", c1, -2),
        ("gravity_torque", np.asarray(model.coefficients(q, 0.0 * qd).gravity), -1),
    ):
        assert relative_error(calls[name](), shares.sum(axis)) <= 1e-14
        assert relative_error(calls[name](by_link=True), shares) <= 1e-14
    qdd = calls["forward_dynamics"]()
    assert relative_error(model.inverse_dynamics(q, qd, qdd), np.asarray(tau)) <= 1e-12
    pairs, symbols = calls["christoffel"](by_link=True), np.asarray(calls["christoffel"]())
    assert tuple(pairs.shape) == (2, 3, n, links, n, n)
    assert relative_error(np.asarray(pairs).sum(-3), symbols) <= 1e-14
    rest = np.asarray(model.coefficients(q, 0 * qd).velocity)  # of terms linear in the velocities
    product = (symbols @ np.asarray(qd)[..., None, :, None])[..., 0]
    assert relative_error(product, (c1 - rest).sum(-2)) <= 1e-14
    assert np.abs(symbols - symbols.swapaxes(-1, -2)).max() <= 1e-14 * np.abs(symbols).max()


@pytest.mark.parametrize("robot", ["planar3", "spherical"])
def test_christoffel_symbols_of_many_samples_are_slopes_of_the_mass_matrix(
    robot: str, package_of: Packages, spherical: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Symbols come in pieces of four samples, of which the last is short."""
    package = spherical if robot == "spherical" else package_of(robot)
    model, answers = package.load("numpy"), import_module("linkwise_runtime.answers.answers")
    monkeypatch.setattr(answers, "AT_ONCE", 4 * model.n * sum(model.structure.sizes))
    q = motion_of(model, 11)[0]
    found, steps = model.christoffel(q), 1e-5 * np.eye(model.n)
    slope = np.stack([model.mass_matrix(q + s) - model.mass_matrix(q - s) for s in steps], -1) / 2e-5
    expected = (slope + slope.swapaxes(-1, -2) - np.moveaxis(slope, -1, -3)) / 2.0
    assert relative_error(found, expected) <= 1e-8


CROOKED = f"{DATA / 'crane.urdf'} loops"


@pytest.mark.parametrize(
    "robot", [CROOKED, "planar3 symbolic", str(DATA / "cart_pendulum.py"), str(DATA / "turntable.py")]
)
@pytest.mark.parametrize(
    "backend", ["numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler)]
)
def test_power_into_a_link_is_what_its_energy_gains(backend: str, robot: str, package_of: Packages) -> None:
    model = package_of(robot).load(backend)
    q, qd, qdd = motion_of(model, 2, 5)
    power = model.power(q, qd, qdd)
    assert relative_error(power.total, np.asarray(model.partial_torque(q, qd, qdd) * qd[..., None])) <= 1e-13
    step = 1e-4
    gained = [
        model.energy(q + s * qd + s * s / 2 * qdd, qd + s * qdd) for s in (step, -step, 2 * step, -2 * step)
    ]
    one, other, far, back = (np.asarray(energy.total) for energy in gained)
    rate = (8 * (one - other) - (far - back)) / (12 * step)
    if robot.endswith("turntable.py"):  # what turns the table takes its share
        rate = rate + np.asarray((model.named_shares(q, qd)[..., 0] * qd[..., None]).sum(-2))
    assert relative_error(np.asarray(power.total).sum(-2), rate) <= 1e-6


@pytest.mark.parametrize("batch", [(), (4,), (2, 3), (0,)])
@pytest.mark.parametrize("backend", BACKENDS)
def test_sums_are_written_where_out_says(backend: str, batch: tuple[int, ...], package_of: Packages) -> None:
    model = loaded(package_of("planar3"), backend)
    for call in calls_of(model, *motion_of(model, *batch, dtype="float32")).values():
        expected = call()
        several = isinstance(expected, tuple)
        parts = expected if several else (expected,)
        places = [0 * part + 7 for part in parts]
        found = call(out=tuple(places) if several else places[0])
        for part, place, one in zip(parts, places, found if several else (found,), strict=True):
            assert one is place
            assert (place == part).all()
            assert str(part.dtype).endswith("float32")
            assert tuple(part.shape[: len(batch)]) == batch
        with pytest.raises((ValueError, TypeError), match=r"out(\.\w+)? (has shape|is a)"):
            call(out=places[0][..., :2])


def test_forward_dynamics_names_torque_that_does_not_fit(package_of: Packages) -> None:
    robot = package_of("planar3").load("numpy", check_finite=True)
    with pytest.raises(
        ValueError, match=r"tau has shape \(2,\); its last axis must be 3, one for each joint"
    ):
        robot.forward_dynamics(np.zeros(3), np.zeros(3), np.zeros(2))
    with pytest.raises(ValueError, match="tau is nan for joint 'joint2'"):
        robot.forward_dynamics(np.zeros(3), np.zeros(3), [0.0, np.nan, 0.0])


@pytest.mark.parametrize("backend", ["torch by straight", "torch by rule", "autograd", "native"])
def test_gradients_flow_through_forward_dynamics(backend: str, package_of: Packages) -> None:
    model = loaded(package_of("planar3"), backend)
    motion = [torch.from_numpy(a).requires_grad_() for a in np.random.default_rng(4).uniform(-2, 2, (3, 3))]
    assert torch.autograd.gradcheck(model.forward_dynamics, motion)
    assert torch.autograd.gradcheck(model.christoffel, motion[:1])


def test_sums_run_under_vmap_and_jacrev(package_of: Packages) -> None:
    robot = package_of("planar3").load("torch")
    motion = motion_of(robot, 4)
    symbols = torch.func.vmap(robot.christoffel)(motion[0])
    assert relative_error(symbols, np.asarray(robot.christoffel(motion[0]))) <= 1e-14
    mapped = torch.func.vmap(robot.forward_dynamics)(*motion)
    assert relative_error(mapped, robot.forward_dynamics(*motion)) <= 1e-14
    slope = torch.func.vmap(torch.func.jacrev(robot.forward_dynamics, 2))(*motion)
    assert relative_error(slope @ robot.mass_matrix(motion[0]), np.eye(3) + np.zeros((4, 3, 3))) <= 1e-13


@pytest.fixture(scope="module")
def spherical(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A mass on a string, in axes that turn: phi about the vertical moves nothing where it hangs down."""
    import sympy as sp

    theta, phi = Coordinate("theta"), Coordinate("phi")
    kinetic = (theta.qd**2 + sp.sin(theta.q) ** 2 * (phi.qd + 0.7) ** 2) / 2
    bob = LinkEnergy("bob", kinetic, -9.81 * sp.cos(theta.q))
    folder = tmp_path_factory.mktemp("sums") / "spherical"
    write_package(generate(energy_system("spherical", [theta, phi], [bob])), folder)
    return import_package(folder)


@pytest.mark.parametrize(
    "backend", ["numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler)]
)
def test_a_singular_mass_matrix_is_refused_with_sample_and_joints(
    backend: str, spherical: ModuleType
) -> None:
    robot = spherical.load(backend)
    q, qd, tau = motion_of(robot, 4)
    assert np.isfinite(np.asarray(robot.forward_dynamics(q, qd, tau))).all()
    q[2] = 0.0
    with pytest.raises(ValueError, match="singular at sample 2: the joint phi can move without moving any"):
        robot.forward_dynamics(q, qd, tau)
    q[2] = np.nan
    qdd = np.asarray(robot.forward_dynamics(q, qd, tau))
    assert np.isnan(qdd[2]).all()
    assert np.isfinite(qdd[[0, 1, 3]]).all()


@pytest.mark.parametrize("kind", ["array", "tensor"])
def test_a_mass_matrix_is_singular_also_where_no_pivot_says_so(kind: str) -> None:
    """Kahan's matrix, whose pivots are all above its least eigenvalue; and one that is not positive."""
    s, n = 0.5757627118644068, 32
    r = np.diag(s ** np.arange(n)) @ (np.eye(n) - (1.0 - s * s) ** 0.5 * np.triu(np.ones((n, n)), 1))
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    for matrix in (r.T @ r, turn @ np.diag([2.0, 0.0, -1.0]) @ turn.T):
        names = [f"joint{k}" for k in range(len(matrix))]
        given = [matrix, np.ones(len(matrix))]
        mass, force = map(torch.from_numpy, given) if kind == "tensor" else given
        # Rounding decides which joints of Kahan's are told.
        with pytest.raises(ValueError, match=r"the mass matrix is singular: the joints joint\d.* together"):
            solve_inertia(mass, force, names)


def test_joints_and_links_have_numbers_by_name(package_of: Packages) -> None:
    robot = package_of(str(PANDA)).load("numpy")
    assert [robot.joint_index(name) for name in robot.joint_names] == list(range(7))
    assert robot.link_index("panda_link3") == robot.link_index(np.int64(2)) == 2
    with pytest.raises(
        ValueError, match=r"joint is 'panda_joint9'; choose a joint by number, 0..6, or by name: "
    ):
        robot.joint_index("panda_joint9")
    with pytest.raises(ValueError, match=r"near it are panda_link\d, .* and `link_names` has all 7"):
        robot.link_index("link3")
    with pytest.raises(ValueError, match="link is -1; choose a link by number"):
        robot.link_index(-1)


@pytest.mark.parametrize(("vague", "where"), [([1], "sample 1: "), ([1, 3, 4], "sample 3 and 2 others: ")])
def test_samples_that_are_nearly_singular_are_told_and_counted(vague: list[int], where: str) -> None:
    mass = np.tile(np.eye(2), (6, 1, 1))
    for sample in vague:
        mass[sample, 0, 1] = mass[sample, 1, 0] = 1.0 - (1e-11 if sample == 3 else 1e-10)
    with pytest.warns(RuntimeWarning, match=rf"nearly singular at {where}the joints a, b can move"):
        solve_inertia(mass, np.ones((6, 2)), ["a", "b"])
