"""`partial_impedance` and `cancel`: kinds of arrays, gradients, the joints' own torques, messages."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from helpers.answers import random_states, relative_error
from helpers.urdf_text import chain, joint
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.answers.inertia_solve import Told
from linkwise_runtime.control.joint_impedance import JointImpedance
from linkwise_runtime.control.target_solve import TargetInertia, solve_target

torch = pytest.importorskip("torch")

Packages = Callable[[str], ModuleType]
Q = np.array([0.3, -0.5])
BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
CRANE = f"{DATA / 'crane.urdf'} loops"
SPRUNG = """schema = 1
name = "sprung"
gravity = [0, -9.81, 0]
link = [
  {name = "base"},
  {name = "one", mass = 2.0, com = [0.2, 0, 0], inertia = {xx = 0.1, yy = 0.1, zz = 0.05}},
  {name = "two", mass = 1.0, com = [0.1, 0.05, 0], inertia = {xx = 0.1, yy = 0.1, zz = 0.05}},
]

[[joint]]
name = "a"
parent = "base"
child = "one"
stiffness = 3.0
rest = 0.2
damping = 0.5
armature = 0.3

[[joint]]
name = "b"
parent = "one"
child = "two"
xyz = [0.4, 0, 0]
friction = 0.4
armature = 0.1
"""


@pytest.fixture(scope="module")
def sprung(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    folder = tmp_path_factory.mktemp("sprung")
    (folder / "sprung.toml").write_text(SPRUNG, encoding="utf-8")
    write_package(generate(read_system(folder / "sprung.toml")), folder / "sprung")
    return import_package(folder / "sprung")


def as_kind(backend: str, *arrays: Any) -> list[Any]:
    return [torch.from_numpy(a) if backend in ("torch", "autograd") else a for a in arrays]


@pytest.mark.parametrize("robot", ["torso", CRANE], ids=["torso", "crane"])
@pytest.mark.parametrize("backend", BACKENDS)
def test_every_back_end_says_the_same_of_one_state_and_of_many(
    robot: str, backend: str, package_of: Packages
) -> None:
    package = package_of(robot)
    known, model = package.load("numpy"), package.load(backend)
    n, link, joint = known.n, known.link_names[-1], known.joint_names[-1]
    q, qd, qdd = random_states(n, 3, seed=2)
    row = np.arange(1.0, n + 1.0)
    frame = package.FrameImpedance(link, damping=package.Natural(plus=2.0), stiffness=9.0, rows=("z",))
    chosen = (
        {"inertia": package.Natural({link: 0.5}), "damping": row, "stiffness": 2.0 * row},
        {
            "inertia": {(joint, link, joint): 9.0},
            "damping": {(0, joint_link(known), 0): 3.0},
            "stiffness": 2.0,
        },
        {"frame": frame},
    )
    for given in chosen:
        controller, same = known.partial_impedance(**given), model.partial_impedance(**given)
        targets = [target(package, known, at, "frame" in given) for at in qdd]
        expected = np.stack([controller(*state) for state in zip(q, qd, targets, strict=True)])
        whole = target(package, known, qdd, "frame" in given)
        moved = package.Target(*(a if a is None else as_kind(backend, a)[0] for a in whole))
        assert relative_error(np.asarray(same(*as_kind(backend, q, qd), moved)), expected) <= 1e-11
        single = same(*as_kind(backend, q[0], qd[0]), targets[0])
        assert relative_error(np.asarray(single), expected[0]) <= 1e-11
        follows = same.acceleration(*as_kind(backend, q[0], qd[0]), targets[0])
        assert relative_error(np.asarray(follows), controller.acceleration(q[0], qd[0], targets[0])) <= 1e-11
    names = {(0, link, None, None), (0, joint_link(known), 0, 1)}
    expected = np.stack([known.cancel(names)(a, b, c) for a, b, c in zip(q, qd, qdd, strict=True)])
    known_cancel, cancel = known.cancel(names), model.cancel(names)
    assert relative_error(np.asarray(cancel(*as_kind(backend, q, qd, qdd))), expected) <= 1e-11
    one, task = as_kind(backend, q[0], qd[0]), as_kind(backend, row)[0]
    given = known_cancel(q[0], qd[0], row, qdd=qdd[0])
    assert relative_error(np.asarray(cancel(*one, task, qdd=as_kind(backend, qdd[0])[0])), given) <= 1e-11
    follows = known_cancel.acceleration(q[0], qd[0], row)
    assert relative_error(np.asarray(cancel.acceleration(*one, task)), follows) <= 1e-11


@needs_compiler
def test_c_answers_accelerations_and_what_is_cancelled_at_one(
    package_of: Packages, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, state = package_of("torso").load("native"), np.full(7, 0.3)
    spring, cancel = robot.partial_impedance(stiffness=2.0), robot.cancel({(0, 0, 0, 1)})
    monkeypatch.setattr(JointImpedance, "state", None)  # what arrays go through
    assert np.isfinite(
        [spring.acceleration(state, state, 0.0 * state), cancel.acceleration(state, state)]
    ).all()
    assert np.isfinite(cancel(state, state, qdd=state)).all()


def joint_link(model: Any) -> int:
    """A link that joint 0 moves."""
    return next(j for j, path in enumerate(model.structure.paths) if 0 in path)


def target(package: ModuleType, model: Any, at: Any, of_frame: bool) -> Any:
    joints = at, 0.1 * at, 0.2 * at
    if not of_frame:
        return package.Target(*joints)
    return package.Target(
        *joints, model.kinematics.pose(at, model.link_names[-1]), np.arange(6.0), np.ones(6)
    )


def test_gradients_flow_through_motion_gains_and_targets(package_of: Packages) -> None:
    package = package_of("torso")
    model = package.load("torch")
    q, qd, at = (torch.from_numpy(a[0]).requires_grad_() for a in random_states(model.n, 1, seed=4))
    gains = [torch.full((model.n,), x, dtype=torch.float64, requires_grad=True) for x in (2.0, 3.0, 4.0)]

    def torque(q: Any, qd: Any, at: Any, *gains: Any) -> Any:
        return model.partial_impedance(*gains)(q, qd, at)

    assert torch.autograd.gradcheck(torque, (q, qd, at, *gains))
    link = model.link_names[-1]
    pose = model.kinematics.pose(0.9 * q.detach(), link)

    def frame_torque(q: Any, qd: Any, damping: Any, stiffness: Any) -> Any:
        rows = ("rx", "ry", "x")
        frame = package.FrameImpedance(link, package.Natural(0.7, plus=1.0), damping, stiffness, rows)
        return model.partial_impedance(frame=frame)(q, qd, package.Target(pose=pose))

    own = [torch.tensor([3.0, 2.0, 4.0], dtype=torch.float64, requires_grad=True) for _ in range(2)]
    assert torch.autograd.gradcheck(frame_torque, (q, qd, *own))
    # at the target itself, where the rotation vector is zero
    there = model.kinematics.pose(q, link).detach()
    frame = package.FrameImpedance(link, package.Natural(plus=1.0), stiffness=5.0, rows=("rx", "ry", "x"))
    pull = model.partial_impedance(frame=frame)(q, qd, package.Target(pose=there)).sum()
    assert torch.isfinite(torch.autograd.grad(pull, q)[0]).all()


def test_learned_gains_that_are_positive_no_more_are_refused(package_of: Packages) -> None:
    model = package_of("torso").load("torch")
    gain = torch.ones(model.n, dtype=torch.float64, requires_grad=True)
    controller, rest = model.partial_impedance(stiffness=gain), torch.zeros(model.n)
    controller(rest, rest, rest)
    with torch.no_grad():
        gain[1] = -1.0
    with pytest.raises(
        ValueError, match="stiffness is not positive or zero: along waist_lean it is negative"
    ):
        controller(rest, rest, rest)


@needs_compiler
@pytest.mark.parametrize("count", [16, 24, 40])
def test_long_arms_are_controlled_in_single_precision(count: int, tmp_path: Path) -> None:
    """gcc 12 wrote whole vectors beside their alignment here, of some lengths only."""
    write_package(generate(read_system(f"planar{count}"), kernel="loops"), tmp_path / "arm")
    package = import_package(tmp_path / "arm")
    q, qd = np.linspace(0.1, 0.5, count), np.linspace(-0.2, 0.3, count)
    frame = package.FrameImpedance(f"link{count}", stiffness=2.0, rows=("x", "rz"))
    robot = package.load("native")
    target = package.Target(pose=robot.kinematics.pose(q + 0.01, f"link{count}"))
    expected = package.load("numpy").partial_impedance(frame=frame)(q, qd, target)
    control = robot.partial_impedance(frame=frame)
    assert relative_error(control(q, qd, target), expected) <= 1e-9
    # Torques are better known than these.
    q, qd, pose = (a.astype(np.float32) for a in (q, qd, target.pose))
    with pytest.warns(RuntimeWarning, match="float32 knows the accelerations"):
        found = control(q, qd, target._replace(pose=pose))
    assert relative_error(found, expected) <= 1e-5


def test_half_of_the_digits_of_a_wanted_inertia_are_asked_for(sprung: ModuleType) -> None:
    def control(left: float) -> None:
        """left: of either joint's inertia when the other moves freely."""
        beside = np.sqrt(1.0 - left)
        inertia = np.array([[1.0, beside], [beside, 1.0]])
        sprung.load("numpy").partial_impedance(inertia, 2.0, 5.0)(Q, Q, 0.0 * Q)

    control(1e-6)  # warnings are errors here
    with pytest.warns(RuntimeWarning, match="float64 knows"):
        control(3e-9)


@needs_compiler
def test_c_pulls_a_frame_of_one_sample(package_of: Packages, monkeypatch: pytest.MonkeyPatch) -> None:
    """Arrays have no part in it: C has answered before they are asked."""
    package = package_of("puma560")
    robot, q = package.load("native"), np.linspace(0.1, 0.6, 6)
    frame = package.FrameImpedance(robot.kinematics.frames[-1], stiffness=2.0, damping=1.0)
    pose = robot.kinematics.pose(q + 0.01, frame.frame)
    target = package.Target(pose=pose, velocity=np.ones(6), acceleration=np.ones(6))
    expected = package.load("numpy").partial_impedance(frame=frame)(q, q, target)
    control = robot.partial_impedance(frame=frame)
    monkeypatch.setattr(type(control), "_followed", lambda *asked: pytest.fail("arrays were asked"))
    assert relative_error(control(q, q, target), expected) <= 1e-9


def test_a_controller_maps_over_samples(package_of: Packages) -> None:
    model = package_of("torso").load("torch")
    q, qd, at = (torch.from_numpy(a) for a in random_states(model.n, 4, seed=5))
    controller = model.partial_impedance(2.0, 3.0, 4.0)
    mapped = torch.func.vmap(lambda *state: controller(*state))(q, qd, at)
    assert relative_error(mapped, controller(q, qd, at)) <= 1e-12


def test_samples_may_lie_along_several_axes(package_of: Packages) -> None:
    model = package_of("planar3").load("numpy")
    q, qd, at = random_states(3, 10, seed=5)
    controller = model.partial_impedance(2.0, 3.0, 4.0)
    shaped = controller(*(a.reshape(2, 5, 3) for a in (q, qd, at)))
    assert relative_error(shaped.reshape(10, 3), controller(q, qd, at)) <= 1e-14


@pytest.mark.parametrize("positive", [True, False])
def test_a_wanted_inertia_is_solved_in_any_unit(positive: bool) -> None:
    """A regular one may have zeros on its diagonal, so it is measured by what it is made from."""
    about = TargetInertia("singular", Told("hardly known", ("a", "b")))
    wanted = np.array([[2.0, 1.0], [1.0, 2.0]]) if positive else np.array([[0.0, 1.0], [1.0, 0.0]])
    for unit in (1.0, 1e-20, 1e20):
        found = solve_target(about, unit * wanted, unit * np.ones((2, 1)), 2.0 * unit * np.ones(2), positive)
        np.testing.assert_allclose(found, np.full((2, 1), 1 / 3 if positive else 1.0), rtol=1e-14)


@pytest.mark.parametrize("backend", BACKENDS)
def test_joints_own_torques_are_compensated_and_armature_is_kept(backend: str, sprung: ModuleType) -> None:
    model, known = sprung.load(backend), sprung.load("numpy")
    q, qd, at, force = (np.array(row) for row in ([0.3, -0.5], [0.7, 0.4], [0.1, 0.2], [1.0, -2.0]))
    armature = np.diag([0.3, 0.1])

    def torque(controller: Any, *state: Any) -> Any:
        return np.asarray(controller(*as_kind(backend, *state)))

    def accelerated(controller: Any, passive: bool = True) -> Any:
        return known.forward_dynamics(q, qd, torque(controller, q, qd, at, force) + force, passive=passive)

    pull = force - 2.0 * qd - 5.0 * (q - at)
    smooth = {"friction_width": 1e-3}  # so narrow that all of it is compensated
    whole = model.partial_impedance(4.0, 2.0, 5.0, **smooth)
    assert relative_error(accelerated(whole), pull / 4.0) <= 1e-12
    shares = np.zeros((2, 2, 2))
    shares[0, 1, 0] = shares[1, 1, 1] = 4.0
    beside = model.partial_impedance(shares, 2.0, 5.0, **smooth)
    assert relative_error(accelerated(beside), np.linalg.solve(4.0 * np.eye(2) + armature, pull)) <= 1e-12
    natural = model.partial_impedance(damping=2.0, stiffness=5.0, **smooth)
    unmeasured = torque(natural, q, qd, at)  # no force need be measured
    assert relative_error(unmeasured, torque(natural, q, qd, at, force)) <= 1e-12
    mass = known.mass_matrix(q) + armature
    assert relative_error(accelerated(natural), np.linalg.solve(mass, pull)) <= 1e-12
    bare = model.partial_impedance(4.0, 2.0, 5.0, passive=False)
    assert relative_error(accelerated(bare, passive=False), pull / 4.0) <= 1e-12


@pytest.mark.parametrize("backend", BACKENDS)
def test_friction_is_compensated_only_as_smoothly_as_is_asked_for(backend: str, sprung: ModuleType) -> None:
    """The sign of a velocity is, at rest, that of a sensor's noise."""
    model, kinds = sprung.load(backend), {}
    frame = sprung.FrameImpedance("two", damping=3.0, rows=("x",))
    for name, given in (("natural", {}), ("whole", {"inertia": 4.0}), ("frame", {"frame": frame})):
        kinds[name] = lambda qd, given=given, **how: np.asarray(
            model.partial_impedance(damping=2.0, **given, **how)(*as_kind(backend, Q, qd))
        )
    kinds["cancel"] = lambda qd, **how: np.asarray(
        model.cancel({("a", "two", None, 1)}, **how)(*as_kind(backend, Q, qd))
    )
    noise, fast = np.array([0.3, 1e-9]), np.array([0.3, 0.4])
    flip = np.array([1.0, -1.0])
    for name, torque in kinds.items():
        for how in ({}, {"friction_width": 0.02}):
            assert np.abs(torque(noise, **how) - torque(flip * noise, **how)).max() < 1e-6, (name, how)
        for width in (0.02, 1.0):
            compensated = torque(fast, friction_width=width) - torque(fast)
            np.testing.assert_allclose(compensated, [0.0, 0.4 * np.tanh(0.4 / width)], atol=1e-12)


@pytest.mark.parametrize("width", [0.0, -1.0, np.nan, np.inf, True, "wide"])
def test_a_width_that_is_no_velocity_is_refused(width: Any, sprung: ModuleType) -> None:
    model = sprung.load()
    for made in (model.partial_impedance, lambda **how: model.cancel({(0, 0, 0, 1)}, **how)):
        with pytest.raises(ValueError, match=r"^friction_width is .*; give a velocity above 0") as caught:
            made(friction_width=width)
        assert "\n" not in str(caught.value)
        with pytest.raises(ValueError, match=r"^friction_width is given, and passive=False takes friction"):
            made(friction_width=0.1, passive=False)


def test_hand_written_energies_are_controlled_too(package_of: Packages) -> None:
    package = package_of(str(DATA / "turntable.py"))  # its energy has terms linear in the velocities
    model = package.load("numpy")
    q, qd, at = (a[0] for a in random_states(model.n, 1, seed=6))
    controller = model.partial_impedance(4.0, 2.0, 5.0)
    expected = (-2.0 * qd - 5.0 * (q - at)) / 4.0
    assert relative_error(model.forward_dynamics(q, qd, controller(q, qd, at)), expected) <= 1e-12
    assert not controller.dissipative
    natural, step = model.natural_impedance(q, qd, at), 1e-6 * np.eye(model.n)
    slopes = [model.partial_torque(q, qd + e, at) - model.partial_torque(q, qd - e, at) for e in step]
    np.testing.assert_allclose(natural.damping, np.stack(slopes, -1) / 2e-6, atol=1e-7)
    with pytest.raises(ValueError, match="are energies, which do not say where anything is"):
        model.partial_impedance(frame=package.FrameImpedance(0))


def test_targets_that_cannot_be_are_refused_in_one_line(package_of: Packages) -> None:
    package = package_of("planar3")
    robot, frame, natural = package.load("numpy"), package.FrameImpedance, package.Natural
    first = ("joint1", "link3")
    inertias = (
        (-1.0, "inertia is not positive: along joint1"),
        ([1.0, 0.0, 1.0], "inertia is not positive: along joint2"),
        ([1.0, 2.0], r"inertia has shape \(2,\); give a number, \(3,\) for a diagonal"),
        ([1.0, np.nan, 2.0], "inertia has numbers that are not finite"),
        (natural(-1.0), "inertia.scale is -1; give 0 or above"),
        (natural({first: -1.0}), r"of \(joint1, link3\) is -1"),
        (natural({"link4": 1.0}), "inertia.scale: link is 'link4'; choose a link"),
        (natural({("joint3", "link1"): 1.0}), "joint 'joint3' does not move link 'link1'"),
        ({(0, 0): 1.0}, r"entries are \(joint, link, coordinate\)"),
        ({(0, 0, 0): 1.0, ("joint1", 0, 0): 2.0}, "twice, by name and by number"),
    )
    off_path = np.zeros((3, 3, 3))
    off_path[2, 0, 2] = 1.0
    others = (
        ({"stiffness": np.triu(np.ones((3, 3)))}, r"not symmetric: \(joint1, joint2\) is 1"),
        ({"stiffness": -1.0}, "stiffness is not positive or zero"),
        (
            {"damping": natural(plus=-1.0)},
            "damping.plus is not positive or zero: along joint1 it is negative",
        ),
        ({"damping": off_path}, "joint 'joint3' does not move link 'link1'"),
        ({"frame": frame("base", rows=("x",))}, "'base' cannot move along 1 rows, each by itself: 0 joints"),
        ({"frame": frame("link3")}, "'link3' cannot move along 6 rows, each by itself: 3 joints move it"),
        ({"frame": frame("link3", rows=("x",), point=(0, np.nan, 0))}, "frame.point is"),
        ({"frame": frame("link3", rows=("x",), point="abc")}, "frame.point is 'abc'"),
        ({"frame": frame("hand")}, "frame is 'hand'"),
        ({"frame": frame("link3", rows=("x", "x"))}, "choose some of rx, ry, rz, x, y, z"),
        ({"frame": frame("link3", stiffness=-1.0, rows=("x",))}, "frame.stiffness is not positive"),
    )
    for given, message in (*(({"inertia": a}, text) for a, text in inertias), *others):
        with pytest.raises(ValueError, match=message) as caught:
            robot.partial_impedance(**given)
        assert "\n" not in str(caught.value)
    numberless = (
        ({"stiffness": natural()}, "stiffness is Natural, but a position loads nothing by itself"),
        ({"frame": "link3"}, r"frame is 'link3'; give FrameImpedance\('link3', ...\)"),
        ({"inertia": natural}, "which cannot be taken here; give numbers"),
        ({"inertia": natural({"link3": torch.ones(())})}, "give a number, or a whole tensor to learn"),
    )
    for given, message in numberless:
        with pytest.raises(TypeError, match=message):
            robot.partial_impedance(**given)
    point = torch.zeros(3, requires_grad=True)
    with pytest.raises(TypeError, match=r"^frame\.point requires a gradient, which nothing carries"):
        robot.partial_impedance(frame=package.FrameImpedance("link3", point=point))
    with pytest.raises(TypeError, match=r"^contacts\[0\]\.point requires a gradient, which nothing carries"):
        robot.constrained(contacts=[package.Contact("link3", "point", point=point)])
    with pytest.raises(TypeError, match="give a set of"):
        robot.cancel("joint1")
    cancelled = (
        ([("joint3", "link1", None, None)], "is always zero"),
        ([(*first, "joint2", 0)], "cancel 1, of velocity, or 2, of acceleration"),
        ([(0, 2, 1, 2), (*first, "joint2", 2)], "cancelled twice; name it once"),
        ([], "nothing is to be cancelled"),
        ([(0, 1, 2)], r"give \(joint, link, coordinate, order\)"),
    )
    for entries, message in cancelled:
        with pytest.raises(ValueError, match=message):
            robot.cancel(entries)


def test_what_is_added_to_natural_inertia_and_damping_leaves_all_of_them(package_of: Packages) -> None:
    package = package_of("planar3")
    robot, natural = package.load("numpy"), package.Natural(plus=0.5)
    q, qd, push = np.array([[0.1, 0.4, -0.2], [0.7, -0.3, 0.5], [1.0, 2.0, 3.0]])
    moved = robot.partial_impedance(inertia=natural, damping=natural).acceleration(q, qd, external=push)
    mass, damping = (m + 0.5 * np.eye(3) for m in (robot.mass_matrix(q), robot.coriolis_matrix(q, qd)))
    np.testing.assert_allclose(moved, np.linalg.solve(mass, push - damping @ qd), rtol=1e-12)


def test_what_is_cancelled_is_told_in_order(package_of: Packages) -> None:
    robot = package_of("planar3").load("numpy")
    told = robot.cancel([(2, 2, 2, 2), ("joint1", None, "joint2", 1), (0, 2, 0, 2)]).entries
    assert told == (
        ("joint1", "link2", "joint2", 1),
        ("joint1", "link3", "joint1", 2),
        ("joint1", "link3", "joint2", 1),
        ("joint3", "link3", "joint3", 2),
    )


@needs_compiler
def test_c_takes_no_pose_for_one_sample_that_arrays_refuse(package_of: Packages) -> None:
    package = package_of("planar3")
    robot = package.load("native")
    turned = robot.partial_impedance(frame=package.FrameImpedance("link3", stiffness=1.0, rows=("rz",)))
    for pose in (2.0 * np.eye(4), np.zeros((4, 4)), np.diag([1.0, 1.0, -1.0, 1.0])):
        with pytest.raises(ValueError, match=r"target\.pose is no rotation"):
            turned(np.zeros(3), np.zeros(3), package.Target(pose=pose))


@pytest.mark.parametrize("backend", ["numpy", pytest.param("native", marks=needs_compiler)])
def test_rows_that_move_by_rounding_alone_are_told_by_name(backend: str, tmp_path: Path) -> None:
    """Axes that are parallel turn about one line: of x, y and z there is one that no joint moves."""
    ends, skew = ("ab", "bc", "cd"), {"rpy": "0 0 0", "axis": "0.36 0.48 0.8"}
    arm = chain(*(joint(f"j{k}", *pair, **skew) for k, pair in enumerate(ends)))
    (tmp_path / "arm.urdf").write_text(arm)
    write_package(generate(read_system(tmp_path / "arm.urdf"), [backend]), tmp_path / "arm")
    package = import_package(tmp_path / "arm")
    held = package.FrameImpedance("d", rows=("x", "y", "z"), point=(0.1, 0.2, 0.3))
    control = package.load(backend).partial_impedance(frame=held)
    told = r"^frame 'd' (cannot|can hardly) move along rows each by itself: along [xyz], "
    for q in np.random.default_rng(0).uniform(-3.0, 3.0, (100, 3)):
        with pytest.raises((ValueError, RuntimeWarning), match=told):  # warnings are errors here
            control(q, q)


def test_states_that_cannot_be_controlled_are_refused_with_the_sample(package_of: Packages) -> None:
    package = package_of("planar3")
    robot, frame = package.load("numpy"), package.FrameImpedance
    q, rest = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]), np.zeros(3)
    light = robot.partial_impedance({("joint1", "link3", "joint1"): -5.0})
    with pytest.raises(ValueError, match="the wanted inertia is not positive at sample 0: along joint1"):
        light(q, rest)
    left = robot.cancel({(None, None, None, 2)})
    with pytest.raises(ValueError, match="what is left of the mass matrix is singular at sample 0"):
        left(q, rest)
    straight = robot.partial_impedance(frame=frame("link3", rows=("x", "y", "rz")))
    q[1] = 0.0
    with pytest.raises(
        ValueError, match=r"frame 'link3' cannot move along rows each by itself at sample 1: along .*x"
    ):
        straight(q, rest)
    turned = robot.partial_impedance(frame=frame("link3", stiffness=1.0, rows=("rz",)))
    pose = robot.kinematics.pose(q[0] + [np.pi, 0.0, 0.0], "link3")
    with pytest.raises(ValueError, match="half a turn from its target, which has no direction; take steps"):
        turned(q[0], rest, package.Target(pose=pose))
    with pytest.raises(ValueError, match=r"target\.pose is no rotation"):
        turned(q[0], rest, package.Target(pose=2.0 * np.eye(4)))
    with pytest.raises(ValueError, match=r"target\.pose is no rotation, but mirrors"):
        turned(q[0], rest, package.Target(pose=np.diag([1.0, 1.0, -1.0, 1.0])))
    with pytest.raises(ValueError, match=r"target.velocity has shape \(1,\); its last axis must be 6"):
        turned(q[0], rest, package.Target(pose=np.eye(4), velocity=[0.0]))
    assert not turned.dissipative  # the angle about z changes by other turns, too
    with pytest.raises(ValueError, match="target has what a frame shall do, but none is controlled"):
        robot.partial_impedance()(q[0], rest, package.Target(pose=pose))
    with pytest.raises(ValueError, match="is stiff, but target has no pose"):
        turned(q[0], rest)
    with pytest.raises(ValueError, match="the joints are stiff, but target has no q"):
        robot.partial_impedance(stiffness=1.0)(q[0], rest)
    with pytest.raises(ValueError, match=r"the shapes do not go together: .*external \(4, 3\)"):
        robot.partial_impedance()(q, rest, None, np.zeros((4, 3)))
