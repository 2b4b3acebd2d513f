"""`robot.trace`: windows, restarts, given torques, loads, losses, back ends and gradients; messages."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.motion.between_samples import sample_slopes

torch = pytest.importorskip("torch")

Packages = Callable[[str], ModuleType]
CRANE, LEG = f"{DATA / 'crane.urdf'} loops", f"{DATA / 'leg.toml'} loops"
FOUR_BAR = str(DATA / "crank_rocker.toml")
SPRUNG = """schema = 1
name = "sprung"
gravity = [0, 0, -9.81]
link = [
  {name = "base"},
  {name = "slider", mass = 1.0, com = [0, 0, 0.1], inertia = {xx = 0.1, yy = 0.1, zz = 0.05}},
  {name = "rod", mass = 2.0, com = [0.3, 0, 0], inertia = {xx = 0.1, yy = 0.1, zz = 0.05}},
]
[[joint]]
name = "lift"
type = "prismatic"
parent = "base"
child = "slider"
axis = [0, 0, 1]
damping = 1.5
[[joint]]
name = "turn"
parent = "slider"
child = "rod"
axis = [0, 1, 0]
stiffness = 9.0
rest = 0.4
damping = 0.3
friction = 0.2
armature = 0.05
"""
BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
TIME = np.linspace(0.2, 0.6, 81)


def motion_of(n: int, time: Any = TIME) -> tuple[Any, Any, Any]:
    rates = 2.0 + np.arange(n)
    phase = rates * time[:, None] + np.arange(n)
    return 0.5 * np.sin(phase), 0.5 * rates * np.cos(phase), -0.5 * rates**2 * np.sin(phase)


@pytest.mark.parametrize("samples", [2, 3, 6])
def test_slopes_of_samples_are_those_of_parabolas_and_of_lines_for_two(samples: int) -> None:
    time = np.cumsum(np.linspace(0.1, 0.3, samples))
    values = time**2 if samples > 2 else 3.0 * time
    expected = 2.0 * time if samples > 2 else [3.0, 3.0]
    np.testing.assert_allclose(sample_slopes(np.diff(time), values), expected, rtol=1e-12)


@pytest.mark.parametrize("backend", BACKENDS)
def test_parts_sum_to_the_velocities_on_every_back_end(backend: str, package_of: Packages) -> None:
    package = package_of(CRANE)
    robot = package.load(backend)
    motion = motion_of(robot.n)
    load = package.AppliedLoad(robot.link_names[-1], np.outer(np.sin(9.0 * TIME), [3.0, -2.0, 9.0]))
    given: tuple[Any, ...] = tuple(map(torch.from_numpy, motion)) if robot.backend.takes_tensors else motion
    found = robot.trace(*given, TIME, loads=[load], windows=[0.3, 0.4], by_link=True)
    assert isinstance(found.velocity, type(given[0]))
    assert np.abs(np.asarray(found.total) - motion[1]).max() <= 1e-8
    expected = package.load("numpy").trace(*motion, TIME, loads=[load], windows=[0.3, 0.4], by_link=True)
    np.testing.assert_allclose(np.asarray(found.velocity), expected.velocity, rtol=1e-9, atol=1e-11)
    assert found.sources == (
        *(f"torque:{name}" for name in robot.joint_names),
        *(f"gravity:{name}" for name in robot.link_names),
        f"load:{robot.link_names[-1]}",
        "start",
    )


def test_motions_side_by_side_are_traced_as_each_alone(package_of: Packages) -> None:
    robot = package_of(CRANE).load()
    one, other = (motion_of(robot.n, TIME + shift) for shift in (0.0, 0.7))
    both = robot.trace(*(np.stack(pair, 1) for pair in zip(one, other, strict=True)), TIME, windows=0.1)
    for k, motion in enumerate((one, other)):
        alone = robot.trace(*motion, TIME, windows=0.1)
        for found, expected in zip(both[1:6], alone[1:6], strict=True):
            np.testing.assert_allclose(found[:, k], expected, rtol=1e-9, atol=1e-12)


def test_windows_tell_when_a_source_acted(package_of: Packages) -> None:
    robot = package_of(CRANE).load()
    motion = motion_of(robot.n)
    whole, cut = robot.trace(*motion, TIME), robot.trace(*motion, TIME, windows=0.1)
    assert np.allclose(cut.windows, [(0.2, 0.3), (0.3, 0.4), (0.4, 0.5), (0.5, 0.6)], atol=1e-12)
    np.testing.assert_allclose(cut.velocity.sum(-1), whole.velocity[..., 0], rtol=1e-10, atol=1e-12)
    assert not cut.velocity[:20, ..., 1:].any(), "nothing has come yet of a window that lies ahead"
    assert not cut.power[41:, ..., :2].any(), "a window that is over adds no energy"
    np.testing.assert_allclose(
        cut.of("torque"), cut.velocity[..., : robot.n, :].sum((-2, -1)), rtol=1e-12, atol=1e-14
    )
    np.testing.assert_allclose(
        cut.velocity_torque.sum((-3, -2, -1)),
        (robot.coriolis_matrix(*motion[:2]) @ motion[1][..., None])[..., 0],
        rtol=1e-6,
        atol=1e-8,
    )


def test_a_trace_that_begins_anew_has_all_velocities_at_its_start(package_of: Packages) -> None:
    robot = package_of(CRANE).load()
    motion = motion_of(robot.n)
    found = robot.trace(*motion, TIME, restarts=[0.4])
    np.testing.assert_array_equal(found.of("start")[40], motion[1][40])
    assert not found.work[40].any()
    assert not found.velocity[40, :, :-1].any()
    later = robot.trace(*(a[40:] for a in motion), TIME[40:])
    np.testing.assert_allclose(found.velocity[40:], later.velocity, rtol=1e-10, atol=1e-13)


def test_what_given_torques_leave_of_a_motion_is_the_residual(package_of: Packages) -> None:
    robot = package_of(LEG).load()
    motion = motion_of(robot.n)
    needed = robot.inverse_dynamics(*motion) + robot.passive_torque(*motion).total
    closed = robot.trace(*motion, TIME, tau=needed)
    assert np.abs(closed.of("residual")).max() <= 1e-6 * np.abs(closed.of("torque")).max()
    missing = robot.trace(*motion, TIME, tau=0.5 * needed)
    np.testing.assert_allclose(missing.of("residual"), missing.of("torque"), rtol=1e-6, atol=1e-5)
    assert np.abs(missing.total - motion[1]).max() <= 1e-8


def test_weight_that_torques_bear_is_no_source(package_of: Packages) -> None:
    robot = package_of(CRANE).load()
    still = np.broadcast_to(motion_of(robot.n)[0][3], (81, robot.n))
    held = robot.trace(still, 0.0 * still, 0.0 * still, TIME, weight="borne")
    assert "gravity" not in held.sources
    assert not held.velocity.any(), "nothing moves, and nothing moved it"
    assert np.abs(robot.trace(still, 0.0 * still, 0.0 * still, TIME).of("gravity")).max() > 1.0
    motion = motion_of(robot.n)
    needed = robot.inverse_dynamics(*motion) + robot.passive_torque(*motion).total
    borne = robot.trace(*motion, TIME, weight="borne")
    assert np.abs(borne.total - motion[1]).max() <= 1e-8
    given = robot.trace(*motion, TIME, tau=needed, weight="borne")
    np.testing.assert_allclose(given.of("torque"), borne.of("torque"), rtol=1e-5, atol=1e-5)


def test_torques_that_were_given_bear_the_weight_of_tied_joints_too(package_of: Packages) -> None:
    robot = package_of(FOUR_BAR).load()
    driven = motion_of(1)
    q = robot.constraints.closed(driven[0])
    qd, qdd = (np.pad(a, ((0, 0), (0, robot.n - 1))) for a in driven[1:])
    motion = q, qd, qdd
    needed = np.pad(robot.constraints.inverse_dynamics(*motion)[:, :1], ((0, 0), (0, robot.n - 1)))
    expected = robot.trace(*motion, TIME, weight="borne").of(f"torque:{robot.joint_names[0]}")
    found = robot.trace(*motion, TIME, tau=needed, weight="borne")
    parts = [found.of(f"torque:{name}") for name in robot.joint_names]
    np.testing.assert_allclose(parts[0], expected, rtol=1e-5, atol=1e-5)
    assert np.abs(parts[1:]).max() <= 1e-12


def test_springs_and_losses_are_sources_where_joints_have_them(tmp_path: Path) -> None:
    (tmp_path / "sprung.toml").write_text(SPRUNG)
    write_package(generate(read_system(tmp_path / "sprung.toml"), ["numpy"]), tmp_path / "sprung")
    robot = import_package(tmp_path / "sprung").load()
    found = robot.trace(*motion_of(2), TIME)
    assert found.sources == (
        *("torque:lift", "torque:turn", "gravity"),
        *("spring:turn", "damping:lift", "damping:turn", "friction:turn", "start"),
    )
    assert np.abs(found.total - motion_of(2)[1]).max() <= 1e-9
    gained = found.energy - found.energy[:1] - found.work
    assert np.abs(gained).max() <= 1e-8 * np.abs(found.energy).max()
    bare = robot.trace(*motion_of(2), TIME, passive=False)
    assert bare.sources == ("torque:lift", "torque:turn", "gravity", "start")


def test_gradients_flow_through_a_trace(package_of: Packages) -> None:
    robot = package_of("planar3").load("torch")
    q, qd, qdd = (torch.tensor(a[:9], requires_grad=True) for a in motion_of(3))

    def part(q: Any, qd: Any, qdd: Any) -> Any:
        return robot.trace(q, qd, qdd, TIME[:9], windows=[0.22]).velocity[-1, :, 0, 0]

    assert torch.autograd.gradcheck(part, (q, qd, qdd), rtol=1e-5, atol=1e-7)


def test_what_cannot_be_traced_is_refused(package_of: Packages) -> None:
    robot = package_of("planar3").load()
    motion = motion_of(3)
    gap = np.concatenate([TIME[:40], TIME[40:] + 0.3])
    broken = motion[1].copy()
    broken[7, 1] = np.nan
    wrapped = motion[0].copy()
    wrapped[40:, 1] += 2.0 * np.pi
    pull = package_of("planar3").AppliedLoad("link3", broken)
    for told, ask in {
        r"time has 80 instants, but q, qd and qdd have shape \(81, 3\)": lambda: robot.trace(
            *motion, TIME[:80]
        ),
        "time has a gap of 0.305 s after 0.395 s": lambda: robot.trace(*motion, gap),
        r"qd is nan at sample 7 for joint 'joint2'": lambda: robot.trace(motion[0], broken, motion[2], TIME),
        r"windows\[1\] is 0.7 s, which is not within the motion, from 0.2 to 0.6 s": lambda: robot.trace(
            *motion, TIME, windows=[0.3, 0.7]
        ),
        "windows is 0.001 s; give a length from a step": lambda: robot.trace(*motion, TIME, windows=0.001),
        "windows is 5 s; give a length from a step": lambda: robot.trace(*motion, TIME, windows=5),
        "q of 'joint2' goes by 6.28 in the step next to 0.395 s, where": lambda: robot.trace(
            wrapped, *motion[1:], TIME
        ),
        "q of 'joint1' goes by .* give time in s": lambda: robot.trace(*motion, 1e3 * TIME),
        "force is nan at sample 7": lambda: robot.trace(*motion, TIME, loads=[pull]),
        r"restarts\[1\] is 0.301 s, next to the sample at 0.3 s, where another one is": lambda: robot.trace(
            *motion, TIME, restarts=[0.3, 0.301]
        ),
        "weight is 'held'; give apart or borne": lambda: robot.trace(*motion, TIME, weight="held"),
        r"no source 'elbow' moves this robot; choose a source": lambda: robot.trace(*motion, TIME).of(
            "elbow"
        ),
    }.items():
        with pytest.raises(ValueError, match=told):
            ask()


def test_a_motion_without_a_torque_is_that_of_a_simulation_without_it(package_of: Packages) -> None:
    package = package_of(CRANE)
    robot = package.load()
    q, qd, qdd = motion_of(robot.n)
    load = package.AppliedLoad(robot.link_names[-1], np.outer(np.sin(9.0 * TIME), [3.0, -2.0, 9.0]))

    def torque(t: float, *state: Any) -> Any:
        fine = motion_of(robot.n, np.array([t]))
        pull = robot.kinematics.load_torque(
            fine[0][0], load.frame, np.sin(9.0 * t) * np.array([3.0, -2.0, 9.0])
        )
        return (robot.inverse_dynamics(*fine)[0] + pull) * (np.arange(robot.n) != 1)

    def loads(t: float, *state: Any) -> Any:
        return [package.AppliedLoad(load.frame, np.sin(9.0 * t) * np.array([3.0, -2.0, 9.0]))]

    name = robot.joint_names[1]
    found = robot.counterfactual(q, qd, qdd, TIME, f"torque:{name}", loads=[load])
    expected = robot.simulate(q[0], qd[0], TIME, torque, loads, method="DOP853")
    assert np.abs(found.drift).max() <= 1e-5
    assert np.abs(found.q - expected.q).max() <= 1e-4 * np.abs(expected.q - q).max()


@pytest.mark.parametrize("source", ["torque:turn", "gravity", "spring:turn", "friction:turn", "start"])
def test_what_is_left_out_in_part_changes_the_motion_to_first_order(source: str, tmp_path: Path) -> None:
    (tmp_path / "sprung.toml").write_text(SPRUNG)
    write_package(generate(read_system(tmp_path / "sprung.toml"), ["numpy"]), tmp_path / "sprung")
    robot = import_package(tmp_path / "sprung").load()
    motion = motion_of(2, TIME[:21])
    found = robot.counterfactual(*motion, TIME[:21], source)
    whole = found.q - found.drift - motion[0]
    first = found.first_order_q - motion[0]
    assert np.abs(whole).max() > 1e-4
    assert np.abs(first - whole).max() <= 0.2 * np.abs(whole).max(), "in a tenth of a second, nearly all"
    with pytest.raises(ValueError, match="without is 'torque:elbow'; choose a source: near it are torque:"):
        robot.counterfactual(*motion, TIME[:21], "torque:elbow")
