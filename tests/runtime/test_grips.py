"""Limits of what contacts bear: which torques keep them, gradients, back ends, and what is refused."""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from helpers.answers import relative_error
from helpers.walker import SOLE, Q, feet, moving, walker_in

torch = pytest.importorskip("torch")
pytest.importorskip("clarabel")
pytest.importorskip("scipy")

SLIPPERY = 0.1
"""Friction under which the walker's least torques let its left foot slip."""


@pytest.fixture(scope="module")
def walker(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    return walker_in(tmp_path_factory.mktemp("walker"))


def both(package: ModuleType, friction: float) -> list[Any]:
    return [package.Grip(side, friction) for side in "rl"]


def test_a_foot_is_kept_from_slipping_and_the_motion_stays(walker: ModuleType) -> None:
    robot = walker.load("numpy")
    ties = robot.constrained(contacts=feet(walker))
    q = Q + 0.05 * np.random.default_rng(0).uniform(-1.0, 1.0, (4, 7))
    qd = moving(ties, q)
    free, rough, smooth = (
        robot.partial_impedance(stiffness=[0, 0, 0, 20, 20, 20, 20], constraints=ties, grips=grips)
        for grips in ((), both(walker, np.float32(5.0)), both(walker, SLIPPERY))
    )
    plain, tau = free(q, qd, Q), smooth(q, qd, Q)
    forces = smooth.forces(q, qd, Q).reshape(4, 2, 3)
    assert (np.abs(forces[..., 0]) <= SLIPPERY * forces[..., 2] * (1.0 + 1e-6)).all()
    slipping = np.abs(free.forces(q, qd, Q).reshape(4, 2, 3)[..., 0]) > SLIPPERY * forces[..., 2]
    assert slipping.any()
    found = ties.forward_dynamics(q, qd, tau)
    assert relative_error(found.qdd, free.acceleration(q, qd, Q)) <= 1e-10
    assert relative_error(found.forces.reshape(4, 2, 3), forces) <= 1e-8
    # Where the least torques keep all limits, they are what is given.
    assert relative_error(rough(q, qd, Q), plain) <= 1e-13
    # One sample alone, and what is cancelled, keep limits likewise.
    np.testing.assert_allclose(smooth(q[1], qd[1], Q), tau[1], atol=1e-6)
    link = robot.link_names[-1]
    cancel = robot.cancel(
        {(joint, link, None, None) for joint in range(3)}, constraints=ties, grips=both(walker, SLIPPERY)
    )
    kept = cancel.forces(q, qd).reshape(4, 2, 3)
    assert (np.abs(kept[..., 0]) <= SLIPPERY * kept[..., 2] * (1.0 + 1e-6)).all()
    moved = ties.forward_dynamics(q, qd, cancel(q, qd))
    assert relative_error(moved.qdd, cancel.acceleration(q, qd)) <= 1e-10
    assert relative_error(moved.forces.reshape(4, 2, 3), kept) <= 1e-8


@pytest.mark.parametrize("backend", ["torch", pytest.param("native", marks=needs_compiler)])
def test_other_back_ends_keep_the_same_limits(backend: str, walker: ModuleType) -> None:
    known, model = walker.load("numpy"), walker.load(backend)
    made = [
        robot.partial_impedance(
            constraints=robot.constrained(contacts=feet(walker)), grips=both(walker, SLIPPERY)
        )
        for robot in (known, model)
    ]
    state = torch.from_numpy(Q) if backend == "torch" else Q
    for call in ("__call__", "forces"):
        expected = getattr(made[0], call)(Q, 0.0 * Q)
        assert relative_error(np.asarray(getattr(made[1], call)(state, 0.0 * state)), expected) <= 1e-9


def test_gradients_are_there_where_limits_shape_nothing(walker: ModuleType) -> None:
    robot = walker.load("torch")
    ties = robot.constrained(contacts=feet(walker))
    q = torch.tensor(Q, requires_grad=True)
    free, rough, smooth = (
        robot.partial_impedance(constraints=ties, grips=grips)
        for grips in ((), both(walker, 5.0), both(walker, SLIPPERY))
    )
    slopes = [torch.autograd.grad(made(q, 0.0 * q).sum(), q)[0] for made in (free, rough)]
    torch.testing.assert_close(*slopes, rtol=1e-12, atol=1e-12)
    with pytest.raises(ValueError, match=r"the limits of r, l shape these torques, which have no gradient"):
        smooth(q, 0.0 * q)
    with pytest.raises(ValueError, match="which vmap and compilers hide"):
        torch.func.vmap(lambda one: rough(one, 0.0 * one))(torch.tensor(np.stack([Q, Q])))


def test_a_contact_that_nothing_keeps_is_told(walker: ModuleType) -> None:
    robot = walker.load("numpy")
    ties = robot.constrained(contacts=feet(walker))
    kept = robot.partial_impedance(
        stiffness=[0, 0, 0, 90, 90, 90, 90], constraints=ties, grips=both(walker, 0.01)
    )
    away = Q + np.array([0, 0, 0, 0.6, -0.5, 0.3, 0.4])
    with pytest.raises(
        ValueError, match=r"slips? or lifts? off at sample 1: no torques of hip_r, .* short by [\d.]+ N; ask"
    ):
        kept(np.stack([Q, Q]), np.zeros((2, 7)), np.stack([Q, away]))


def test_what_is_no_limit_is_refused_by_name(walker: ModuleType) -> None:
    robot, grip, contact = walker.load("numpy"), walker.Grip, walker.Contact
    ties = robot.constrained(contacts=feet(walker))
    whole = robot.constrained(contacts=[contact("shank_r", "held", SOLE, name="r")])
    toe = robot.constrained(contacts=[contact("shank_r", "hinged", SOLE, (0.0, 1.0, 0.0), name="r")])
    line = ((0.1, 0.0, -0.4), (-0.1, 0.0, -0.4), (0.0, 0.0, -0.4))
    for held, grips, message in (
        (None, [grip("r", 0.5)], "grips has limits, but no contact holds"),
        (ties, [grip("right", 0.5)], r"grips\[0\].contact is 'right'; choose r, l"),
        (ties, [grip("r", 0.5), grip("r", 0.4)], r"grips\[1\] is of 'r', as another is"),
        (ties, [grip("r", -0.5)], r"grips\[0\].friction is -0.5; give a number, 0 or above"),
        (ties, [grip("r", True)], r"grips\[0\].friction is True"),
        (whole, [grip("r", 0.5, "abc")], r"grips\[0\].corners is 'abc'; r bears moments"),
        (whole, [grip("r", 0.5, [line[0], (0.0, 1.0)])], r"grips\[0\].corners is .*; r bears moments"),
        (ties, [grip("r", 0.5, line)], "corners is given, but r touches at one point"),
        (ties, [grip("r", 0.5, normal=(0.0, 0.0, 0.0))], r"grips\[0\].normal is .* no direction"),
        (whole, [grip("r", 0.5)], "r bears moments: give three points or more"),
        (whole, [grip("r", 0.5, line)], "corners lie in one line"),
        (toe, [grip("r", 0.5)], "is hinged; hold two points"),
    ):
        with pytest.raises(ValueError, match=message):
            robot.partial_impedance(constraints=held, grips=grips)
    for grips in (grip("r", 0.5), ["r"], 0.5):
        with pytest.raises(TypeError, match=r"grips.* is .*; give a (list of )?Grip"):
            robot.partial_impedance(constraints=ties, grips=grips)
    cancel = robot.cancel({(0, "thigh_r", None, None)}, constraints=ties, grips=both(walker, 0.5))
    with pytest.raises(ValueError, match="qdd is given, but what contacts bear depends"):
        cancel(Q, 0.0 * Q, None, None, 0.0 * Q)


def test_a_missing_solver_is_named(walker: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = walker.load("numpy")
    kept = robot.partial_impedance(
        constraints=robot.constrained(contacts=feet(walker)), grips=both(walker, 0.5)
    )
    monkeypatch.setitem(sys.modules, "clarabel", None)
    with pytest.raises(ImportError, match=r"friction cones need Clarabel and SciPy.*pip install clarabel"):
        kept(Q, 0.0 * Q)


def test_soles_on_a_slope_press_along_its_normal(tmp_path: Path, walker: ModuleType) -> None:
    """A wedge that stands still: friction bears it up to its slope, and no further."""
    robot = walker.load("numpy")
    ties = robot.constrained(contacts=feet(walker))
    for slope, holds in ((0.2, True), (0.5, False)):
        normal = (np.sin(slope), 0.0, np.cos(slope))
        kept = robot.partial_impedance(
            constraints=ties, grips=[walker.Grip(side, np.tan(0.35), normal=normal) for side in "rl"]
        )
        if not holds:
            with pytest.raises(ValueError, match="r, l slip or lift off"):
                kept(Q, 0.0 * Q)
            continue
        forces = kept.forces(Q, 0.0 * Q).reshape(2, 3)
        pressed = forces @ normal
        assert (
            np.linalg.norm(forces - pressed[:, None] * normal, axis=1) <= np.tan(0.35) * pressed + 1e-6
        ).all()
