"""Induced accelerations and simulation of a four-bar: against multipliers of SymPy, energy and closure."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from conftest import DATA, needs_compiler
from helpers.answers import relative_error
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.constraints.tie_rows import TieRows

torch = pytest.importorskip("torch")
integrate = pytest.importorskip("scipy.integrate")

CRANK = f"{DATA / 'crank_rocker.toml'} loops"
BACKENDS = ("numpy", "torch", pytest.param("native", marks=needs_compiler))
LINKS = ((1.2, (0.1, 0.02), 0.02), (0.9, (0.35, 0.05), 0.04), (0.7, (0.2, -0.03), 0.03))
"""Mass, centre of mass and inertia of crank, coupler and rocker, as the file has them."""
LENGTHS, PIN = (0.3, 0.6, 0.5), (0.8, 0.0)


@cache
def lagrange() -> dict[str, Any]:
    """Functions of (q, qd), link by link, from kinetic and potential energies alone."""
    q, qd = sp.symbols("q:3"), sp.symbols("v:3")
    angles = [sum(q[: k + 1]) for k in range(3)]
    start, found = sp.Matrix([0, 0]), []
    for (mass, (x, y), inertia), length, angle in zip(LINKS, LENGTHS, angles, strict=True):
        turn = sp.Matrix([[sp.cos(angle), -sp.sin(angle)], [sp.sin(angle), sp.cos(angle)]])
        centre = start + turn * sp.Matrix([x, y])
        jacobian, spin = centre.jacobian(q), sp.Matrix([angle]).jacobian(q)
        matrix = mass * jacobian.T * jacobian + inertia * spin.T * spin
        symbols = [
            [
                sum(
                    (matrix[i, s].diff(q[k]) + matrix[i, k].diff(q[s]) - matrix[s, k].diff(q[i])) * qd[k] / 2
                    for k in range(3)
                )
                for s in range(3)
            ]
            for i in range(3)
        ]
        found.append((matrix, sp.Matrix(symbols), sp.Matrix([9.81 * mass * centre[1]]).jacobian(q).T))
        start = start + turn * sp.Matrix([length, 0])
    ties = (start - sp.Matrix(PIN)).jacobian(q)
    rate = sum((ties.diff(a) * b for a, b in zip(q, qd, strict=True)), sp.zeros(2, 3))
    parts = {"mass": [a for a, _, _ in found], "coriolis": [b for _, b, _ in found]}
    parts |= {"gravity": [c for _, _, c in found], "A": ties, "Ad": rate}
    return {name: sp.lambdify((q, qd), part) for name, part in parts.items()}


def multipliers(q: Any, qd: Any, tau: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Accelerations and forces of the pin by source, each from [M -A^T; A 0] [qdd; lambda] = [F; b]."""
    values = {name: np.array(f(q, qd), float) for name, f in lagrange().items()}
    mass, ties = values["mass"].sum(0), values["A"]
    whole = np.block([[mass, -ties.T], [ties, np.zeros((2, 2))]])
    sources = {
        "actuators": np.diag(tau),
        "velocity": -(values["coriolis"] * qd).swapaxes(0, 1).reshape(3, 9),
        "gravity": -values["gravity"][:, :, 0].T,
    }
    found = {
        name: np.linalg.solve(whole, np.vstack([force, np.zeros((2, force.shape[1]))]))
        for name, force in sources.items()
    }
    found["constraints"] = np.linalg.solve(whole, np.vstack([np.zeros((3, 3)), -values["Ad"] * qd]))
    shape = {"velocity": (3, 3)}
    cut = {name: (a[:3], a[3:]) for name, a in found.items()}
    return tuple(
        {name: pair[k].reshape(-1, *shape.get(name, pair[k].shape[1:])) for name, pair in cut.items()}
        for k in range(2)
    )  # type: ignore[return-value]


def states(robot: Any, count: int) -> tuple[Any, Any, Any]:
    """Positions in which the loop closes, and motion that keeps it."""
    generator = np.random.default_rng(4)
    around = np.linspace(0.5, 2.4, count)
    q = robot.constraints.closed(np.stack([around, -around, -1.9 + 0.0 * around], -1))
    qd = robot.constraints.velocity(q, generator.uniform(-3.0, 3.0, (count, 1)))
    return q, qd, generator.uniform(-2.0, 2.0, (count, 3))


@pytest.mark.parametrize("backend", BACKENDS)
def test_each_source_moves_a_four_bar_as_multipliers_say(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of(CRANK)
    q, qd, tau = states(package.load("numpy"), 4)
    robot = package.load(backend)
    motion = [torch.from_numpy(a) for a in (q, qd, tau)] if robot.backend.takes_tensors else [q, qd, tau]
    shares, pins = robot.induced_accelerations(*motion), robot.induced_reactions(*motion)
    for s, state in enumerate(zip(q, qd, tau, strict=True)):
        moved, borne = multipliers(*state)
        for source in moved:
            assert relative_error(getattr(shares, source)[s], moved[source]) <= 1e-10, source
            held = np.asarray(getattr(pins, source)[s])
            assert relative_error(held[:2], borne[source]) <= 1e-10, source
            assert np.abs(held[2]).max() <= 1e-12, "a plane's loop bears nothing across it"
    motion_of_all = robot.constraints.forward_dynamics(*motion)
    assert relative_error(shares.total, np.asarray(motion_of_all.qdd)) <= 1e-10
    assert relative_error(pins.total, np.asarray(motion_of_all.forces)) <= 1e-10
    asked = robot.induced_accelerations(*motion[:2], qdd=motion_of_all.qdd)
    assert relative_error(asked.total, np.asarray(motion_of_all.qdd)) <= 1e-10
    assert np.abs(np.asarray(asked.actuators)[..., 1:]).max() == 0.0, "the crank alone is driven"
    of_crank = 0.0 * motion_of_all.qdd
    of_crank[..., 0] = motion_of_all.qdd[..., 0]
    followed = robot.induced_accelerations(*motion[:2], qdd=of_crank)
    assert relative_error(followed.total, np.asarray(motion_of_all.qdd)) <= 1e-10, "the others follow"


def test_a_four_bar_turns_closed_and_keeps_its_energy(package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of(CRANK).load("numpy")
    q, qd, _ = (a[0] for a in states(robot, 4))
    time, tau = np.linspace(0.0, 0.2, 3), np.array([1.0, 0.2, -0.3])
    steps = [robot.simulate(q, qd, time, tau, step=step) for step in (0.02, 0.01)]
    drifts = [np.abs(one.energy_drift).max() for one in steps]
    assert drifts[1] <= 1e-5
    assert drifts[1] <= drifts[0] / 10.0, drifts
    exact = robot.simulate(q, qd, time, tau, method="DOP853", rtol=1e-11)
    assert np.abs(exact.energy_drift).max() <= 1e-8
    for one in (*steps, exact):
        assert np.abs(robot.constraints.violation(one.q)).max() <= 1e-12
        rows = robot.constraints.jacobian(one.q)
        assert np.abs(rows @ one.qd[..., None]).max() <= 1e-12

    def rates(t: float, state: Any) -> Any:
        moved, _ = multipliers(state[:3], state[3:], tau)
        return np.concatenate([state[3:], sum(share.reshape(3, -1).sum(1) for share in moved.values())])

    own = integrate.solve_ivp(
        rates, (0.0, 0.2), np.concatenate([q, qd]), "DOP853", t_eval=time, rtol=1e-11, atol=1e-12
    )
    assert relative_error(exact.q, own.y[:3].T) <= 1e-8
    assert relative_error(exact.qd, own.y[3:].T) <= 1e-8


def test_a_step_evaluates_ties_no_more_than_twice_a_stage(package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of(CRANK).load("numpy")
    q, qd, tau = (a[0] for a in states(robot, 4))
    calls: list[int] = []
    whole = TieRows.at
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TieRows, "at", lambda *given: (calls.append(1), whole(*given))[1])
        robot.simulate(q, qd, [0.0, 0.02], tau, step=1e-3)
    assert len(calls) <= 8 * 20 + 2


def test_gradients_flow_through_steps_of_a_tied_robot(package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of(CRANK).load("torch")
    torch = pytest.importorskip("torch")
    q, qd, tau = (torch.as_tensor(a[0]) for a in states(robot, 4))

    def start(crank: Any, speed: Any, torque: Any) -> Any:
        moved = q + torch.stack([crank, 0.0 * crank, 0.0 * crank])
        found = robot.simulate(moved, speed * qd, [0.0, 0.03], torque * tau)
        return torch.cat([found.q[-1], found.qd[-1]])

    given = [torch.tensor(a, dtype=torch.float64, requires_grad=True) for a in (0.1, 0.8, 1.2)]
    assert torch.autograd.gradcheck(start, given)


@pytest.mark.parametrize(
    ("backend", "how", "bound"),
    [
        ("numpy", {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12}, 1e-9),
        ("torch", {"step": 4e-3}, 0.02),
        ("numpy", {"method": "Radau", "rtol": 1e-5, "atol": 1e-7}, 0.02),
    ],
)
def test_motions_go_on_where_their_independent_joints_tell_nothing(
    backend: str, how: dict[str, Any], bound: float, tmp_path: Path
) -> None:
    """The rocker turns back at its ends while the crank turns on, at another time in each motion."""
    text = (DATA / "crank_rocker.toml").read_text("utf-8").replace("xyz = [0.8,", "xyz = [0.76,")
    (tmp_path / "rocks.toml").write_text(text, "utf-8")
    write_package(generate(read_system(str(tmp_path / "rocks.toml")), [backend]), tmp_path / "rocks")
    robot = import_package(tmp_path / "rocks").load(backend)
    around, time = np.array([0.4, 1.9, 3.6]), np.linspace(0.0, 0.6, 7)
    q = np.asarray(robot.constraints.closed(np.stack([around, -around, -1.9 + 0.0 * around], -1)))
    qd = np.asarray(robot.constraints.velocity(q, np.array([[11.0], [-10.0], [12.0]])))
    tau = np.array([0.3, 0.0, 0.0]) + 0.0 * q
    motion = [torch.from_numpy(a) for a in (q, qd, tau)] if backend == "torch" else [q, qd, tau]
    rocked = robot.constrained(["knee"], at=q[0])
    found = robot.simulate(motion[0], motion[1], time, motion[2], constraints=rocked, **how)

    def rates(t: float, state: Any) -> Any:
        moved, _ = multipliers(state[:3], state[3:], tau[0])
        return np.concatenate([state[3:], sum(share.reshape(3, -1).sum(1) for share in moved.values())])

    for s in range(len(around)):
        start = np.concatenate([q[s], qd[s]])
        own = integrate.solve_ivp(rates, (0.0, 0.6), start, "DOP853", t_eval=time, rtol=1e-12, atol=1e-12)
        assert np.sign(own.y[5]).min() < np.sign(own.y[5]).max(), "the knee turns back"
        assert relative_error(np.asarray(found.q)[:, s], own.y[:3].T) <= bound
        assert relative_error(np.asarray(found.qd)[:, s], own.y[3:].T) <= bound


@pytest.mark.parametrize("how", [{"step": 0.01}, {"method": "RK45"}])
def test_a_singular_place_of_a_loop_is_told_with_its_time(
    how: dict[str, Any], package_of: Callable[[str], ModuleType]
) -> None:
    """Crank and ground are as long as coupler and rocker: all bars come to lie in one line."""
    robot = package_of(CRANK).load("numpy")
    q = states(robot, 4)[0][0]
    rocked = robot.constrained(["knee"])
    torque = np.array([0.0, 0.0, 30.0])
    message = (
        r"^at t = 0\.1\d+ s the motion comes to a singular position, .*: elbow, knee can move while crank"
    )
    with pytest.raises(ValueError, match=message):
        robot.simulate(q, 0.0 * q, [0.0, 2.0], torque, constraints=rocked, **how)


def test_the_open_tree_of_a_tied_robot_is_asked_for_in_words(
    package_of: Callable[[str], ModuleType],
) -> None:
    robot = package_of(CRANK).load("numpy")
    q, qd, tau = (a[0] for a in states(robot, 4))
    free = robot.induced_accelerations(q, qd, tau, constraints=False)
    cut = np.linalg.solve(robot.mass_matrix(q), tau - robot.inverse_dynamics(q, qd, 0 * q))
    assert relative_error(free.total, cut) <= 1e-12
    falling = robot.simulate(q, qd, [0.0, 0.1], tau, step=0.01, constraints=False)
    assert np.abs(robot.constraints.violation(falling.q[-1])).max() > 1e-3
    with pytest.raises(ValueError, match=r"^pin is open by \d+.* mm; give positions in which ties close"):
        robot.induced_accelerations(np.add(q, [0.1, 0.0, 0.0]), qd, tau)


def test_constraints_that_are_not_the_robots_are_refused(package_of: Callable[[str], ModuleType]) -> None:
    robot = package_of(CRANK).load("numpy")
    q, qd, tau = (a[0] for a in states(robot, 4))
    other = package_of(CRANK).load("torch").constraints
    with pytest.raises(
        ValueError, match=r"^constraints are of another robot than this crank_rocker on numpy"
    ):
        robot.induced_accelerations(q, qd, tau, constraints=other)
    with pytest.raises(TypeError, match=r"^constraints is True; give what robot.constrained\(...\) makes"):
        robot.simulate(q, qd, [0.0, 0.1], constraints=True)


@pytest.mark.parametrize("method", ["RK4", "RK45", "Radau"])
def test_an_error_of_the_users_own_comes_through(
    method: str, package_of: Callable[[str], ModuleType]
) -> None:
    robot = package_of(CRANK).load("numpy")
    q = states(robot, 4)[0][0]

    def pull(t: float, q: Any, qd: Any) -> Any:
        if t > 0.1:
            raise ValueError("the motor is out of breath")
        return np.array([0.0, 0.0, 30.0])

    with pytest.raises(ValueError, match="the motor is out of breath"):
        robot.simulate(q, 0.0 * q, [0.0, 0.5], pull, method=method, constraints=robot.constrained(["knee"]))


HELD = """schema = 1
name = "held"
gravity = [0, -9.81, 0]
joint = [
  {{name = "a", parent = "base", child = "la", friction = 0.2}},
  {{name = "b", parent = "la", child = "lb", xyz = [0.3, 0, 0]}},
  {{name = "c", parent = "lb", child = "lc", xyz = [0.3, 0, 0], friction = {friction}}},
]
link = [
  {{name = "la", mass = 0.4, com = [0.06, 0.01, 0], inertia = {{xx = 0.001, yy = 0.002, zz = 0.002}}}},
  {{name = "lb", mass = 0.9, com = [0.15, 0, 0], inertia = {{xx = 0.002, yy = 0.007, zz = 0.007}}}},
  {{name = "lc", mass = 0.9, com = [0.15, 0, 0], inertia = {{xx = 0.002, yy = 0.007, zz = 0.007}}}},
]
[[constraint]]
name = "belt"
type = "coupling"
terms = {{a = 0.7, b = -0.3, c = 0.9}}
[[constraint]]
name = "tray"
type = "coupling"
terms = {{a = 0.7, b = -0.3, c = 0.1}}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_joint_that_ties_hold_where_it_is_has_no_friction(backend: str, tmp_path: Path) -> None:
    """Two rows leave c none of the motion but rounding, whose sign is not that of a velocity."""
    found = []
    for friction in (0.0, 50.0):
        (tmp_path / "held.toml").write_text(HELD.format(friction=friction))
        made = generate(read_system(tmp_path / "held.toml"), ["numpy", "torch", "native"])
        write_package(made, tmp_path / f"held{friction:.0f}")
        robot: Any = import_package(tmp_path / f"held{friction:.0f}").load(backend)
        state = np.random.default_rng(2).uniform(-1.0, 1.0, (3, 20, 3))
        q, qd, tau = state if backend != "torch" else torch.tensor(state)
        q = robot.constraints.closed(q)
        found.append([np.asarray(a) for a in robot.constraints.forward_dynamics(q, qd, tau)])
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)
