"""`robot.induced_power` and `robot.induced_flow` against energies, wrenches and twists by Pinocchio."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers.answers import relative_error
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.motion.induced_power import fed_by_couplings

pytest.importorskip("pinocchio")

import pinocchio as pin
from numeric.loops import MECHANISMS, LoopOracle
from numeric.oracle_models import link_alone, planar3, puma560
from numeric.pinocchio_model import PinocchioModel
from tools.corpus import ROBOTS

LARGEST_ERROR = 1e-10
STEP = 0.01
SLOPE = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
"""Central differences of order 8."""
AXES = pin.LOCAL_WORLD_ALIGNED
Packages = Callable[[str], ModuleType]


@dataclass
class Whole:
    """A robot in Pinocchio: all links, and the model of each link's mass alone."""

    model: Any
    alone: dict[str, Any]
    tie: Any
    """Velocities of Pinocchio's joints by those of the coordinates (nv, n)."""
    held: list[int] = field(default_factory=list)
    """Frames whose origins are held."""
    rows: Callable[[Any, Any], tuple[Any, Any]] | None = None
    """A and dA/dt qd of ties."""

    def mass(self, link: str, q: Any) -> Any:
        model = self.alone[link]
        mass = np.triu(pin.crba(model, model.createData(), self.tie @ q))
        return self.tie.T @ (mass + np.triu(mass, 1).T) @ self.tie

    def coriolis(self, link: str, q: Any, qd: Any) -> Any:
        model = self.alone[link]
        state = self.tie @ q, self.tie @ qd
        return self.tie.T @ pin.computeCoriolisMatrix(model, model.createData(), *state) @ self.tie

    def gravity(self, link: str, q: Any) -> Any:
        model = self.alone[link]
        return self.tie.T @ pin.computeGeneralizedGravity(model, model.createData(), self.tie @ q)

    def energy(self, link: str, q: Any, qd: Any) -> float:
        model = self.alone[link]
        data, x = model.createData(), self.tie @ q
        kinetic = pin.computeKineticEnergy(model, data, x, self.tie @ qd)
        return float(kinetic + pin.computePotentialEnergy(model, data, x))

    def rate(self, link: str, q: Any, qd: Any, qdd: Any) -> float:
        """dE_j/dt along the motion, by differences."""

        def at(t: float) -> float:
            return self.energy(link, q + t * qd + t**2 / 2 * qdd, qd + t * qdd)

        return sum(w * (at(k * STEP) - at(-k * STEP)) for k, w in SLOPE.items()) / STEP

    def constraints(self, q: Any, qd: Any) -> tuple[Any, Any]:
        """A (C, n) and dA/dt qd (C,)."""
        if self.rows is not None:
            return self.rows(q, qd)
        data, x, v = self.model.createData(), self.tie @ q, self.tie @ qd
        pin.forwardKinematics(self.model, data, x, v, 0 * v)
        pin.computeJointJacobians(self.model, data, x)
        pin.updateFramePlacements(self.model, data)
        rows = [pin.getFrameJacobian(self.model, data, f, AXES)[:3] @ self.tie for f in self.held]
        rates = [pin.getFrameClassicalAcceleration(self.model, data, f, AXES).linear for f in self.held]
        n = self.tie.shape[1]
        return np.concatenate([np.zeros((0, n)), *rows]), np.concatenate([np.zeros(0), *rates])

    def answers(self, q: Any, qd: Any, forces: Any, rate: Any = None) -> Any:
        """Accelerations (n, X) of forces (n, X), each alone; rate: dA/dt qd, for the constraints' own."""
        rows, _ = self.constraints(q, qd)
        mass = sum(self.mass(link, q) for link in self.alone)
        whole = np.block([[mass, -rows.T], [rows, np.zeros((len(rows), len(rows)))]])
        below = np.zeros((len(rows), forces.shape[1])) if rate is None else -rate[:, None]
        return np.linalg.lstsq(whole, np.concatenate([forces, below]), rcond=1e-12)[0][: len(q)]

    def flow(self, models: list[tuple[Any, Any]], q: Any, qd: Any) -> tuple[Any, Any]:
        """Power of the joints' wrenches on the twists behind and before them, (nv,) each.

        models: models, with their gravity, and accelerations whose wrenches add up at rest
        """
        data = self.model.createData()
        x, v = self.tie @ q, self.tie @ qd
        pin.forwardKinematics(self.model, data, x, v)
        behind, before = np.zeros((2, self.model.njoints - 1))
        for model, qdd in models:
            own = model.createData()
            pin.rnea(model, own, x, 0 * v, self.tie @ qdd)
            for joint in range(1, self.model.njoints):
                behind[joint - 1] += own.f[joint].vector @ data.v[joint].vector
                parent = self.model.parents[joint]
                twist = data.liMi[joint].actInv(data.v[parent]).vector if parent else np.zeros(6)
                before[joint - 1] += own.f[joint].vector @ twist
        return behind, before


def at_rest(model: Any) -> Any:
    """The model without gravity."""
    model = model.copy()
    model.gravity.linear = np.zeros(3)
    return model


def serial(package: ModuleType, model: Any) -> Whole:
    robot = package.load("numpy")
    alone = {name: link_alone(model, j + 1) for j, name in enumerate(robot.link_names)}
    return Whole(model, alone, np.eye(robot.n))


@dataclass
class Case:
    package: ModuleType
    robot: Any
    oracle: Whole
    q: Any
    constraints: Any = None


def quadruped(folder: Path) -> tuple[ModuleType, Whole]:
    if not ROBOTS.is_dir():
        pytest.skip("needs real robots: pip install example-robot-data")
    path, options = next(ROBOTS.rglob("solo12.urdf")), Options(base="floating")
    system = read_system(path, options)
    write_package(generate(system, ["numpy"], "robot", kernel="loops"), folder / "robot")
    found = PinocchioModel(path, system, True)
    return import_package(folder / "robot"), Whole(found.model, found.alone, found.tie)


@pytest.fixture(params=["planar3", "puma560", "solo12", "solo12 on two feet", "fourbar"])
def case(request: pytest.FixtureRequest, package_of: Packages, tmp_path: Path) -> Case:
    """A robot, its oracle, a position, and what holds it."""
    draw = np.random.default_rng(3)
    match request.param:
        case "planar3" | "puma560" as name:
            package = package_of(name)
            oracle = serial(package, planar3() if name == "planar3" else puma560())
            return Case(package, package.load("numpy"), oracle, draw.uniform(-1.5, 1.5, oracle.model.nv))
        case "fourbar":
            made = MECHANISMS["fourbar"]
            (tmp_path / "fourbar.toml").write_text(made.text, encoding="utf-8")
            write_package(generate(read_system(tmp_path / "fourbar.toml"), ["numpy"]), tmp_path / "fourbar")
            package = import_package(tmp_path / "fourbar")
            robot = package.load("numpy")
            known = LoopOracle(made, robot.joint_names)
            alone = {name: link_alone(known.model, known.owner[name]) for name in robot.link_names}
            tie = np.eye(robot.n)[known.order]
            q = robot.constraints.closed(np.array(made.q))
            whole = Whole(known.model, alone, tie, rows=known.rows)
            return Case(package, robot, whole, q, robot.constraints)
        case name:
            package, oracle = quadruped(tmp_path)
            robot = package.load("numpy")
            bend = {"HAA": 0.2, "HFE": 0.7, "KFE": -1.3}
            turned = [0.1, 0.2, 0.3, 0.3, -0.2, 0.1]
            q = np.array([*turned, *(bend[joint[-3:]] for joint in robot.joint_names[6:])])
            if name == "solo12":
                return Case(package, robot, oracle, q)
            feet = ["FL_FOOT", "HR_FOOT"]
            oracle.held = [oracle.model.getFrameId(foot, pin.BODY) for foot in feet]
            contacts = [package.Contact(foot, "point") for foot in feet]
            return Case(package, robot, oracle, q, robot.constrained(contacts=contacts, at=q))


@dataclass
class Motion:
    robot: Any
    q: Any
    qd: Any
    tau: Any
    load: Any
    pull: Any
    options: dict[str, Any]


def motion_of(case: Case) -> Motion:
    robot, draw = case.robot, np.random.default_rng(4)
    qd, qdd = draw.uniform(-1.0, 1.0, (2, robot.n))
    if case.constraints is not None:
        own = len(case.constraints.independent)
        qd = case.constraints.velocity(case.q, qd[:own])
        qdd = case.constraints.acceleration(case.q, qd, qdd[:own])
    force, moment, point = draw.uniform(-2.0, 2.0, (3, 3))
    load = case.package.AppliedLoad(robot.link_names[-1], force, moment, point)
    pull = robot.kinematics.load_torque(case.q, *load)
    tau = robot.inverse_dynamics(case.q, qd, qdd) + pull
    options = {} if case.constraints is None else {"constraints": case.constraints}
    return Motion(robot, case.q, qd, tau, load, pull, options)


def test_rows_sum_to_the_rate_of_each_links_energy_and_columns_to_the_sources_power(case: Case) -> None:
    at, oracle = motion_of(case), case.oracle
    given = at.q, at.qd, at.tau
    power = at.robot.induced_power(*given, loads=[at.load], passive=False, **at.options)
    qdd = at.robot.induced_accelerations(*given, loads=[at.load], passive=False, **at.options).total
    rates = np.array([oracle.rate(link, at.q, at.qd, qdd) for link in at.robot.link_names])
    assert relative_error(power.total, rates) <= LARGEST_ERROR
    scale = np.abs(rates).max()
    assert np.abs(power.actuators.sum(0) - at.tau * at.qd).max() <= LARGEST_ERROR * scale
    assert np.abs(power.loads.sum(0) + at.pull @ at.qd).max() <= LARGEST_ERROR * scale
    for handed_on in (power.velocity, power.gravity, power.constraints, power.passive, power.kinematic):
        assert np.abs(handed_on.sum(0)).max() <= LARGEST_ERROR * scale


def test_every_source_alone_gives_each_link_what_pinocchio_says(case: Case) -> None:
    at, oracle = motion_of(case), case.oracle
    power = at.robot.induced_power(at.q, at.qd, at.tau, loads=[at.load], passive=False, **at.options)
    q, qd, links = at.q, at.qd, at.robot.link_names
    momenta = np.array([qd @ oracle.mass(link, q) for link in links])
    weights = np.stack([oracle.gravity(link, q) for link in links], 1)
    bends = np.stack([oracle.coriolis(link, q, qd) * qd for link in links], 1)
    n, count = bends.shape[:2]
    velocity = momenta @ oracle.answers(q, qd, -bends.reshape(n, -1))
    own = np.einsum("i,ijs->js", qd, bends)
    expected = {
        "actuators": momenta @ oracle.answers(q, qd, np.diag(at.tau)),
        "velocity": velocity.reshape(count, count, n) + np.eye(count)[..., None] * own,
        "gravity": momenta @ oracle.answers(q, qd, -weights) + np.diag(qd @ weights),
        "loads": momenta @ oracle.answers(q, qd, -at.pull[:, None]),
    }
    for name, values in expected.items():
        assert relative_error(getattr(power, name), values) <= LARGEST_ERROR, name
    rate = oracle.constraints(q, qd)[1]
    turned = momenta @ oracle.answers(q, qd, np.zeros((n, 1)), rate)
    scale = max(np.abs(turned).max(), np.abs(velocity).max())
    assert np.abs(power.constraints.sum(-1, keepdims=True) - turned).max() <= LARGEST_ERROR * scale


@pytest.mark.parametrize("case", ["planar3", "puma560", "solo12"], indirect=True)
def test_the_flow_through_a_joint_is_what_its_wrench_does_on_the_twist_of_its_body(case: Case) -> None:
    at, oracle = motion_of(case), case.oracle
    q, qd, tie = at.q, at.qd, oracle.tie
    given = {"q": q, "qd": qd, "tau": at.tau, "passive": False}
    sides = [at.robot.induced_flow(**given, side=side) for side in ("successor", "predecessor")]
    still = at_rest(oracle.model)
    units = oracle.answers(q, qd, np.diag(at.tau)).T
    largest = LARGEST_ERROR * np.abs(sides[0].total).max()
    for i, qdd in enumerate(units):
        for found, by_wrench in zip(sides, oracle.flow([(still, qdd)], q, qd), strict=True):
            assert np.abs(found.actuators[:, i] - tie.T @ by_wrench).max() <= largest
    for j, link in enumerate(at.robot.link_names):
        qdd = oracle.answers(q, qd, -oracle.gravity(link, q)[:, None])[:, 0]
        models = [(still, qdd), (oracle.alone[link], 0 * qdd)]
        for found, by_wrench in zip(sides, oracle.flow(models, q, qd), strict=True):
            assert np.abs(found.gravity[:, j] - tie.T @ by_wrench).max() <= largest
    differ = sides[0].total - sides[1].total
    assert np.abs(differ - at.tau * qd).max() <= largest


def test_what_a_load_gives_behind_a_joint_does_not_flow_through_it(package_of: Packages) -> None:
    package = package_of("planar3")
    robot, model = package.load("numpy"), planar3()
    q, qd = np.array([0.3, 0.8, -0.5]), np.array([1.0, -2.0, 3.0])
    force = np.array([3.0, -2.0, 0.0])
    flow = robot.induced_flow(q, qd, [0.5, -0.3, 0.2], loads=[package.AppliedLoad("link2", force)])
    qdd = robot.forward_dynamics(q, qd, [0.5, -0.3, 0.2] - robot.kinematics.load_torque(q, "link2", force))
    data, pushes = model.createData(), pin.StdVec_Force()
    pin.forwardKinematics(model, data, q, qd)
    local = data.oMi[2].rotation.T @ force
    pushes.extend([pin.Force(local * (j == 2), 0 * local) for j in range(4)])
    pin.rnea(model, data, q, qd, qdd, pushes)
    power = [data.f[j].vector @ data.v[j].vector for j in (1, 2, 3)]
    assert relative_error(flow.total, power) <= LARGEST_ERROR


ARM = """schema = 1
name = "sprung"
gravity = [0, -9.81, 0]
joint = [
  {name = "a", parent = "base", child = "upper", stiffness = 3.0, rest = 0.2, damping = 0.3, armature = 0.4},
  {name = "b", parent = "upper", child = "lower", xyz = [0.3, 0, 0], friction = 0.2, armature = 0.2},
]
link = [
  {name = "upper", mass = 1.5, com = [0.1, 0, 0], inertia = {xx = 0.1, yy = 0.1, zz = 0.1}},
  {name = "lower", mass = 0.7, com = [0.2, 0, 0], inertia = {xx = 0.1, yy = 0.1, zz = 0.1}},
]
"""


def test_armature_has_rows_of_its_own_and_springs_and_losses_are_sources(tmp_path: Path) -> None:
    (tmp_path / "sprung.toml").write_text(ARM, encoding="utf-8")
    write_package(generate(read_system(tmp_path / "sprung.toml"), ["numpy"]), tmp_path / "sprung")
    robot = import_package(tmp_path / "sprung").load("numpy")
    q, qd, tau = np.array([0.4, -0.7]), np.array([1.1, -0.6]), np.array([2.0, -1.0])
    qdd, armature = robot.forward_dynamics(q, qd, tau), np.array([0.4, 0.2])
    power = robot.induced_power(q, qd, tau)
    assert np.allclose(power.total[2:], armature * qd * qdd, rtol=1e-12)
    assert np.allclose(power.total[:2], robot.power(q, qd, qdd).total.sum(0), rtol=1e-12)
    lost = [-3.0 * (0.4 - 0.2) * 1.1, 0.0], [-0.3 * 1.1**2, 0.0], [0.0, -0.2 * 0.6]
    assert np.allclose(power.passive.sum(0), lost, rtol=1e-12, atol=1e-14)
    assert np.allclose(power.actuators.sum(0), tau * qd, rtol=1e-12)
    after, before = (robot.induced_flow(q, qd, tau, side=side) for side in ("successor", "predecessor"))
    through = tau * qd + np.sum(lost, 0) - armature * qd * qdd
    assert np.allclose(after.total - before.total, through, rtol=1e-12)
    assert abs(before.total[0]) <= 1e-13, "nothing flows out of the ground"
    assert np.allclose(after.total[1], robot.power(q, qd, qdd).total.sum(0)[1], rtol=1e-12)


DRAG = """
from linkwise import Coordinate, LinkEnergy
x, y = Coordinate("x", "m"), Coordinate("y", "m")
name, coordinates = "sledge", [x, y]
links = [
    LinkEnergy("sledge", 3 * x.qd**2 / 2, {"spring": 5 * x.q**2}, {"drag": 0.7 * x.qd**2 / 2}),
    LinkEnergy("load", (x.qd + y.qd)**4 / 12 + (x.qd + y.qd)**2, 0),
]
"""


def test_links_of_energies_lose_what_their_dissipation_takes_at_any_degree(tmp_path: Path) -> None:
    (tmp_path / "sledge.py").write_text(DRAG, encoding="utf-8")
    write_package(generate(read_system(tmp_path / "sledge.py"), ["numpy"]), tmp_path / "sledge")
    robot = import_package(tmp_path / "sledge").load("numpy")
    q, qd, tau = np.array([0.4, 0.1]), np.array([1.3, -0.6]), np.array([2.0, -1.0])
    v = qd.sum()
    force = tau[0] - tau[1] - 10 * q[0] - 0.7 * qd[0]  # what is left to the sledge
    xdd, of_both = force / 3, tau[1] / (v**2 + 2)
    power = robot.induced_power(q, qd, tau)
    rates = [3 * qd[0] * xdd + 10 * q[0] * qd[0], (v**3 + 2 * v) * of_both]  # (v dL/dv - L)' by hand
    assert np.allclose(power.total, rates, rtol=1e-12)
    assert np.allclose(power.gravity.sum(0), [-0.7 * qd[0] ** 2, 0.0], rtol=1e-12, atol=1e-14)
    assert np.allclose(power.actuators.sum(0), tau * qd, rtol=1e-12)
    with pytest.raises(ValueError, match=r"^sledge is given by energies, which do not say what hangs"):
        robot.induced_flow(q, qd, tau)


def test_a_base_that_turns_gives_power_by_its_imposed_motion(package_of: Packages) -> None:
    robot = package_of(str(DATA / "turntable.py")).load("numpy")
    (x, y), (u, v), tau = (0.4, -0.3), (1.3, -0.6), np.array([0.7, 0.2])
    power = robot.induced_power([x, y], [u, v], tau)
    a, b = robot.forward_dynamics([x, y], [u, v], tau)
    rate = 0.4 * (u * a + v * b * (2 + x**2) + x * u * v**2)  # of the terms of degree two alone
    assert abs(power.total[0] - rate) <= 1e-12
    assert abs(power.gravity.sum() - (rate - tau @ [u, v])) <= 1e-12


@pytest.mark.parametrize(
    ("robot", "coupled"),
    [("crane.urdf", ["lift", "pitch"]), ("leg.toml", [])],
)
def test_flows_that_contain_what_couplings_feed_in_are_known(
    robot: str, coupled: list[str], package_of: Packages
) -> None:
    """Joints fold, level and counter of the crane follow pitch; only counter is not behind lift."""
    own = package_of(f"{DATA / robot} loops").load("numpy")
    found = fed_by_couplings(own.backend.tree, own.n)
    assert [own.joint_names[i] for i in found] == coupled


def test_another_side_is_refused(package_of: Packages) -> None:
    with pytest.raises(ValueError, match=r"^side is 'child'; give successor or predecessor$"):
        package_of("planar3").load("numpy").induced_flow([0.0] * 3, [0.0] * 3, [0.0] * 3, side="child")
