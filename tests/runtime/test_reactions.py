"""`robot.reactions`: what shares sum to, axes, points, chosen joints, loads, gradients, refusals."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

torch = pytest.importorskip("torch")

Packages = Callable[[str], ModuleType]
BACKENDS = ("numpy", "torch", pytest.param("native", marks=needs_compiler))
CRANE, LEG, DELTA = (str(DATA / name) for name in ("crane.urdf", "leg.toml", "delta.toml"))


def motion_of(robot: Any, *batch: int) -> tuple[Any, ...]:
    arrays = np.random.default_rng(5).uniform(-0.7, 0.7, (3, *batch, robot.n))
    return tuple(torch.from_numpy(arrays)) if robot.backend.takes_tensors else tuple(arrays)


def along_axes(robot: Any, share: Any) -> Any:
    """Sum each joint's part along its axis, times how far it moves, over the joints of a coordinate."""
    tree, total = robot.backend.tree, np.zeros((robot.n, *share.shape[1:-1]))
    for at, joint in enumerate(tree.joints):
        assert joint.curve is None
        total[joint.coordinate] += joint.ratio * share[at, ..., 2 if joint.kind == "revolute" else 5]
    return total


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", [CRANE, LEG, "puma560"])
def test_the_part_along_the_axis_is_the_share_of_the_torque(
    name: str, backend: str, package_of: Packages
) -> None:
    robot = package_of(name).load(backend)
    motion = motion_of(robot)
    found = robot.reactions(*motion, constraints=False)
    expected = robot.propagation(*motion)
    for field in ("acceleration", "velocity", "gravity"):
        own = along_axes(robot, np.asarray(getattr(found, field)))
        np.testing.assert_allclose(own, np.asarray(getattr(expected, field)), rtol=0, atol=1e-12)


def test_where_ties_are_kept_the_part_along_the_axis_is_that_of_the_constrained_torque(
    package_of: Packages,
) -> None:
    robot = package_of(DELTA).load("numpy")
    ties = robot.constraints
    q = ties.closed_position
    qd, qdd = (
        ties.velocity(q, np.random.default_rng(s).uniform(-1, 1, len(ties.independent))) for s in (1, 2)
    )
    found, expected = robot.reactions(q, qd, qdd), ties.propagation(q, qd, qdd)
    own = [robot.joint_names.index(name) for name in ties.independent]
    rest = [robot.joint_names.index(name) for name in ties.dependent]
    for field in ("acceleration", "velocity", "gravity"):
        share = along_axes(robot, getattr(found, field))
        np.testing.assert_allclose(share[own], getattr(expected, field), rtol=0, atol=1e-12)
        np.testing.assert_allclose(share[rest], 0.0, atol=1e-12, err_msg="nothing drives what follows")


def test_springs_of_what_follows_load_the_ties(tmp_path: Path) -> None:
    text = (DATA / "fourbar.toml").read_text(encoding="utf-8")
    sprung = text.replace(
        'child = "rocker"', 'child = "rocker", stiffness = 4.0, damping = 0.3, armature = 0.2'
    )
    (tmp_path / "sprung.toml").write_text(sprung, encoding="utf-8")
    write_package(generate(read_system(tmp_path / "sprung.toml"), ["numpy"]), tmp_path / "sprung")
    robot = import_package(tmp_path / "sprung").load("numpy")
    ties = robot.constrained(["a"])
    q = ties.closed(np.array([0.8, -0.3, 1.2]))
    qd = ties.velocity(q, np.array([1.7]))
    qdd = ties.acceleration(q, qd, np.array([2.3]))
    own, rest = robot.passive_torque(q, qd, qdd), [1, 2]
    found = robot.reactions(q, qd, qdd, constraints=ties)
    without = robot.reactions(q, qd, qdd, passive=False, constraints=ties)
    np.testing.assert_allclose(found.total[rest, 2], -own.total[rest], atol=1e-12)
    np.testing.assert_allclose(without.total[rest, 2], 0.0, atol=1e-12)
    assert not without.passive.any()
    for kind, torque in enumerate(own):
        np.testing.assert_allclose(found.passive[2, kind, 2, 2], -torque[2], atol=1e-12)
        assert found.passive[0, kind, 2].any() == bool(torque[2])


@pytest.mark.parametrize("backend", BACKENDS)
def test_axes_and_points_turn_and_move_one_wrench(backend: str, package_of: Packages) -> None:
    package = package_of(CRANE)
    robot = package.load(backend)
    q, qd, qdd = motion_of(robot)
    frame = robot.kinematics.frames[-1]
    given = {"loads": [package.AppliedLoad(frame, [3.0, -2.0, 9.0], [0.1, 0.2, 0.3], [0.4, 0.1, 1.0])]}
    world = np.asarray(robot.reactions(q, qd, qdd, axes="world", point=[0.0, 0.0, 0.0], **given).total)
    pose, point = np.asarray(robot.kinematics.pose(q, frame)), np.array([0.2, -0.3, 0.1])
    turn, at = pose[:3, :3], pose[:3, :3] @ point + pose[:3, 3]
    expected = np.concatenate(
        [(world[:, :3] - np.cross(at, world[:, 3:])) @ turn, world[:, 3:] @ turn], axis=1
    )
    seen = robot.reactions(q, qd, qdd, axes=frame, point=point, **given)
    np.testing.assert_allclose(np.asarray(seen.total), expected, rtol=0, atol=1e-12)
    last = robot.tree_joint_names[-1]
    own = robot.reactions(q, qd, qdd, joints=last, **given)
    moved = robot.reactions(q, qd, qdd, point=point, joints=[len(robot.tree_joint_names) - 1], **given)
    for share, other in zip(own, moved, strict=True):
        share, other = np.asarray(share), np.asarray(other)
        moment = share[..., :3] - np.cross(point, share[..., 3:])
        np.testing.assert_allclose(other, np.concatenate([moment, share[..., 3:]], -1), atol=1e-12)


@pytest.mark.parametrize("backend", BACKENDS)
def test_samples_and_chosen_joints_are_parts_of_the_whole(backend: str, package_of: Packages) -> None:
    package = package_of(LEG)
    robot = package.load(backend)
    q, qd, qdd = (0.1 * a for a in motion_of(robot, 2, 3))
    names = robot.tree_joint_names
    load = package.AppliedLoad(robot.link_names[-1], np.random.default_rng(1).normal(size=(2, 3, 3)))
    whole = robot.reactions(q, qd, qdd, loads=[load], constraints=False)
    some = robot.reactions(q, qd, qdd, loads=[load], constraints=False, joints=[names[-1], 0])
    one = robot.reactions(
        q[1, 2], qd[1, 2], qdd[1, 2], loads=[load._replace(force=load.force[1, 2])], constraints=False
    )
    for share, part, single in zip(whole, some, one, strict=True):
        share, part, single = map(np.asarray, (share, part, single))
        np.testing.assert_allclose(part, share[:, :, [-1, 0]], rtol=0, atol=1e-12)
        np.testing.assert_allclose(single, share[1, 2], rtol=0, atol=1e-12)


@needs_compiler
@pytest.mark.parametrize(("name", "parameters"), [(CRANE, {}), (LEG, {}), ("planar3 symbolic", {"m_2": 2.0})])
def test_c_answers_as_the_rule_does_in_both_number_types(
    name: str, parameters: dict[str, float], package_of: Packages, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = package_of(name)
    c, rule = (package.load(backend, parameters=parameters) for backend in ("native", "numpy"))
    calls, run = list[str](), c.backend.calls.run
    monkeypatch.setattr(c.backend.calls, "run", lambda call, *given: calls.append(call) or run(call, *given))
    exact = rule.reactions(*motion_of(rule, 19))
    for kind, largest in ((np.float64, 1e-12), (np.float32, 1e-4)):
        motion = [a.astype(kind) for a in motion_of(rule, 19)]
        of_arrays, of_tensors = c.reactions(*motion), c.reactions(*map(torch.from_numpy, motion))
        single = c.reactions(*(a[3] for a in motion))
        for share, tensor, one, expected in zip(of_arrays, of_tensors, single, exact, strict=True):
            scale = max(1.0, np.abs(expected).max(initial=0.0))
            np.testing.assert_allclose(share, expected, rtol=0, atol=largest * scale)
            np.testing.assert_allclose(tensor.numpy(), share, rtol=0, atol=largest * scale)
            np.testing.assert_allclose(one, expected[3], rtol=0, atol=largest * scale)
            assert share.dtype == one.dtype == kind
    assert set(calls) == {"link_wrenches"}


@needs_compiler
def test_c_leaves_what_needs_a_gradient_or_has_ties_to_the_rule(package_of: Packages) -> None:
    puma, delta = package_of("puma560"), package_of(DELTA)
    slopes = []
    for backend in ("torch", "native"):
        motion = [a.requires_grad_() for a in motion_of(puma.load("torch"), 2)]
        puma.load(backend).reactions(*motion, joints=1).total.square().sum().backward()
        slopes.append([a.grad for a in motion])
    for own, other in zip(*slopes, strict=True):
        torch.testing.assert_close(own, other, rtol=1e-12, atol=1e-10)
    tied = [
        delta.load(backend).reactions(*motion_of(delta.load("numpy")), constraints=False)
        for backend in ("numpy", "native")
    ]
    for share, other in zip(*tied, strict=True):
        np.testing.assert_allclose(share, other, rtol=0, atol=1e-12)


def test_gradients_flow_through_motion_loads_and_points(package_of: Packages) -> None:
    package = package_of(DELTA)
    robot = package.load("torch")
    ties = robot.constraints
    start = torch.from_numpy(ties.closed_position)
    draw = torch.Generator().manual_seed(1)
    motion, force, point = (
        torch.rand(shape, generator=draw, dtype=torch.float64, requires_grad=True)
        for shape in ((3, robot.n), (3,), (3,))
    )

    def answer(motion: Any, force: Any, point: Any) -> Any:
        q = ties.closed(start + 0.01 * motion[0])
        load = package.AppliedLoad(robot.link_names[-1], force, point=point)
        found = robot.reactions(q, motion[1], motion[2], loads=[load], point=point, joints=[0, 3])
        return tuple(share.sum() + (share**2).sum() for share in found[:4])

    assert torch.autograd.gradcheck(answer, (motion, force, point), atol=1e-5, rtol=1e-4)


def test_samples_may_be_mapped(package_of: Packages) -> None:
    robot = package_of(CRANE).load("torch")
    motion = motion_of(robot, 4)
    expected = robot.reactions(*motion, axes="world")
    mapped = torch.func.vmap(lambda q, qd, qdd: robot.reactions(q, qd, qdd, axes="world")[:3])(*motion)
    for share, whole in zip(mapped, expected, strict=False):
        torch.testing.assert_close(share, whole, rtol=1e-12, atol=1e-12)


def test_bodies_in_place_of_the_tree_count(package_of: Packages) -> None:
    package = package_of("puma560")
    robot, motion = package.load("numpy"), motion_of(package.load("numpy"))
    bodies = package.bodies()
    heavy = package.load("numpy", bodies=bodies._replace(masses=2.0 * bodies.masses))
    other = package.load("numpy", bodies=bodies._replace(inertias=0.0 * bodies.inertias))
    point = package.load(
        "numpy", bodies=bodies._replace(inertias=0.0 * bodies.inertias, masses=2.0 * bodies.masses)
    )
    # Wrenches are linear in mass, first moment and inertia.
    found = [one.reactions(*motion).total for one in (robot, heavy, other, point)]
    np.testing.assert_allclose(found[1] - found[0], found[3] - found[2], atol=1e-12)
    np.testing.assert_allclose(found[3], 2.0 * found[2], atol=1e-12)


def test_what_is_not_modelled_is_refused_by_name(package_of: Packages) -> None:
    crane = package_of(CRANE).load("numpy")
    motion = motion_of(crane)
    cart = package_of(str(DATA / "cart_pendulum.py")).load("numpy")
    for call, told in (
        (lambda: cart.reactions(*motion_of(cart)), "energies, which do not say what their joints carry"),
        (lambda: package_of(CRANE).load("autograd").reactions(*motion_of(crane)), "load numpy, torch or nat"),
        (
            lambda: crane.reactions(*motion, joints="knee"),
            r"^joints is 'knee'; choose a tree_joint by number",
        ),
        (lambda: crane.reactions(*motion, joints=[0, 99]), r"^joints\[1\] is 99; choose a tree_joint"),
        (lambda: crane.reactions(*motion, joints=[]), "^joints is empty; name some of"),
        (lambda: crane.reactions(*motion, axes="wrold"), "axes is 'wrold'; choose joint, world, or the name"),
        (lambda: crane.reactions(*motion, axes=99), "^axes: frame is 99, but frames are numbered"),
        (lambda: crane.reactions(*motion, point=[1.0, 2.0]), "point"),
    ):
        with pytest.raises(ValueError, match=told) as info:
            call()
        assert "\n" not in str(info.value)
