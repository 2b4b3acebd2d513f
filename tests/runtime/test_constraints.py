"""`robot.constraints`: back ends, gradients, choices, contacts, and what is refused in one line."""

import pickle
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

torch = pytest.importorskip("torch")

FOURBAR = """schema = 1
name = "fourbar"
gravity = [0, -9.81, 0]
parameters = {L = 0.7, m = 2.0}
joint = [
  {name = "crank", parent = "base", child = "a"},
  {name = "knee", parent = "a", child = "b", xyz = [0.3, 0, 0]},
  {name = "rocker", parent = "base", child = "c", xyz = [0.6, 0.1, 0]},
]
link = [
  {name = "a", mass = 1.2, com = [0.15, 0.01, 0], inertia = {xx = 0.01, yy = 0.02, zz = 0.02}},
  {name = "b", mass = "m", com = [0.3, -0.02, 0], inertia = {xx = 0.01, yy = 0.05, zz = 0.06}},
  {name = "c", mass = 1.5, com = [0.2, 0, 0], inertia = {xx = 0.01, yy = 0.03, zz = 0.03}},
]
[[constraint]]
name = "pin"
type = "point"
first = {frame = "b", xyz = ["L", 0, 0]}
second = {frame = "c", xyz = [0.5, 0, 0]}
"""
GEARS = """schema = 1
name = "gears"
joint = [
  {name = "x", type = "prismatic", parent = "base", child = "cart", axis = [1, 0, 0]},
  {name = "turn", parent = "cart", child = "wheel", axis = [0, 1, 0]},
]
link = [
  {name = "cart", mass = 2.0, inertia = {xx = 0.1, yy = 0.1, zz = 0.1}},
  {name = "wheel", mass = 3.0, inertia = {xx = 0.2, yy = 0.4, zz = 0.2}},
]
"""
COUPLED = '[[constraint]]\nname = "rack"\ntype = "coupling"\nterms = {x = 1.0, turn = [0.0, -0.25, 0.1]}\n'
BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
NEAR = np.array([0.8, -0.5, 1.2])


def package(folder: Path, text: str, backends: tuple[str, ...] = ("numpy",)) -> ModuleType:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.toml").write_text(text)
    system = read_system(folder / "robot.toml", Options("symbolic"))
    write_package(generate(system, list(backends)), folder / system.name)
    return import_package(folder / system.name)


@pytest.fixture(scope="module")
def fourbar(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    return package(tmp_path_factory.mktemp("fourbar"), FOURBAR, ("numpy", "torch", "autograd", "native"))


@pytest.fixture(scope="module")
def cart(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return package(tmp_path_factory.mktemp("cart"), GEARS)


@pytest.fixture
def one(fourbar: ModuleType) -> Any:
    return fourbar.load("numpy")


def refused(call: Callable[[], Any], message: str, error: type[Exception] = ValueError) -> None:
    with pytest.raises(error) as info:
        call()
    assert message in str(info.value)
    assert "\n" not in str(info.value)


def motion(robot: Any) -> tuple[Any, Any, Any]:
    draw = np.random.default_rng(0)
    q = robot.constraints.closed(NEAR + draw.uniform(-0.1, 0.1, (2, 4, 3)))
    return q, *draw.uniform(-1.0, 1.0, (2, 2, 4, 3))


def values(answer: Any) -> list[Any]:
    parts = answer if isinstance(answer, tuple) else (answer,)
    return [part.detach().numpy() if torch.is_tensor(part) else part for part in parts]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("kind", "limit"), [(np.float64, 1e-11), (np.float32, 2e-4)])
def test_back_ends_answer_alike_in_both_precisions(
    fourbar: ModuleType, backend: str, kind: Any, limit: float
) -> None:
    given = {"L": 0.65, "m": 1.7}
    reference, robot = (fourbar.load(name, parameters=given).constraints for name in ("numpy", backend))
    exact = motion(fourbar.load("numpy", parameters=given))
    own = [a.astype(kind) for a in exact]
    for call in ("inverse_dynamics", "partial_torque", "forces", "propagation", "forward_dynamics"):
        expected, found = values(getattr(reference, call)(*exact)), values(getattr(robot, call)(*own))
        for a, b in zip(expected, found, strict=True):
            assert b.dtype == kind
            np.testing.assert_allclose(b, a, atol=limit * max(1.0, np.abs(a).max()))


def test_gradients_run_through_what_is_closed_and_solved(fourbar: ModuleType) -> None:
    q, qd, qdd = (torch.from_numpy(a[0, :2]).requires_grad_() for a in motion(fourbar.load("numpy")))
    length = torch.tensor(0.7, dtype=torch.float64, requires_grad=True)

    def torque(q: Any, qd: Any, qdd: Any, length: Any) -> Any:
        constraints = fourbar.load("torch", parameters={"L": length}).constraints
        return constraints.inverse_dynamics(constraints.closed(q), qd, qdd)

    def accelerations(q: Any, qd: Any, tau: Any, length: Any) -> Any:
        constraints: Any = fourbar.load("torch", parameters={"L": length}).constraints
        return tuple(constraints.forward_dynamics(constraints.closed(q), qd, tau))

    assert torch.autograd.gradcheck(torque, (q, qd, qdd, length), fast_mode=True)
    assert torch.autograd.gradcheck(accelerations, (q, qd, qdd, length), fast_mode=True)


def test_dependent_joints_of_a_motion_given_do_not_count(one: Any) -> None:
    q, qd, qdd = motion(one)
    constraints = one.constraints
    own = [one.joint_index(joint) for joint in constraints.independent]
    full = constraints.velocity(q, qd[..., own])
    assert not np.allclose(full, qd)
    follows = constraints.acceleration(q, qd, qdd[..., own])
    np.testing.assert_array_equal(
        constraints.inverse_dynamics(q, qd, qdd), constraints.inverse_dynamics(q, full, follows)
    )


def test_torques_are_projected_and_borne_with_any_further_axis(one: Any) -> None:
    q, qd, qdd = motion(one)
    constraints = one.constraints
    full = constraints.acceleration(q, qd, qdd[..., [0]])
    shares = one.partial_torque(q, constraints.velocity(q, qd[..., [0]]), full)
    np.testing.assert_allclose(
        constraints.projected(q, shares, by_link=True), constraints.partial_torque(q, qd, qdd), atol=1e-12
    )
    np.testing.assert_allclose(
        constraints.forces_of(q, shares.sum(-1)), constraints.forces(q, qd, qdd).sum(-1), atol=1e-11
    )


def test_causes_of_accelerations_sum_to_what_velocities_do(one: Any) -> None:
    q, qd, _ = motion(one)
    causes = one.constraints.velocity_accelerations(q, qd)
    assert not causes[..., 0, :].any()
    np.testing.assert_allclose(causes.sum(-1), one.constraints.acceleration(q, qd, np.zeros(1)), atol=1e-12)


@pytest.mark.parametrize("backend", BACKENDS)
def test_copies_are_those_of_the_copied_robot(backend: str, fourbar: ModuleType) -> None:
    robot = fourbar.load(backend)
    chosen = robot.constrained(["knee"], tolerance=1e-3)
    for made in (robot.constraints, chosen):
        copied, other = pickle.loads(pickle.dumps((made, robot)))
        assert copied.are_of(other)
        assert copied.independent == made.independent
        np.testing.assert_array_equal(copied.closed_position, made.closed_position)
    with pytest.raises(ValueError, match="start") as info:
        robot.constraints.closed([0.0, 0.0, 0.0])
    told = pickle.loads(pickle.dumps(info.value))
    assert (type(told), str(told)) == (type(info.value), str(info.value))


@pytest.mark.parametrize("backend", ["numpy", "torch"])
def test_loops_of_one_length_a_sample_are_closed_each_by_its_own(backend: str, fourbar: ModuleType) -> None:
    lengths = np.array([0.6, 0.7, 0.8])
    given = lengths if backend == "numpy" else torch.from_numpy(lengths)
    ties = fourbar.load(backend, parameters={"L": given}).constraints
    led = ties.closed(ties.closed_position[:, :1] + 0.05)
    for k, length in enumerate(lengths):
        own = fourbar.load("numpy", parameters={"L": length}).constraints
        np.testing.assert_allclose(ties.closed_position[k], own.closed_position, atol=1e-9)
        np.testing.assert_allclose(led[k], own.closed(own.closed_position[:1] + 0.05), atol=1e-9)


@pytest.mark.parametrize("backend", BACKENDS)
def test_samples_that_do_not_go_together_are_told_by_name(backend: str, fourbar: ModuleType) -> None:
    ties = fourbar.load(backend).constraints
    held = np.tile(ties.closed_position, (5, 1))
    told = "the shapes do not go together: q (3, 1), start (3,), held_at (5, 3); before the last axes"
    refused(lambda: ties.closed(ties.closed_position[:1] + np.zeros((3, 1)), held), told)


def test_numbers_of_independent_joints_and_torques_are_looked_at_too(fourbar: ModuleType) -> None:
    ties = fourbar.load("numpy", check_finite=True).constraints
    q, gap = ties.closed_position, float("nan")
    refused(lambda: ties.velocity(q, [gap]), "yd is nan for joint 'crank'")
    refused(lambda: ties.acceleration(q, q, [gap]), "ydd is nan for joint 'crank'")
    refused(lambda: ties.projected(q, [0.0, gap, 0.0]), "torque is nan for joint 'knee'")
    refused(lambda: ties.forces_of(q, [[0.0], [0.0], [gap]], by_link=True), "torque is nan")
    refused(lambda: ties.closed(q[:1], start=[0.0, gap, 0.0]), "start is nan for joint 'knee'")
    refused(lambda: ties.violation(q, [gap, 0.0, 0.0]), "held_at is nan for joint 'crank'")


def test_any_joint_that_the_others_follow_may_be_independent(one: Any) -> None:
    q, qd, qdd = motion(one)
    full = one.constraints.velocity(q, qd[..., [0]])
    other = one.constrained(independent=["rocker"])
    assert (other.independent, other.dependent) == (("rocker",), ("crank", "knee"))
    np.testing.assert_allclose(other.velocity(q, full[..., [2]]), full, atol=1e-12)
    tau = qdd
    for a, b in zip(
        other.forward_dynamics(q, full, tau), one.constraints.forward_dynamics(q, full, tau), strict=True
    ):
        np.testing.assert_allclose(a, b, atol=1e-10)


def test_a_coupling_is_a_gear_by_hand(tmp_path: Path) -> None:
    robot: Any = package(tmp_path, GEARS + COUPLED).load("numpy")
    constraints = robot.constrained(independent=["turn"])
    turn, rate, change = 0.7, 1.1, -0.4
    q = constraints.closed(np.array([9.0, turn]))
    # x = t / 4 - t^2 / 10
    slope, bend = 0.25 - 0.2 * turn, -0.2
    assert q[0] == pytest.approx(0.25 * turn - 0.1 * turn**2)
    qdd = constraints.acceleration(q, np.array([0.0, rate]), np.array([change]))
    assert qdd[0] == pytest.approx(slope * change + bend * rate**2)
    push = 5.0 * qdd[0]
    state = q, np.array([0.0, rate]), np.array([0.0, change])
    assert constraints.inverse_dynamics(*state) == pytest.approx([0.4 * change + slope * push])
    assert constraints.forces(*state).sum(-1) == pytest.approx([push])
    assert constraints.rows == ("rack",)


@pytest.mark.parametrize("backend", ["numpy", "torch"])
@pytest.mark.parametrize("loop", [False, True], ids=["alone", "beside a loop"])
def test_a_coupling_is_the_same_in_whatever_it_counts(loop: bool, backend: str, tmp_path: Path) -> None:
    """s + s^4 = t / 4, in rad and in billionths: what is open counts in rad and m of the joints."""
    follower, mover = ("geared", "crank") if loop else ("x", "turn")
    gear = '{name = "geared", parent = "base", child = "d", xyz = [0, 0.3, 0]},'
    wheel = '{name = "d", mass = 0.5, inertia = {xx = 0.01, yy = 0.01, zz = 0.02}},'
    geared = FOURBAR.replace("joint = [", f"joint = [{gear}").replace("link = [", f"link = [{wheel}")
    made = []
    for name, unit in (("plain", 1.0), ("fine", 1e9)):
        terms = f"{follower} = [0, {unit}, 0, 0, {unit}], {mover} = [0, {-0.25 * unit}]"
        coupling = f'[[constraint]]\nname = "own"\ntype = "coupling"\nterms = {{{terms}}}\n'
        made.append(
            package(tmp_path / name, (geared if loop else GEARS) + coupling, (backend,)).load(backend)
        )
    plain, fine = (robot.constrained(independent=[mover]) for robot in made)
    like = torch.as_tensor if backend == "torch" else np.asarray
    asked = like(
        np.array([[0.2, *NEAR], [0.1, 0.9, -0.4, 1.1]]) if loop else np.array([[0.2, 0.9], [0.3, 1.4]])
    )
    at, qd = plain.closed(asked), 0.0 * asked + 0.3
    (q,), (same,) = values(at), values(fine.closed(asked))
    np.testing.assert_allclose(same, q, atol=1e-12)
    np.testing.assert_allclose(*(values(one.velocity_map(at))[0] for one in (fine, plain)), atol=1e-12)
    for call in ("acceleration", "inverse_dynamics"):
        given = (at, qd, qd[..., :1]) if call == "acceleration" else (at, qd, qd)
        np.testing.assert_allclose(
            *(values(getattr(one, call)(*given))[0] for one in (fine, plain)), atol=1e-9
        )
    forces = [values(one.forces(at, qd, qd))[0] for one in (fine, plain)]
    forces[0][:, -1] *= 1e9
    np.testing.assert_allclose(*forces, atol=1e-9)
    column = made[0].joint_names.index(follower)
    for one in (plain, fine):
        off = at + 0.0
        off[1, column] += 5e-7
        one.velocity_map(off)
        off[1, column] += 5e-6
        refused(lambda one=one, off=off: one.velocity_map(off), "own is open by 5.")


def test_a_wheel_rolls_along_the_ground_without_slip(cart: ModuleType) -> None:
    robot: Any = cart.load("numpy")
    constraints = robot.constrained(["x"], [cart.Contact("wheel", "rolling", radius=0.5)])
    q = np.array([0.3, 2.0])
    np.testing.assert_allclose(constraints.velocity(q, np.array([1.0])), [1.0, 2.0], atol=1e-15)
    on_a_floor = cart.Contact("wheel", "rolling", radius=0.5, normal=(0.0, 0.0, 3.0))
    np.testing.assert_array_equal(robot.constrained(["x"], [on_a_floor]).jacobian(q), constraints.jacobian(q))
    # (m_cart + m_wheel + I / r^2) a, of which the ground's friction turns the wheel.
    torque = constraints.inverse_dynamics(q, np.zeros(2), np.array([1.0, 0.0]))
    assert torque == pytest.approx([5.0 + 0.4 / 0.25])
    forces = constraints.forces(q, np.zeros(2), np.array([1.0, 0.0])).sum(-1)
    assert forces[0] == pytest.approx(-0.4 / 0.25)
    assert constraints.rows == tuple(f"wheel rolling force_{axis}" for axis in "xyz")


def test_contacts_stay_where_they_took_hold(tmp_path: Path) -> None:
    module = package(tmp_path, FOURBAR.split("[[constraint]]")[0])
    contact = module.Contact("b", "point", (0.7, 0.0, 0.0), name="tip")
    robot: Any = module.load("numpy")
    constraints = robot.constrained(contacts=[contact])
    assert (constraints.independent, constraints.redundant) == (("rocker",), ())
    moved = NEAR + np.array([0.05, -0.03, 0.2])
    np.testing.assert_array_equal(constraints.closed(moved), moved)
    way = robot.kinematics.pose(moved, "b") - robot.kinematics.pose(NEAR, "b")
    np.testing.assert_allclose(
        constraints.violation(moved, held_at=NEAR), (way @ [0.7, 0.0, 0.0, 1.0])[:3], atol=1e-15
    )
    np.testing.assert_allclose(constraints.closed(moved, held_at=NEAR), [*NEAR[:2], moved[2]], atol=1e-12)


def test_where_they_took_hold_is_in_the_world(tmp_path: Path) -> None:
    """Places are counted from a base that slides, for the digits' sake, but not these."""
    arm = FOURBAR.split("[[constraint]]")[0].replace('parent = "base"', 'parent = "cart"')
    joint = '{name = "x", type = "prismatic", parent = "base", child = "cart", axis = [1, 0, 0]},'
    cart = '{name = "cart", mass = 1.0, inertia = {xx = 0.1, yy = 0.1, zz = 0.1}},'
    module = package(
        tmp_path, arm.replace("joint = [", f"joint = [{joint}").replace("link = [", f"link = [{cart}")
    )
    robot: Any = module.load("numpy")
    constraints = robot.constrained(contacts=[module.Contact("b", "point", (0.7, 0.0, 0.0))])
    before, after = np.array([[0.5, *NEAR], [1.5, *NEAR]])
    np.testing.assert_allclose(constraints.violation(after, held_at=before), [1.0, 0.0, 0.0], atol=1e-15)


def test_a_motion_keeps_contacts_where_they_took_hold(package_of: Callable[[str], ModuleType]) -> None:
    """However long its steps: joints that follow are closed from there, and not from where they came."""
    module, point = package_of("torso"), (0.1, -0.2, 0.3)
    robot: Any = module.load("numpy")
    held = robot.constrained(contacts=[module.Contact("left_forearm", "point", point)])
    draw = np.random.default_rng(2)
    q, tau = draw.uniform(-0.8, 0.8, (2, robot.n))
    qd = held.velocity(q, draw.uniform(-1.0, 1.0, len(held.independent)))
    found = robot.simulate(q, qd, [0.0, 0.1, 0.2], tau, step=0.05, constraints=held)
    places = robot.kinematics.pose(found.q, "left_forearm") @ [*point, 1.0]
    np.testing.assert_allclose(places, places[[0, 0, 0]], atol=1e-10)
    assert np.abs(found.q[-1] - q).max() > 0.05
    speeds = robot.kinematics.velocity(found.q, found.qd, "left_forearm", point)[:, 3:]
    np.testing.assert_allclose(speeds, 0.0 * speeds, atol=1e-10)


@needs_compiler
@pytest.mark.parametrize(("kind", "limit"), [(np.float64, 1e-11), (np.float32, 2e-4)])
def test_what_c_says_of_a_contact_at_one_sample_is_what_arrays_say_of_many(
    kind: Any, limit: float, package_of: Callable[[str], ModuleType]
) -> None:
    """A hand is held by a pin askew, and rolls besides with a point of its other one."""
    module = package_of("torso")
    contacts = [
        module.Contact("left_forearm", "hinged", (0.1, -0.2, 0.3), axis=(1.0, 2.0, -2.0)),
        module.Contact("right_forearm", "rolling", (0.2, 0.1, 0.0), normal=(0.0, 1.0, 2.0), radius=0.1),
    ]
    draw = np.random.default_rng(2)
    q, qd, tau = draw.uniform(-0.8, 0.8, (3, 4, 7))
    for held in (contacts[:1], contacts[1:]):
        known, own = (module.load(name).constrained(contacts=held) for name in ("numpy", "native"))
        rest = np.zeros(len(known.independent), kind)
        expected = [
            *(known.jacobian(q), known.acceleration(q, qd, rest), known.closed(q + 0.01, held_at=q)),
            *known.forward_dynamics(q, qd, tau),
        ]
        for s in range(len(q)):
            a, b, c = (x[s].astype(kind) for x in (q, qd, tau))
            one = [own.jacobian(a), own.acceleration(a, b, rest), own.closed(a + kind(0.01), held_at=a)]
            for found, whole in zip([*one, *own.forward_dynamics(a, b, c)], expected, strict=True):
                assert found.dtype == kind
                size = max(1.0, np.abs(whole[s]).max())
                np.testing.assert_allclose(found, whole[s], atol=limit * size)


def test_a_hinged_contact_leaves_turns_about_its_axis(tmp_path: Path) -> None:
    module = package(tmp_path, FOURBAR.split("[[constraint]]")[0])
    robot: Any = module.load("numpy")
    axes = {(0, 0, 2): 2, (1, 0, 0): 1}
    for axis, free in axes.items():
        contact = module.Contact("a", "hinged", axis=axis)
        assert len(robot.constrained(contacts=[contact]).independent) == free + 1
    held = robot.constrained(contacts=[module.Contact("a")])
    assert held.rows == tuple(f"a held {row}_{axis}" for row in ("moment", "force") for axis in "xyz")


def test_a_robot_without_ties_or_of_energies_has_no_constraints(cart: ModuleType) -> None:
    robot = cart.load("numpy")
    refused(lambda: robot.constraints, "gears has no ties; robot.constrained(contacts=[Contact(frame)])")


def test_an_open_loop_is_refused_and_closed(one: Any) -> None:
    q = one.constraints.closed(np.tile(NEAR, (3, 1)))
    q[1, 2] += 0.01
    zeros = np.zeros((3, 3))
    refused(lambda: one.constraints.inverse_dynamics(q, zeros, zeros), "pin is open by ")
    message = " mm at sample 1; give positions in which ties close, as closed(q) answers"
    refused(lambda: one.constraints.velocity_map(q), message)
    one.constrained(["crank"], tolerance=0.1).velocity_map(q)
    closed = one.constraints.closed(NEAR)
    for kind, most in ((np.float64, 1e-6), (np.float32, 1e-4)):  # in m, of what joints could close
        moved = most / 0.5 * np.array([0.0, 0.0, 1.0])  # of the rocker, whose end is 0.5 m out
        near, far = ((closed + share * moved).astype(kind) for share in (0.3, 3.0))
        one.constraints.velocity_map(near)
        refused(lambda q=far: one.constraints.velocity_map(q), "pin is open by ")
    one.constraints.velocity_map(one.constraints.closed(q))


def test_a_loop_out_of_reach_never_closes(fourbar: ModuleType) -> None:
    constraints = fourbar.load("numpy", parameters={"L": 3.0}).constraints
    with pytest.raises(ValueError, match=r"^(pin does not close|the position is singular)"):
        constraints.closed(NEAR)


def test_a_singular_start_is_not_laid_on_the_choice_of_joints(fourbar: ModuleType) -> None:
    constraints = fourbar.load("numpy").constraints
    start = np.stack([NEAR, np.zeros(3)])
    message = (
        r"^pin cannot be closed at sample 1, for the start is singular: knee, rocker can move there while "
        r"crank stands still, and no step of theirs closes it; start them off it, by 0\.1 say"
    )
    with pytest.raises(ValueError, match=message):
        constraints.closed(start)
    start[1, 1:] = -0.1, 0.1
    assert np.abs(constraints.violation(constraints.closed(start))).max() <= 1e-12


def test_a_singular_position_is_told_from_a_bad_choice(fourbar: ModuleType) -> None:
    robot = fourbar.load("numpy", parameters={"L": 0.5})
    # crank 0.3, rod 0.5, rocker 0.5: stretched, crank and rod lie in one line.
    far = np.hypot(0.6, 0.1)
    angle = np.arctan2(0.1, 0.6)
    cosine = (0.8**2 + far**2 - 0.5**2) / (2 * 0.8 * far)
    crank = angle + np.arccos(cosine)
    tip = 0.8 * np.array([np.cos(crank), np.sin(crank)]) - [0.6, 0.1]
    q = np.array([crank, 0.0, np.arctan2(tip[1], tip[0])])
    assert np.abs(robot.constraints.violation(q)).max() < 1e-12
    robot.constrained(["crank"]).velocity_map(q)
    refused(
        lambda: robot.constrained(["rocker"]).velocity_map(q),
        "the independent joints do not tell the others: crank, knee can move while rocker stands still",
    )


def test_a_position_where_all_bars_lie_in_line_is_singular(tmp_path: Path) -> None:
    text = FOURBAR.replace("xyz = [0.6, 0.1, 0]", "xyz = [0.5, 0, 0]")
    robot = package(tmp_path, text).load("numpy")
    # 0.3 + 0.7 = 0.5 + 0.5
    q = np.zeros((2, 3))
    refused(
        lambda: robot.constraints.velocity_map(q),
        "the position is singular: ",
    )
    refused(lambda: robot.constraints.velocity_map(q), " at sample 0 while ")


@pytest.mark.parametrize(
    ("asked", "message", "error"),
    [
        (
            {"independent": [0, 1]},
            "independent has 2 joints, but the constraints leave 1",
            ValueError,
        ),
        ({"independent": ["elbow"]}, "independent is 'elbow'; choose a joint by number, 0..2", ValueError),
        ({"independent": ["crank", 0]}, "names a joint twice", ValueError),
        ({"independent": "crank"}, "independent is 'crank'; give a list of joints", TypeError),
        ({"contacts": ["a"]}, "contacts[0] is 'a'; give a Contact", TypeError),
        ({"at": [0.0, 0.0]}, "at has shape (2,); give one position of shape (3,)", ValueError),
        ({"at": [0.0, np.inf, 0.0]}, "at is inf for joint 'knee'", ValueError),
        ({"tolerance": -1.0}, "tolerance is -1.0; give a number of m and rad, 0 or more", ValueError),
    ],
)
def test_a_choice_that_cannot_be_is_told(
    one: Any, asked: dict[str, Any], message: str, error: type[Exception]
) -> None:
    refused(lambda: one.constrained(**asked), message, error)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (("d",), "frame is 'd', which is not there; choose"),
        (("base",), "contacts[0].frame is 'base', which stands on the ground anyway"),
        (("a", "glued"), "contacts[0].kind is 'glued'; choose held, hinged, point, rolling"),
        (("a", "hinged", (0, 0, 0), (0, 0, 0)), "contacts[0].axis is (0, 0, 0), which has no direction"),
        (("a", "point", (0, 0)), "contacts[0].point is (0, 0); give x, y, z"),
        (("a", "rolling"), "contacts[0].radius is 0.0; what rolls has one above 0, in m"),
        (
            ("a", "rolling", (0, 0, 0), (0, 0, 1), (0, 0, 0), 0.1),
            "contacts[0].normal is (0, 0, 0), which has no direction",
        ),
    ],
)
def test_a_contact_that_cannot_be_is_told(
    fourbar: ModuleType, one: Any, made: tuple[Any, ...], message: str
) -> None:
    refused(lambda: one.constrained(contacts=[fourbar.Contact(*made)]), message)


def test_what_rolls_without_gravity_needs_a_normal(tmp_path: Path) -> None:
    floating = package(tmp_path, FOURBAR.replace("gravity = [0, -9.81, 0]", "gravity = [0, 0, 0]"))
    wheel = floating.Contact("a", "rolling", radius=0.1)
    told = "contacts[0] has no normal, and no gravity tells one; give normal=(x, y, z)"
    refused(lambda: floating.load("numpy").constrained(contacts=[wheel]), told)


def test_a_torque_of_a_wrong_shape_and_forward_dynamics_of_the_open_tree_are_refused(one: Any) -> None:
    q = one.constraints.closed(NEAR)
    refused(
        lambda: one.constraints.projected(q, np.zeros(2)), "torque has shape (2,); its last axis must be 3"
    )
    refused(lambda: one.constraints.velocity(q, np.zeros(2)), "yd has shape (2,); its last axis must be 1")
    refused(lambda: one.forward_dynamics(q, q, q), "call constraints.forward_dynamics(q, qd, tau)")


def test_ties_that_hold_something_twice_are_named(one: Any, tmp_path: Path) -> None:
    twin = FOURBAR[FOURBAR.index("[[constraint]]") :].replace('"pin"', '"twin"')
    robot: Any = package(tmp_path, FOURBAR + twin).load("numpy")
    assert robot.constraints.redundant == ("pin", "twin")
    q = robot.constraints.closed(NEAR)
    forces = robot.constraints.forces(q, 0.0 * q, 0.0 * q)
    np.testing.assert_allclose(forces[:3], forces[3:], atol=1e-12)  # the least squares share alike
    assert one.constraints.redundant == (), "nothing moves the pin out of the plane"
    assert re.match(r"<constraints of 3 rows, independent crank>", repr(one.constraints))
