"""Closed loops and contacts against Pinocchio, MuJoCo and Lagrange's multipliers by SymPy."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from conftest import needs_compiler
from helpers.answers import relative_error
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.quantities import Contact

pytest.importorskip("pinocchio")

from tools.corpus import ROBOTS

from numeric.loops import MECHANISMS, LoopOracle, constraint_dynamics
from numeric.pinocchio_model import PinocchioModel
from numeric.standing import standing_acceleration

LIMIT = 1e-9
SAMPLES = 6


class Closed:
    """A mechanism, its oracle, and motions in which its loops stay closed."""

    def __init__(self, name: str, backend: str, folder: Path) -> None:
        mechanism = MECHANISMS[name]
        (folder / "robot.toml").write_text(mechanism.text)
        write_package(
            generate(read_system(folder / "robot.toml"), ["numpy", "native"], kernel="loops"), folder / name
        )
        self.robot: Any = import_package(folder / name).load(backend)
        self.constraints: Any = self.robot.constraints
        self.oracle = LoopOracle(mechanism, self.robot.joint_names)
        self.free = mechanism.free
        self.own = [self.robot.joint_index(joint) for joint in self.constraints.independent]
        draw, n = np.random.default_rng(3), self.robot.n
        self.q = self.constraints.closed(np.array(mechanism.q) + draw.uniform(-0.02, 0.02, (SAMPLES, n)))
        yd, ydd = draw.uniform(-2.0, 2.0, (2, SAMPLES, len(self.own)))
        self.qd = self.constraints.velocity(self.q, yd)
        self.qdd = self.constraints.acceleration(self.q, self.qd, ydd)
        self.tau = draw.uniform(-1.0, 1.0, (SAMPLES, n))

    def each(self, of_sample: Callable[..., Any], *motion: Any) -> Any:
        """Return what the oracle says, sample by sample."""
        return np.array([of_sample(*(a[s] for a in motion)) for s in range(SAMPLES)])


@pytest.fixture(scope="module", params=["numpy", pytest.param("native", marks=needs_compiler)])
def backend(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module", params=list(MECHANISMS))
def closed(request: pytest.FixtureRequest, backend: str, tmp_path_factory: pytest.TempPathFactory) -> Closed:
    return Closed(request.param, backend, tmp_path_factory.mktemp(request.param))


def test_loops_are_closed_and_have_the_freedoms_that_they_have(closed: Closed) -> None:
    assert np.abs(closed.constraints.violation(closed.q)).max() < 1e-12
    assert len(closed.constraints.independent) == closed.free


def test_rows_and_their_rates_are_pinocchios(closed: Closed) -> None:
    rows = closed.each(lambda q, qd: closed.oracle.rows(q, qd)[0], closed.q, closed.qd)
    drift = closed.each(lambda q, qd: closed.oracle.rows(q, qd)[1], closed.q, closed.qd)
    assert relative_error(closed.constraints.jacobian(closed.q), rows) <= LIMIT
    rate = closed.constraints.jacobian_rate(closed.q, closed.qd)
    assert relative_error((rate @ closed.qd[..., None])[..., 0], drift) <= LIMIT
    step = 1e-5 * closed.qd
    ahead, behind = (closed.constraints.jacobian(closed.q + s) for s in (step, -step))
    np.testing.assert_allclose(rate, (ahead - behind) / 2e-5, atol=1e-8)


def test_joints_move_and_ties_bear_as_in_one_system_of_equations(closed: Closed) -> None:
    found = closed.constraints.forward_dynamics(closed.q, closed.qd, closed.tau, passive=False)
    state = closed.q, closed.qd, closed.tau
    both = [closed.each(lambda *a, part=part: closed.oracle.motion(*a)[part], *state) for part in (0, 1)]
    assert relative_error(found.qdd, both[0]) <= LIMIT
    # Where rows say the same twice, both choose the least forces.
    assert relative_error(found.forces, both[1]) <= LIMIT


@pytest.mark.parametrize("name", ["fourbar", "held_arm"])
def test_joints_move_as_pinocchios_constraint_dynamics_says(name: str, tmp_path: Path) -> None:
    closed = Closed(name, "numpy", tmp_path)
    found = closed.constraints.forward_dynamics(closed.q, closed.qd, closed.tau, passive=False)
    motion = closed.q, closed.qd, closed.tau
    expected = closed.each(lambda *state: constraint_dynamics(closed.oracle, *state), *motion)
    assert relative_error(found.qdd, expected) <= LIMIT


def test_shares_and_forces_of_a_link_balance_its_torques_of_the_open_tree(closed: Closed) -> None:
    motion = closed.q, closed.qd, closed.qdd
    shares, forces = closed.constraints.partial_torque(*motion), closed.constraints.forces(*motion)
    rows = closed.each(lambda q, qd: closed.oracle.rows(q, qd)[0], closed.q, closed.qd)
    for j, link in enumerate(closed.robot.link_names):
        needed = closed.each(lambda *state, link=link: closed.oracle.torque(link, *state), *motion)
        borne = (np.swapaxes(rows, -1, -2) @ forces[..., j, None])[..., 0]
        borne[:, closed.own] += shares[..., j]
        assert relative_error(borne, needed) <= LIMIT
    total = closed.constraints.inverse_dynamics(*motion)
    np.testing.assert_allclose(shares.sum(-1), total, atol=1e-12 * np.abs(total).max())


def test_actuators_give_the_torques_that_inverse_dynamics_asks(closed: Closed) -> None:
    torque = np.zeros_like(closed.tau)
    torque[:, closed.own] = closed.constraints.inverse_dynamics(closed.q, closed.qd, closed.qdd)
    found = closed.each(lambda *state: closed.oracle.motion(*state)[0], closed.q, closed.qd, torque)
    assert relative_error(found, closed.qdd) <= LIMIT


def test_coefficients_close_and_are_half_of_what_velocities_change(closed: Closed) -> None:
    constraints, q, qd = closed.constraints, closed.q, closed.qd
    c2, c1, g = constraints.coefficients(q, qd)
    yd, ydd = (a[:, None, None, closed.own] for a in (qd, closed.qdd))
    shares = constraints.partial_torque(q, qd, closed.qdd)
    assert relative_error((c2 * ydd).sum(-1) + (c1 * yd).sum(-1) + g, shares) <= LIMIT
    acceleration, velocity, gravity = constraints.propagation(q, qd, closed.qdd)
    assert relative_error(acceleration.sum(-1) + velocity.sum(-1) + gravity, shares) <= LIMIT
    for b, joint in enumerate(closed.own):
        unit = np.eye(closed.robot.n)[joint]
        up, down = (constraints.partial_torque(q, qd + s * unit, 0.0 * qd) for s in (1.0, -1.0))
        # The force is a quadratic form of yd: its central difference is its derivative.
        np.testing.assert_allclose(c1[..., b], (up - down) / 4.0, atol=LIMIT * np.abs(c1).max())


def test_power_of_the_shares_of_a_link_is_the_rate_of_its_energy(closed: Closed) -> None:
    shares, h = closed.constraints.partial_torque(closed.q, closed.qd, closed.qdd), 2e-4
    power = (shares * closed.qd[:, closed.own, None]).sum(1)
    for j, link in enumerate(closed.robot.link_names):

        def energy(t: float, link: str = link) -> Any:
            q, qd = closed.q + t * closed.qd, closed.qd + t * closed.qdd
            return closed.each(lambda *state: closed.oracle.energy(link, *state), q, qd)

        rate = (8.0 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12.0 * h)
        np.testing.assert_allclose(power[:, j], rate, atol=LIMIT * max(1.0, np.abs(power).max()))


def lagrange_fourbar() -> Callable[..., Any]:
    """(u, lambda_x, lambda_y) of a planar four-bar for (q, qd, qdd), by Lagrange's multipliers, in SymPy."""
    t = sp.Symbol("t")
    a, b, c = (sp.Function(name)(t) for name in "abc")
    u, x, y = sp.symbols("u x y")

    def centre(base: Any, angle: Any, com: tuple[float, float]) -> Any:
        turn = sp.Matrix([[sp.cos(angle), -sp.sin(angle)], [sp.sin(angle), sp.cos(angle)]])
        return sp.Matrix(base) + turn * sp.Matrix(com)

    links = {link.name: link for link in MECHANISMS["fourbar"].robot.links}
    gravity = sp.Matrix(MECHANISMS["fourbar"].robot.gravity[:2])
    knee = centre((0, 0), a, (0.3, 0.0))
    energy: Any = 0
    for name, base, angle in (("a", (0, 0), a), ("b", knee, a + b), ("c", (0.6, 0.1), c)):
        link = links[name]
        place = centre(base, angle, link.com[:2])
        spin = sp.diff(angle, t)
        speed = sp.diff(place, t)
        energy += link.mass * speed.dot(speed) / 2 + link.inertia[2][2] * spin**2 / 2
        energy += link.mass * gravity.dot(place)
    gap = centre(knee, a + b, (0.7, 0.0)) - centre((0.6, 0.1), c, (0.5, 0.0))
    equations = [
        sp.diff(sp.diff(energy, sp.diff(k, t)), t) - sp.diff(energy, k) - (u if k is a else 0)
        - x * sp.diff(gap[0], k) - y * sp.diff(gap[1], k)
        for k in (a, b, c)
    ]  # fmt: skip
    motion = [sp.diff(k, t, order) for order in (2, 1) for k in (a, b, c)] + [a, b, c]
    names = sp.symbols("s0:9")
    plain = sp.Matrix(equations).subs(dict(zip(motion, names, strict=True)))
    unknown = [u, x, y]
    parts = [plain.jacobian(unknown), plain.subs(dict.fromkeys(unknown, 0))]
    system = sp.lambdify([names[6:], names[3:6], names[:3]], parts)

    def solved(*state: Any) -> Any:
        matrix, rest = system(*state)
        return -np.linalg.solve(matrix, rest)[:, 0]

    return solved


def test_a_fourbar_is_as_lagranges_multipliers_say(backend: str, tmp_path: Path) -> None:
    closed = Closed("fourbar", backend, tmp_path)
    motion = closed.q, closed.qd, closed.qdd
    expected = closed.each(lagrange_fourbar(), *motion)
    torque = closed.constraints.inverse_dynamics(*motion)
    assert relative_error(torque[:, 0], expected[:, 0]) <= LIMIT
    assert relative_error(closed.constraints.forces(*motion).sum(-1)[:, :2], expected[:, 1:]) <= LIMIT


MUJOCO = """<mujoco><option gravity="0.5 -9.81 0"/><compiler balanceinertia="false" autolimits="true"/>
<worldbody>
 <body name="a"><joint name="crank" axis="0 0 1"/>
  <inertial pos="0.15 0.01 0" mass="1.2" diaginertia="0.02 0.03 0.025"/>
  <body name="b" pos="0.3 0 0"><joint name="knee" axis="0 0 1"/>
   <inertial pos="0.3 -0.02 0" mass="2" diaginertia="0.02 0.03 0.045"/></body></body>
 <body name="c" pos="0.6 0.1 0"><joint name="rocker" axis="0 0 1"/>
  <inertial pos="0.2 0 0" mass="1.5" diaginertia="0.02 0.03 0.035"/></body>
</worldbody>
<equality><connect name="pin" body1="b" body2="c" anchor="0.7 0 0"/></equality></mujoco>"""


def test_projected_torques_are_mujocos_inverse_dynamics(backend: str, tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    # At q = 0, where `connect` takes its second anchor, its bodies lie stretched: c's place is 0.4, -0.1.
    (tmp_path / "fourbar.xml").write_text(MUJOCO)
    write_package(generate(read_system(tmp_path / "fourbar.xml"), ["numpy", "native"]), tmp_path / "fourbar")
    robot: Any = import_package(tmp_path / "fourbar").load(backend)
    constraints: Any = robot.constraints
    q = constraints.closed(np.array([0.6, -0.7, 0.3]))
    qd = constraints.velocity(q, np.array([0.8]))
    qdd = constraints.acceleration(q, qd, np.array([-1.3]))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "fourbar.xml"))
    data = mujoco.MjData(model)
    data.qpos, data.qvel, data.qacc = q, qd, qdd
    mujoco.mj_inverse(model, data)
    expected = constraints.velocity_map(q).T @ data.qfrc_inverse
    assert relative_error(constraints.inverse_dynamics(q, qd, qdd), expected) <= LIMIT
    assert relative_error(constraints.projected(q, data.qfrc_inverse), expected) <= LIMIT


FEET = {
    "solo12": [Contact(f"{side}_FOOT", "point") for side in ("FL", "FR", "HL", "HR")],
    "simple_humanoid_classical": [Contact("l_ankle", "held", name="left"), Contact("r_ankle")],
}


@pytest.mark.skipif(not ROBOTS.is_dir(), reason="needs real robots: pip install example-robot-data")
@pytest.mark.parametrize("name", FEET)
def test_a_floating_robot_with_feet_on_the_ground_moves_as_pinocchios(
    name: str, backend: str, tmp_path: Path
) -> None:
    path = next(ROBOTS.rglob(f"{name}.urdf"))
    system = read_system(path, Options(base="floating"))
    write_package(generate(system, ["numpy", "native"], kernel="loops"), tmp_path / "robot")
    robot: Any = import_package(tmp_path / "robot").load(backend)
    constraints = robot.constrained(contacts=FEET[name])
    draw = np.random.default_rng(1)
    q = draw.uniform(-0.6, 0.6, robot.n)
    tau = draw.uniform(-5.0, 5.0, robot.n)
    qd = constraints.velocity(q, draw.uniform(-1.0, 1.0, len(constraints.independent)))
    own = PinocchioModel(path, system, floating=True)
    expected = standing_acceleration(own, FEET[name], q, qd, tau)
    found = constraints.forward_dynamics(q, qd, tau, passive=False)
    assert relative_error(found.qdd, expected) <= LIMIT
    # What nobody drives follows: coordinates of the base are not among the independent ones.
    assert not [joint for joint in constraints.independent if joint.startswith("base")]
