"""Regressors of every back end against Pinocchio's: each link's rows, and their split by cause and order."""

from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, LOCKED_FINGERS, PANDA, needs_compiler
from helpers.answers import random_states, relative_error
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

import pinocchio as pin

from numeric.pinocchio_model import PinocchioModel

STATES, LARGEST_ERROR = 20, 1e-12
ROBOTS = {
    "panda": (PANDA, Options(lock=LOCKED_FINGERS), "straight"),
    "crane": (DATA / "crane.urdf", Options(base="floating"), "loops"),
}
"""An arm; a tree on a floating base with slides, a part without mass, and joints that follow another."""


Made = Callable[[str], tuple[Any, ModuleType]]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """System and package of a robot."""

    @cache
    def make(robot: str) -> tuple[Any, ModuleType]:
        path, options, kernel = ROBOTS[robot]
        system, folder = read_system(path, options), tmp_path_factory.mktemp("regressors") / "robot"
        write_package(generate(system, ["numpy", "torch", "native"], "robot", kernel=kernel), folder)
        return system, import_package(folder)

    return make


@cache
def pinocchio_says(robot: str, n: int) -> list[Any]:
    """Y of tau, c2, c1 and g of its joints' bodies: motions whose torques are these, and differences."""
    path, options, _ = ROBOTS[robot]
    oracle = PinocchioModel(path, read_system(path, options), options.base == "floating", dict(options.lock))
    states = random_states(n, STATES)
    tau = [oracle.regressor(*state) for state in zip(*states, strict=True)]
    c2, c1, g = [], [], []
    for q, qd, _ in zip(*states, strict=True):
        rest, units = np.zeros(n), np.eye(n)
        weight, speed = oracle.regressor(q, rest, rest), oracle.regressor(q, qd, rest)
        c2.append(np.stack([oracle.regressor(q, rest, e) - weight for e in units], 2))
        # What is quadratic in qd, h(qd): 1/2 dh/dqd_k = 1/2 (h(qd + e_k) - h(qd) - h(e_k)).
        faster = [oracle.regressor(q, qd + e, rest) - oracle.regressor(q, e, rest) for e in units]
        c1.append(np.stack([0.5 * (f - speed + weight) for f in faster], 2))
        g.append(weight)
    return [np.array(rows) for rows in (tau, c2, c1, g)]


def in_our_frames(robot: str, system: Any, package: ModuleType, rows: Any) -> Any:
    """Rows (..., joints, ..., 10) of Pinocchio's for the parameters about the frames of our links."""
    path, options, _ = ROBOTS[robot]
    oracle = PinocchioModel(path, system, options.base == "floating", dict(options.lock))
    q = np.full(oracle.n, 0.3)
    pin.forwardKinematics(oracle.model, oracle.data, oracle._state(q, q, q)[0])
    columns, tree = [], package.tree.TREE
    for j, link in enumerate(tree.links):
        owner = oracle.model.frames[oracle.model.getFrameId(tree.link_name(j), pin.BODY)].parentJoint
        between = np.linalg.inv(oracle.data.oMi[owner].homogeneous) @ placed(tree, link.joint, q)
        columns.append(rows[:, :, owner - 1] @ moved(between))
    return np.stack(columns, 2)


def placed(tree: Any, joint: int | None, q: Any) -> Any:
    """A joint's frame in the base's, (4, 4)."""
    if joint is None:
        return np.eye(4)
    entry, step, motion = tree.joints[joint], np.eye(4), np.eye(4)
    step[:3, :3], step[:3, 3] = entry.rotation, entry.translation
    by = entry.ratio * q[entry.coordinate]
    if entry.kind == "revolute":
        motion[:2, :2] = [[np.cos(by), -np.sin(by)], [np.sin(by), np.cos(by)]]
    else:
        motion[2, 3] = by
    return placed(tree, entry.parent, q) @ step @ motion


def moved(to: Any) -> Any:
    """Parameters in one frame from those in another, (10, 10).

    By second moments [S h; h' m], S = tr(I)/2 - I.
    """
    columns = []
    for m, x, y, z, xx, xy, yy, xz, yz, zz in np.eye(10):
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        moments = np.block(
            [[np.trace(inertia) / 2 * np.eye(3) - inertia, np.array([[x], [y], [z]])], [x, y, z, m]]
        )
        s = to @ moments @ to.T
        i = np.trace(s[:3, :3]) * np.eye(3) - s[:3, :3]
        columns.append([s[3, 3], *s[:3, 3], i[0, 0], i[0, 1], i[1, 1], i[0, 2], i[1, 2], i[2, 2]])
    return np.array(columns).T


@pytest.mark.parametrize("backend", ["numpy", "torch", pytest.param("native", marks=needs_compiler)])
@pytest.mark.parametrize("robot", ROBOTS)
def test_regressors_are_pinocchios(robot: str, backend: str, made: Made) -> None:
    system, package = made(robot)
    dynamics = package.load(backend)
    q, qd, qdd = random_states(dynamics.n, STATES)
    expected = [in_our_frames(robot, system, package, rows) for rows in pinocchio_says(robot, dynamics.n)]
    for kind, limit in (("float64", LARGEST_ERROR), ("float32", 1e-5)):
        motion = [a.astype(kind) for a in (q, qd, qdd)]
        given = [dynamics.regressor(*motion), *dynamics.coefficient_regressors(*motion[:2])]
        for what, value, reference in zip(("tau", "c2", "c1", "g"), given, expected, strict=True):
            assert str(value.dtype).endswith(kind)
            error = relative_error(value, reference)
            assert error <= limit, f"{what}, {kind}: {error:.1e}"


def test_a_gradient_through_a_regressor_is_its_torques(
    made: Made,
) -> None:
    torch = pytest.importorskip("torch")
    _, package = made("panda")
    motion = [torch.from_numpy(a).requires_grad_() for a in random_states(7, 5)]
    pi = torch.from_numpy(package.inertial_parameters(package.bodies()))
    for backend in ("torch", "native"):
        dynamics = package.load(backend)
        torque = (dynamics.regressor(*motion) * pi).sum(-1)
        slopes = torch.autograd.grad(torque.square().sum(), motion)
        expected = torch.autograd.grad(dynamics.partial_torque(*motion).square().sum(), motion)
        for slope, other in zip(slopes, expected, strict=True):
            assert relative_error(slope, other) <= 1e-12


def test_what_has_no_rigid_links_says_so(package_of: Callable[[str], ModuleType]) -> None:
    q = np.zeros((3, 2))
    for robot, backend in ((str(DATA / "cart_pendulum.py"), "numpy"), ("planar2", "autograd")):
        package = package_of(robot)
        with pytest.raises(ValueError, match="has no regressors, which come from the rule for rigid links"):
            package.load(backend).regressor(*q)
