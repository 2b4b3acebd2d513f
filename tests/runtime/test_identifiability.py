"""Shares that joint torques determine, and the bounds of the others over all bodies that could exist."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, PANDA
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.certainty.feasible_bodies import feasible_bodies
from linkwise_runtime.certainty.pseudo_inertia import pseudo_inertia, squared
from linkwise_runtime.certainty.torque_space import torque_space
from linkwise_runtime.parameter_values import faults
from linkwise_runtime.rule.joint_tree import Bodies
from linkwise_runtime.rule.regressors import inertial_parameters
from tools.corpus import ROBOTS

from runtime.test_call_table import TIED

pytest.importorskip("pinocchio")
pytest.importorskip("clarabel")

import pinocchio as pin
from numeric import oracle_models
from numeric.pinocchio_model import PinocchioModel

Packages = Callable[[str], ModuleType]
README = np.array([0.3, 0.5, -0.2]), np.array([1.0, 0.0, 2.0]), np.array([0.0, 0.0, 5.0])
CART = str(DATA / "cart_pendulum.py")
needs_robots = pytest.mark.skipif(not ROBOTS.is_dir(), reason="needs example-robot-data")


def draw(n: int, samples: int, seed: int = 3) -> list[Any]:
    return list(np.random.default_rng(seed).uniform(-1.5, 1.5, (3, samples, n)))


def in_row_space(rows: Any, shares: Any) -> Any:
    """Return whether rows (..., 10 N) of shares are combinations of rows (T, 10 N) of torques, by QR."""
    sizes = np.linalg.norm(rows, axis=0)
    sizes[sizes < 1e-9 * sizes.max()] = 1e-6
    scaled = rows / sizes
    values, right = np.linalg.svd(scaled, full_matrices=False)[1:]
    space = right[values > 1e-8 * values[0]]
    asked = shares / sizes
    left = np.linalg.norm(asked - asked @ space.T @ space, axis=-1)
    return left < 1e-7 * np.linalg.norm(asked, axis=-1)


def by_pinocchio(
    regressor: Callable[..., Any], n: int, blocks: Sequence[int], measured: Sequence[int]
) -> Any:
    """Return (there, follows) of tau_ij by Pinocchio's regressor; blocks: its body of each link."""
    states = list(zip(*draw(n, 40 * len(blocks) // n + 8), strict=True))
    rows = np.stack([regressor(*state)[:, blocks] for state in states])  # (S, n, N, 10)
    torques = rows[:, list(measured)].reshape(-1, 10 * len(blocks))
    alone = np.zeros((3, n, len(blocks), *rows.shape[2:]))
    for j in range(len(blocks)):
        alone[:, :, j, j] = rows[:3, :, j]
    there = np.abs(rows).max((0, 3)) > 1e-12
    follows = in_row_space(torques, alone.reshape(3, n, len(blocks), -1)).all(0)
    return there, there & follows


def of_model(model: Any) -> Callable[..., Any]:
    data, n = model.createData(), model.nv
    return lambda *state: pin.computeJointTorqueRegressor(model, data, *state).reshape(n, -1, 10)


@pytest.mark.parametrize(
    ("name", "oracle", "torques", "coefficients", "base"),
    [
        ("planar3", oracle_models.planar3, (1, 6), (10, 25), 9),
        ("puma560", oracle_models.puma560, (1, 21), (26, 176), 36),
    ],
)
def test_few_shares_follow_from_torques_and_all_sums(
    name: str, oracle: Any, torques: Any, coefficients: Any, base: int, package_of: Packages
) -> None:
    found = package_of(name).load("numpy").identifiability()
    n = len(found.joints)
    there, follows = by_pinocchio(of_model(oracle()), n, range(n), range(n))
    assert np.array_equal(found.shares["torque"].there, there)
    assert np.array_equal(found.shares["torque"].follows, follows)
    assert found.shares["torque"].counts == torques
    assert found.coefficient_counts == coefficients
    assert found.base_count == base
    for kind in ("torque", "acceleration", "velocity", "gravity"):
        own, every = found.sums[kind].counts
        assert own == every > 0
    own, every = found.sums["reactions"].counts
    assert n == own < every  # the part along each joint's axis alone
    assert f"{torques[0]} of {torques[1]}" in str(found)


@needs_robots
def test_torques_of_a_floating_base_are_not_taken_to_be_measured(tmp_path: Path) -> None:
    path = next(ROBOTS.rglob("solo12.urdf"))
    system = read_system(path, Options(base="floating"))
    write_package(generate(system, ["numpy"], "solo"), tmp_path / "solo")
    robot = import_package(tmp_path / "solo").load()
    oracle = PinocchioModel(path, system, floating=True)
    frames = [oracle.model.getFrameId(link, pin.BODY) for link in robot.link_names]
    blocks = [oracle.model.frames[at].parentJoint - 1 for at in frames]
    legs, whole = robot.identifiability(), robot.identifiability(robot.joint_names)
    for found, measured in ((legs, range(6, 18)), (whole, range(18))):
        there, follows = by_pinocchio(oracle.regressor, 18, blocks, measured)
        assert np.array_equal(found.shares["torque"].there, there)
        assert np.array_equal(found.shares["torque"].follows, follows)
    assert not legs.sums["torque"].follows[:6].any()
    assert legs.sums["torque"].follows[6:].all()
    assert whole.sums["torque"].follows.all()
    assert (legs.base_count, whole.base_count) == (84, 94)
    bounds = robot.share_bounds(*(a[0] for a in draw(18, 1)), joints=["base_z", "FL_HAA"])
    assert np.isinf(bounds.greatest["torque"][2, 0])  # the base's own mass, which no leg feels
    assert np.isfinite(bounds.greatest["torque"][6]).all()
    assert np.isnan(bounds.least["torque"][7, 2])  # was not asked for


def test_a_tenth_of_a_kilogram_moved_at_the_joint_changes_shares_and_no_torque(package_of: Packages) -> None:
    """0.1 kg from link 3 to link 2, where joint 3 holds them together."""
    package = package_of("planar3")
    own, model = package.bodies(), oracle_models.planar3()
    moved, data = model.copy(), model.createData()
    speck = pin.Inertia(0.1, np.zeros(3), np.zeros((3, 3)))
    moved.inertias[2] = model.inertias[2] + pin.SE3(np.eye(3), np.array([0.25, 0, 0])).act(speck)
    moved.inertias[3] = model.inertias[3] - speck
    for state in zip(*draw(3, 20), strict=True):
        torques = [pin.rnea(one, data, *state).copy() for one in (model, moved)]
        np.testing.assert_allclose(*torques, rtol=0, atol=1e-12)
    parts = [(b.mass, b.lever, b.inertia) for b in moved.inertias.tolist()[1:]]
    other = Bodies(*(np.array(a) for a in zip(*parts, strict=True)))
    assert not faults(_listed(other)).any()
    robot = package.load()
    tau, tau_moved = (r.partial_torque(*README)[0] for r in (robot, package.load(bodies=other)))
    np.testing.assert_allclose(tau[1:], [1.918, 3.276], atol=5e-4)
    np.testing.assert_allclose(tau_moved[1:], [2.323, 2.871], atol=5e-4)
    bounds = robot.share_bounds(*README)
    for found in (tau, tau_moved):
        assert (bounds.least["torque"][0] <= found + 1e-12).all()
        assert (found <= bounds.greatest["torque"][0] + 1e-12).all()
    assert own.masses.tolist() == [0.6, 0.6, 0.6]


def _listed(bodies: Any) -> Any:
    """Return bodies (..., 7) as `faults` takes them."""
    at = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    return np.stack([bodies.masses, *(bodies.inertias[:, a, b] for a, b in at)], -1)


def test_what_joints_bear_has_ends_that_bodies_attain(package_of: Packages) -> None:
    """The wrench through each link is Pinocchio's of that link alone, of bodies with the same torques."""
    package, model = package_of("puma560"), oracle_models.puma560()
    state = [a[0] for a in draw(6, 1)]
    bounds = package.load().share_bounds(
        *state, masses=0.2, shares=("torque", "reactions"), joints=["joint2", "joint5"]
    )
    assert bounds.proved["reactions"][[1, 4]].all()
    assert np.isnan(bounds.least["reactions"][2, 3]).all()  # was not asked for
    data, moving = model.createData(), list(zip(*draw(6, 10, 4), strict=True))
    expected = np.array([pin.rnea(model, data, *motion) for motion in moving])
    own = oracle_models.link_alone(model, 5)
    pin.rnea(own, data, *state)
    wrench = np.concatenate([data.f[5].angular, data.f[5].linear])
    np.testing.assert_allclose(bounds.value["reactions"][4, 4], wrench, atol=1e-9)
    for kind, (f, j, component) in [key for key in bounds.ends if key[0] == "reactions"]:
        for end, bound in (("least", bounds.least), ("greatest", bounds.greatest)):
            bodies = bounds.bodies(f, j, kind=kind, end=end, component=component)
            other = _with(model, bodies)
            found = np.array([pin.rnea(other, data, *motion) for motion in moving])
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
            pin.rnea(oracle_models.link_alone(other, j + 1), data, *state)
            share = [*data.f[f + 1].angular, *data.f[f + 1].linear][component]
            size = max(abs(end_of[kind][f, j, component]) for end_of in (bounds.least, bounds.greatest))
            assert abs(share - bound[kind][f, j, component]) < 1e-6 * size


@pytest.mark.parametrize("masses", [None, 0.1, {"link2": (17.0, 18.0), "link3": (4.7, 4.7)}])
def test_bodies_at_the_ends_have_the_same_torques_and_the_share_that_is_told(
    masses: Any, package_of: Packages
) -> None:
    """Held against Pinocchio, which is given the bodies: link by link, and all together."""
    package, model = package_of("puma560"), oracle_models.puma560()
    state = [a[0] for a in draw(6, 1)]
    motions = list(zip(*draw(6, 10, 4), strict=True))
    bounds = package.load().share_bounds(*state, masses=masses)
    assert bounds.proved["torque"].all()
    assert len(bounds.ends) == 20
    assert not bounds.sized["torque"].any() or masses is None
    data = model.createData()
    expected = np.array([pin.rnea(model, data, *motion) for motion in motions])
    for (_, (i, j)), pair in bounds.ends.items():
        for end, bound in zip(("least", "greatest"), (bounds.least, bounds.greatest), strict=True):
            bodies = bounds.bodies(i, j, end=end)
            assert not faults(_listed(bodies)).any()
            np.testing.assert_allclose(inertial_parameters(bodies), pair[end == "greatest"], atol=1e-9)
            other = _with(model, bodies)
            found = np.array([pin.rnea(other, data, *motion) for motion in motions])
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
            share = pin.rnea(oracle_models.link_alone(other, j + 1), data, *state)[i]
            size = max(abs(bounds.least["torque"][i, j]), abs(bounds.greatest["torque"][i, j]))
            assert abs(share - bound["torque"][i, j]) < 1e-6 * size
            slack = 1e-9 * bodies.masses
            assert (bodies.masses >= bounds.limits[:, 0] - slack).all()
            assert (bodies.masses <= bounds.limits[:, 1] + slack).all()


def _with(model: Any, bodies: Any) -> Any:
    other = model.copy()
    for j, body in enumerate(zip(*bodies, strict=True), 1):
        other.inertias[j] = pin.Inertia(float(body[0]), body[1], body[2])
    return other


def test_no_body_that_a_random_walk_finds_lies_beyond_the_ends(package_of: Packages) -> None:
    """Hit and run along what Pinocchio's regressor does not show, while pseudo-inertias stay positive."""
    package, model = package_of("planar3"), oracle_models.planar3()
    regressor = of_model(model)
    rows = np.concatenate([regressor(*s).reshape(3, -1) for s in zip(*draw(3, 40), strict=True)])
    values, right = np.linalg.svd(rows)[1:]
    hidden = right[int((values > 1e-9 * values[0]).sum()) :]
    bounds = package.load().share_bounds(*README, masses=0.5)
    least, greatest = bounds.least["torque"], bounds.greatest["torque"]
    share = np.array(regressor(*README))
    pi = np.mean([one for pair in bounds.ends.values() for one in pair], axis=0)
    sizes = np.array([0.5, 0.1, 0.1, 0.1, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02])
    turns = np.linalg.qr((hidden / np.tile(sizes, 3)).T)[0].T * np.tile(sizes, 3)
    random, low, high = np.random.default_rng(6), np.full((3, 3), np.inf), np.full((3, 3), -np.inf)
    for _ in range(4000):
        way = (random.normal(size=len(turns)) @ turns).reshape(3, 10)
        back = np.linalg.inv(np.linalg.cholesky(pseudo_inertia(pi)))
        slopes = np.linalg.eigvalsh(back @ pseudo_inertia(way) @ np.swapaxes(back, 1, 2)).ravel()
        slopes = np.append(slopes, [s * way[:, 0] / (0.3 + s * (pi[:, 0] - 0.6)) for s in (1, -1)])
        ends = [max(-1 / slopes.max(), -3.0), min(-1 / slopes.min(), 3.0)]
        pi = pi + 0.999 * random.uniform(*ends) * way
        tau = (share * pi).sum(-1)
        low, high = np.minimum(low, tau), np.maximum(high, tau)
    lean = ~bounds.follows["torque"] & (greatest > least)
    assert (low >= least - 1e-9)[np.triu_indices(3)].all()
    assert (high <= greatest + 1e-9)[np.triu_indices(3)].all()
    assert ((high - low)[lean] > 0.3 * (greatest - least)[lean]).all()


def test_whatever_the_solver_returns_the_bound_is_one() -> None:
    random = np.random.default_rng(1)
    halves = random.normal(size=(3, 4, 6))
    own = np.array([_parameters(half @ half.T) for half in halves])
    hidden = np.linalg.qr(random.normal(size=(30, 7)))[0]
    limits = np.stack([0.5 * own[:, 0], 1.5 * own[:, 0]], 1)
    bodies = feasible_bodies(own, hidden, limits, ("a", "b", "c"))
    assert np.abs(bodies.rows.T @ bodies._ones).max() <= 1e-9, "seen from the analytic centre"
    end = bodies.least(random.normal(size=(3, 10)))
    assert end.bound <= end.attained <= end.bound + 1e-8 * abs(end.bound)
    for _ in range(20):
        drawn = bodies._inside(9.0 * random.normal(size=7))
        moved = squared(bodies._ones[:30].reshape(3, 10) + (bodies.rows @ drawn)[:30].reshape(3, 10))
        assert np.linalg.eigvalsh(moved).min() >= 0.0, "bodies that could exist"
    c = np.eye(7)[2]
    least = bodies._proved(c, bodies._solved(c, bodies.rows)[1])
    for _ in range(20):
        assert bodies._proved(c, random.normal(size=len(bodies.rows))) <= least + 1e-12


def test_torques_that_are_zero_in_every_motion_determine_nothing() -> None:
    space = torque_space(np.zeros((4, 10)), "nothing")
    assert space.count == 0
    assert space.hidden.shape == (10, 10)


def _parameters(j: Any) -> Any:
    inertia = np.trace(j[:3, :3]) * np.eye(3) - j[:3, :3]
    moments = [inertia[a, b] for a, b in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    return [j[3, 3], *j[:3, 3], *moments]


def test_panda_has_ends_for_every_share_but_those_that_follow(package_of: Packages) -> None:
    if not PANDA.is_file():
        pytest.skip("needs example-robot-data")
    robot = package_of(str(PANDA)).load("numpy")
    found = robot.identifiability()
    assert (found.base_count, *found.shares["torque"].counts, *found.sums["torque"].counts) == (
        43,
        1,
        28,
        7,
        7,
    )
    state = [a[0] for a in draw(7, 1)]
    limited, free = (robot.share_bounds(*state, masses=masses) for masses in (0.1, None))
    for bounds in (limited, free):
        assert bounds.proved["torque"].all()
        assert np.isfinite(bounds.greatest["torque"]).all()
    assert (limited.least["torque"] >= free.least["torque"] - 1e-6).all()
    assert (limited.greatest["torque"] <= free.greatest["torque"] + 1e-6).all()
    np.testing.assert_allclose(free.value["torque"], robot.partial_torque(*state), rtol=0, atol=1e-12)


def test_where_joints_are_tied_shares_are_those_of_the_independent_ones(tmp_path: Path) -> None:
    (tmp_path / "press.toml").write_text(TIED, encoding="utf-8")
    write_package(generate(read_system(tmp_path / "press.toml"), ["numpy"]), tmp_path / "press")
    package = import_package(tmp_path / "press")
    robot = package.load()
    found = robot.identifiability()
    assert found.joints == robot.constraints.independent == ("crank", "wrist")
    assert found.links == ("rod", "slider", "hand")
    assert found.sums["torque"].follows.all()
    q = robot.constraints.closed(np.array([0.9, -1.1, 1.3, 0.2]))
    motion = [*(a[0] for a in draw(4, 1)[1:])]
    bounds = robot.share_bounds(q, *motion, shares=("torque", "acceleration"))
    np.testing.assert_allclose(
        bounds.value["torque"], robot.constraints.partial_torque(q, *motion), rtol=0, atol=1e-12
    )
    ends = [package.load(bodies=bounds.bodies("crank", "slider", end=end)) for end in ("least", "greatest")]
    for other, bound in zip(ends, (bounds.least, bounds.greatest), strict=True):
        tau = other.constraints.partial_torque(q, *motion)
        assert tau[0, 1] == pytest.approx(bound["torque"][0, 1], rel=1e-6, abs=1e-9)
        np.testing.assert_allclose(tau.sum(-1), bounds.value["torque"].sum(-1), rtol=0, atol=1e-9)
    with pytest.raises(ValueError, match="measured names knee, which follows others by ties"):
        robot.identifiability(["knee"])


def test_every_back_end_of_rigid_links_says_the_same(package_of: Packages) -> None:
    pytest.importorskip("torch")
    package = package_of("planar3 symbolic")
    values = {"m_2": 0.9, "l_1": 0.3}
    first, other = (package.load(name, values) for name in ("numpy", "torch"))
    one, two = (robot.share_bounds(*README) for robot in (first, other))
    np.testing.assert_allclose(two.greatest["torque"], one.greatest["torque"], rtol=1e-9)
    np.testing.assert_allclose(one.value["torque"], first.partial_torque(*README), rtol=0, atol=1e-12)
    assert str(other.identifiability()) == str(first.identifiability())
    with pytest.raises(ValueError, match="on autograd are energies, which have no ten inertial parameters"):
        package.load("autograd").identifiability()


def test_what_nothing_drives_determines_nothing(tmp_path: Path) -> None:
    box = '<body name="box"><freejoint/><geom type="box" size=".1 .2 .3" mass="2"/></body>'
    (tmp_path / "box.xml").write_text(f"<mujoco><worldbody>{box}</worldbody></mujoco>")
    write_package(generate(read_system(tmp_path / "box.xml"), ["numpy"]), tmp_path / "box")
    with pytest.raises(ValueError, match="nothing drives a joint of box; name those with `measured`"):
        import_package(tmp_path / "box").load().identifiability()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"masses": -0.1}, "masses is -0.1; give a part of the claimed mass"),
        ({"masses": {"link9": 0.1}}, "masses is 'link9'; choose a link"),
        ({"masses": {"link2": (0.5, 0.1)}}, r"masses\['link2'\] is \(0.5, 0.1\); give"),
        ({"masses": {"link3": (5.0, 6.0)}}, "link 'link3' outside of its own; widen `masses`"),
        ({"measured": ["elbow"]}, "measured is 'elbow'; choose a joint|measured"),
        ({"measured": []}, "measured is empty"),
        ({"shares": "power"}, "shares has 'power'; choose among torque, acceleration"),
        ({"joints": [7]}, "joints is 7; choose a joint"),
        ({"shares": "reactions", "joints": ["hip"]}, "joints is 'hip'; choose a joint"),
        ({"qd": [0.0, np.nan, 0.0]}, "NaN or infinite"),
        ({"q": np.zeros((4, 3))}, r"samples of shape \(4,\); give one position"),
    ],
)
def test_bad_input_is_told_in_one_line(given: dict[str, Any], message: str, package_of: Packages) -> None:
    motion = dict(zip(("q", "qd", "qdd"), README, strict=True))
    with pytest.raises(ValueError, match=message) as told:
        package_of("planar3").load().share_bounds(**(motion | given))
    assert "\n" not in str(told.value)


def test_what_cannot_be_answered_is_refused_by_name(
    package_of: Packages, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ValueError, match="links of cart_pendulum are energies"):
        package_of(CART).load("numpy").identifiability()
    package = package_of("planar3")
    own = package.bodies()
    turned = own._replace(inertias=-own.inertias)
    with pytest.raises(ValueError, match="link 'link1' is not a possible body"):
        package.load(bodies=turned).share_bounds(*README)
    many = own._replace(masses=np.ones((5, 3)))
    with pytest.raises(ValueError, match="loaded with samples of parameters or bodies"):
        package.load(bodies=many).identifiability()
    bounds = package.load().share_bounds(*README)
    with pytest.raises(ValueError, match="joint3, link3 is zero, follows from joint torques"):
        bounds.bodies("joint3", "link3")
    borne = package.load().share_bounds(*README, shares="reactions")
    with pytest.raises(
        ValueError, match=r"component is 'up'; choose a component by number, 0\.\.5, or by name: moment_x"
    ):
        borne.bodies("joint1", "link3", kind="reactions", component="up")
    monkeypatch.setitem(sys.modules, "clarabel", None)
    with pytest.raises(ImportError, match="pip install clarabel"):
        package.load().share_bounds(*README)
