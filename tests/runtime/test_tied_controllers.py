"""Controllers under ties and contacts: kinds of arrays, gradients, choices, motion in time, messages."""

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from helpers.answers import relative_error
from helpers.walker import Q, feet, moving, walker_in
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from scipy.linalg import null_space

torch = pytest.importorskip("torch")

BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
FOURBAR = f"{DATA / 'fourbar.toml'} loops"


@pytest.fixture(scope="module")
def walker(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    return walker_in(tmp_path_factory.mktemp("walker"))


def as_kind(backend: str, *arrays: Any) -> list[Any]:
    return [torch.from_numpy(a) if backend in ("torch", "autograd") else a for a in arrays]


@pytest.mark.parametrize("backend", BACKENDS)
def test_back_ends_say_the_same_of_one_state_and_of_many(
    backend: str, package_of: Callable[[str], ModuleType], walker: ModuleType
) -> None:
    loop = package_of(FOURBAR)
    bent = Q + 0.1 * np.random.default_rng(1).uniform(-1.0, 1.0, (3, 7))
    turned = loop.load("numpy").constraints.closed(np.array([[0.5], [0.9], [1.4]]))
    for package, q, sides in ((loop, turned, ""), (walker, bent, "rl"), (walker, bent, "r")):
        known, model = package.load("numpy"), package.load(backend)
        made = []
        for robot in (known, model):
            ties = robot.constrained(contacts=feet(package, sides)) if sides else None
            link = robot.link_names[-1]
            soft = robot.partial_impedance(package.Natural({link: 0.5}), 2.0, 3.0, constraints=ties)
            made.append((soft, robot.cancel({(None, robot.link_names[1], None, None)}, constraints=ties)))
        qd = moving(known.constrained(contacts=feet(package, sides)) if sides else known.constraints, q)
        for control, other in zip(*made, strict=True):
            assert control.undriven == (1 if sides == "r" else 0) == other.undriven
            expected = np.stack([control(*state) for state in zip(q, qd, 0.9 * q, strict=True)])
            found = other(*as_kind(backend, q, qd, 0.9 * q))
            assert relative_error(np.asarray(found), expected) <= 1e-11
            single = other(*as_kind(backend, q[0], qd[0], 0.9 * q[0]))
            assert relative_error(np.asarray(single), expected[0]) <= 1e-11
            moved, borne = (getattr(other, call)(*as_kind(backend, q, qd, 0.9 * q)) for call in CALLS)
            assert relative_error(np.asarray(moved), control.acceleration(q, qd, 0.9 * q)) <= 1e-11
            assert relative_error(np.asarray(borne), control.forces(q, qd, 0.9 * q)) <= 1e-11


CALLS = ("acceleration", "forces")


def test_an_open_tree_is_controlled_by_some_of_its_joints(package_of: Callable[[str], ModuleType]) -> None:
    """The arm's own equations, with a motor at one joint: it moves as asked, the others as they fall."""
    package = package_of("planar3")
    robot = package.load("numpy")
    q, qd, at = np.random.default_rng(3).uniform(-1.0, 1.0, (3, 3))
    wanted = {"stiffness": 3.0, "damping": package.Natural(plus=0.4)}
    control, whole = (robot.partial_impedance(**wanted, actuated=joints) for joints in (["joint2"], None))
    assert (control.actuated, control.undriven) == (("joint2",), 2)
    assert whole.actuated == robot.joint_names
    tau = control(q, qd, at)
    assert not tau[[0, 2]].any()
    qdd = robot.forward_dynamics(q, qd, tau)
    assert relative_error(control.acceleration(q, qd, at), qdd) <= 1e-12
    assert abs(qdd[1] - whole.acceleration(q, qd, at)[1]) <= 1e-12 * np.abs(qdd).max()
    assert not control.dissipative
    assert whole.dissipative
    # An equal choice in other words is the same torque.
    every = robot.partial_impedance(**wanted, actuated=list(robot.joint_names))
    np.testing.assert_array_equal(every(q, qd, at), whole(q, qd, at))


def test_gradients_flow_along_what_ties_leave(
    package_of: Callable[[str], ModuleType], walker: ModuleType
) -> None:
    loop = package_of(FOURBAR).load("torch")
    gain = torch.tensor([0.7, 0.5, 0.9], dtype=torch.float64, requires_grad=True)
    spring = torch.tensor([2.0, 1.0, 3.0], dtype=torch.float64, requires_grad=True)
    crank, speed = (torch.tensor([x], dtype=torch.float64, requires_grad=True) for x in (0.8, 1.3))

    def of_loop(crank: Any, speed: Any, gain: Any, spring: Any) -> Any:
        q = loop.constraints.closed(crank)
        qd = loop.constraints.velocity(q, speed)
        control = loop.partial_impedance(1.0, gain, spring)
        return control(q, qd, 0.0 * q)

    assert torch.autograd.gradcheck(of_loop, (crank, speed, gain, spring))
    robot = walker.load("torch")
    for sides in ("rl", "r"):  # redundant torques, and motions that nothing drives
        ties = robot.constrained(contacts=feet(walker, sides))
        q = torch.tensor(Q, requires_grad=True)
        yd = torch.linspace(-1.0, 1.0, len(ties.independent), dtype=torch.float64, requires_grad=True)

        def of_walker(q: Any, yd: Any, gain: Any, ties: Any = ties) -> Any:
            control = robot.partial_impedance(
                damping=walker.Natural(plus=gain[0]), stiffness=2.0, constraints=ties
            )
            qd = ties.velocity(q, yd)
            return torch.cat([control(q, qd, 0.0 * q), control.acceleration(q, qd, 0.0 * q)])

        assert torch.autograd.gradcheck(of_walker, (q, yd, gain), atol=1e-4)


def test_learned_gains_are_read_anew_and_refused(package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of(FOURBAR).load("torch")
    gain = torch.full((3,), 0.5, dtype=torch.float64)
    control = robot.partial_impedance(damping=gain)
    q = robot.constraints.closed(torch.tensor([0.5], dtype=torch.float64))
    qd = robot.constraints.velocity(q, torch.ones(1, dtype=torch.float64))
    before = control(q, qd)
    gain *= 2.0
    assert (control(q, qd) - before).abs().max() > 0.1
    gain *= -1.0
    with pytest.raises(ValueError, match="damping is not positive or zero"):
        control(q, qd)


def test_copies_are_those_of_the_copied_robot(walker: ModuleType) -> None:
    robot = walker.load("numpy")
    ties = robot.constrained(contacts=feet(walker))
    control = robot.partial_impedance(stiffness=3.0, constraints=ties, torque_weight=[1.0, 2.0, 1.0, 2.0])
    qd = moving(ties, Q)
    for made in (copy.deepcopy(control), pickle.loads(pickle.dumps(control))):
        np.testing.assert_array_equal(made(Q, qd, 0.0 * Q), control(Q, qd, 0.0 * Q))
        assert made.actuated == control.actuated == ("hip_r", "knee_r", "hip_l", "knee_l")


def test_torques_are_the_least_by_their_weights(walker: ModuleType) -> None:
    """The least sum w tau^2 has V' W tau = 0, for changes V that move nothing."""
    robot, weight = walker.load("numpy"), np.array([1.0, 2.0, 3.0, 9.0])
    ties = robot.constrained(contacts=feet(walker))
    control = robot.partial_impedance(stiffness=3.0, constraints=ties, torque_weight=weight)
    driven = [robot.joint_names.index(name) for name in control.actuated]
    tau = control(Q, moving(ties, Q), 0.0 * Q)[driven]
    idle = null_space(ties.velocity_map(Q)[driven].T)
    assert idle.shape == (4, 1)
    np.testing.assert_allclose(idle.T @ (weight * tau), 0.0, atol=1e-9 * np.abs(tau).max())
    changes = control._actuators.idle(ties.velocity_map(Q))
    np.testing.assert_allclose(changes.T @ (weight[:, None] * changes), np.eye(1), atol=1e-12)
    assert np.linalg.matrix_rank(np.hstack([idle, changes]), tol=1e-9) == 1


def test_a_frame_of_a_loop_has_the_impedance_asked_for(package_of: Callable[[str], ModuleType]) -> None:
    """The platform of a delta arm, as a point of 2 kg on springs: m a + d v + k x = F for a push F."""
    package = package_of(f"{DATA / 'delta.toml'} loops")
    robot = package.load("numpy")
    ties, kinematics = robot.constraints, robot.kinematics
    rest = ties.closed_position
    q = ties.closed(rest + np.r_[0.1, -0.05, 0.08, 0.0, 0.0, 0.0])
    qd = moving(ties, q)
    rows, force = ("x", "y", "z"), np.array([1.0, -2.0, 0.5])
    frame = package.FrameImpedance("platform", 2.0, 5.0, 80.0, rows=rows)
    control = robot.partial_impedance(frame=frame)
    push = -kinematics.load_torque(q, "platform", force=force)
    target = package.Target(pose=kinematics.pose(rest, "platform"))
    tau = control(q, qd, target, push)
    motion = ties.forward_dynamics(q, qd, tau + push)
    moved = kinematics.acceleration(q, qd, motion.qdd, "platform")[3:]
    away = kinematics.pose(q, "platform")[:3, 3] - target.pose[:3, 3]
    law = 2.0 * moved + 5.0 * kinematics.velocity(q, qd, "platform")[3:] + 80.0 * away
    np.testing.assert_allclose(law, force, atol=1e-9)
    # What is natural needs no measured force.
    own = package.FrameImpedance("platform", stiffness=80.0, rows=rows)
    natural = robot.partial_impedance(frame=own)
    np.testing.assert_allclose(natural(q, qd, target, push), natural(q, qd, target), atol=1e-12)
    # Of its own inertia and velocity forces alone the platform's energy stays in time.
    still = package.Target(pose=target.pose)
    path = robot.simulate(q, qd, np.linspace(0.0, 0.2, 41), lambda t, q, qd: natural(q, qd, still), step=1e-3)
    energy = natural.stored_energy(path.q, path.qd, still)
    assert np.ptp(energy) < 1e-7 * energy.max()
    assert np.ptp(np.sum(path.qd**2, -1)) > 0.1


def test_a_loop_with_a_lighter_link_moves_as_one_of_lighter_links(tmp_path: Path) -> None:
    """In time: half of the rod's share, and weight borne, against a package of such a mechanism."""
    text = (DATA / "fourbar.toml").read_text()
    light = text.replace("mass = 0.9", "mass = 0.45").replace(
        "yy = 0.007, zz = 0.0071", "yy = 0.0035, zz = 0.00355"
    )
    light = light.replace("xx = 0.0002, yy = 0.0035", "xx = 0.0001, yy = 0.0035").replace("-9.81", "0")
    assert light.count("0.45") == 1
    robots = []
    for name, said in (("whole", text), ("light", light)):
        (tmp_path / f"{name}.toml").write_text(said)
        write_package(generate(read_system(tmp_path / f"{name}.toml"), ["numpy"]), tmp_path / name)
        robots.append(import_package(tmp_path / name))
    whole, other = (package.load("numpy") for package in robots)
    half = robots[0].Natural({"rod": 0.5})
    control = whole.partial_impedance(half, half, stiffness=[0.3, 0.0, 0.2])
    q = whole.constraints.closed(np.array([0.6]))
    qd, time = whole.constraints.velocity(q, np.array([3.0])), np.linspace(0.0, 0.6, 31)
    found = whole.simulate(q, qd, time, lambda t, q, qd: control(q, qd, 0.0 * q), method="DOP853")
    spring = np.array([0.3, 0.0, 0.2])
    expected = other.simulate(q, qd, time, lambda t, q, qd: -spring * q, method="DOP853")
    np.testing.assert_allclose(found.q, expected.q, atol=1e-7)
    assert np.ptp(found.q[:, 0]) > 1.0
    energy = control.stored_energy(found.q, found.qd, 0.0 * q)
    assert control.dissipative
    assert np.ptp(energy) < 1e-7 * energy.max()


def test_what_cannot_be_is_refused_by_name(
    package_of: Callable[[str], ModuleType], walker: ModuleType
) -> None:
    robot, loop = walker.load("numpy"), package_of(FOURBAR).load("numpy")
    ties, one = (robot.constrained(contacts=feet(walker, sides)) for sides in ("rl", "r"))
    soft = robot.partial_impedance
    for given, message in (
        ({"constraints": loop.constraints}, "constraints are of another robot than this walker"),
        ({"actuated": ["hip"]}, "actuated is 'hip'|no joint 'hip'"),
        ({"actuated": ["hip_r", "hip_r"]}, "which names a joint twice"),
        ({"actuated": []}, "actuated names no joint"),
        ({"torque_weight": [1.0]}, "torque_weight is .* give a number above 0 for each of x, z, pitch"),
        ({"torque_weight": {"x": 1.0}}, "torque_weight is {'x': 1.0}; give a number above 0 for each"),
        (
            {"constraints": ties, "torque_weight": [1.0, 0.0, 1.0, 1.0]},
            "each of hip_r, knee_r, hip_l, knee_l",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            soft(**given)
    with pytest.raises(TypeError, match="actuated is 'hip_r'; give a list of joints"):
        soft(actuated="hip_r")
    with pytest.raises(TypeError, match="give what robot"):
        soft(constraints=3)
    frame = walker.FrameImpedance("trunk", rows=("x", "z"))
    soft(frame=frame, constraints=ties)
    with pytest.raises(ValueError, match=r"cannot have an impedance while hip_r, .* leave 1 of the robot's"):
        soft(frame=frame, constraints=one)
    with pytest.raises(ValueError, match="walker has no ties here whose forces could be told"):
        soft().forces(Q, 0.0 * Q)
    with pytest.raises(ValueError, match=r"pin is open by .*give positions in which ties close"):
        loop.partial_impedance()(np.array([0.5, 0.5, 0.5]), np.zeros(3))


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_sample_that_is_no_number_leaves_the_others_theirs(backend: str, walker: ModuleType) -> None:
    """LAPACK and conic solvers refuse what has a NaN; a controller without check_finite says NaN."""
    robot = walker.load(backend)
    ties = robot.constrained(contacts=feet(walker))
    q = Q + 0.02 * np.random.default_rng(3).uniform(-1.0, 1.0, (3, 7))
    qd, wanted = moving(walker.load("numpy").constrained(contacts=feet(walker)), q), 0.9 * q
    grips = [walker.Grip(side, 0.5) for side in "rl"]
    for given in (
        {"constraints": ties},
        {"constraints": ties, "grips": grips},
        {"constraints": robot.constrained(contacts=feet(walker, "r"))},
        {"actuated": ["hip_r", "knee_r", "hip_l", "knee_l"]},
    ):
        control = robot.partial_impedance(stiffness=2.0, **given)
        whole = np.asarray(control(*as_kind(backend, q, qd, wanted)))
        state = [q.copy(), qd.copy(), wanted.copy()]
        for part in state:
            part[1] = np.nan
        found = np.asarray(control(*as_kind(backend, *state)))
        assert np.isnan(found[1][3:]).all()
        np.testing.assert_allclose(found[::2], whole[::2], rtol=0, atol=1e-6)


def test_a_dead_centre_is_told(tmp_path: Path, package_of: Callable[[str], ModuleType]) -> None:
    """Where the rocker is driven, and crank and rod lie in line, it cannot turn the crank."""
    robot = package_of(FOURBAR).load("numpy")
    crank, rod, rocker, ground = 0.12, 0.31, 0.24, 0.28
    reach = crank + rod
    turn = np.arccos((reach**2 + ground**2 - rocker**2) / (2.0 * reach * ground))
    tip = reach * np.array([np.cos(turn), np.sin(turn)])
    q = np.array([turn, 0.0, np.arctan2(tip[1], tip[0] - ground)])
    control = robot.partial_impedance(actuated=["c"])
    q = robot.constraints.closed(q)
    assert not control.undriven
    with pytest.raises(
        ValueError, match="what drives the robot, c, cannot drive a at sample 0, as at a dead"
    ):
        control(q[None], 0.0 * q)
    away = robot.constraints.closed(q + np.r_[0.3, 0.0, 0.0])
    assert np.isfinite(control(away, 0.0 * q)).all()


def test_no_controller_of_a_cut_loop_unless_asked_for(package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of(FOURBAR).load("numpy")
    q = np.array([0.5, 0.2, -0.3])
    cut = robot.partial_impedance(constraints=False)
    assert cut.actuated == robot.joint_names
    np.testing.assert_allclose(cut(q, 0.0 * q), robot.gravity_torque(q), atol=1e-12)
