"""Sums, and what each source accelerates, against OpenSim: a leg that swings or stands, and closed loops."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzz.valid_robots import JointData, LinkData, RobotData
from helpers.answers import relative_error
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip(
    "opensim", reason="needs opensim, which has wheels for Linux on x86-64: pip install opensim"
)
pytest.importorskip("pinocchio")  # of whose models `loops` is made

import opensim as osim

from numeric.loops import MECHANISMS, NONE, Row, Z, body, hinge
from numeric.opensim_induced import Foot, by_source, induced_accelerations
from numeric.opensim_model import OpenSimModel, numbers

LIMIT = 1e-12
SAMPLES = 3
LEG = RobotData(
    "toml",
    (0.4, -9.81, 0.0),
    (
        LinkData("base"),
        body("pelvis", 11.0, (-0.07, 0.01, 0.02)),
        body("torso", 33.0, (-0.03, 0.34, 0.01)),
        body("thigh", 9.0, (0.01, -0.19, 0.0)),
        body("shank", 3.6, (0.0, -0.18, 0.01)),
        body("foot", 1.2, (0.1, 0.03, 0.0)),
    ),
    (
        JointData("pelvis", "planar", "base", "pelvis", (0.1, 0.2, 0.02), NONE, Z),
        hinge("back", "pelvis", "torso", (-0.1, 0.08, 0.0)),
        hinge("hip", "pelvis", "thigh", (-0.07, -0.06, 0.08)),
        hinge("knee", "thigh", "shank", (0.01, -0.4, 0.0)),
        hinge("ankle", "shank", "foot", (-0.05, -0.42, 0.0)),
    ),
)
CALF: dict[str, Row] = {"thigh": (-0.02, -0.38, 0.01), "foot": (-0.04, 0.01, 0.0)}
TENSION, HAND = 700.0, (0.03, 0.4, -0.2)
PUSH = 60.0, -30.0, 0.0
SOLE = 0.12, -0.05, 0.01
FEET = {"swings": None, "stands": Foot("foot", SOLE, False), "stuck": Foot("foot", SOLE, True)}


def package(folder: Path, name: str) -> Any:
    """Return the package that linkwise makes of the folder's robot.toml."""
    system = read_system(folder / "robot.toml")
    write_package(generate(system, ["numpy"], name, kernel="loops"), folder / name)
    return import_package(folder / name)


class Leg:
    """The leg of linkwise, and motions."""

    def __init__(self, folder: Path) -> None:
        (folder / "robot.toml").write_text(LEG.text)
        self.module = package(folder, "leg")
        self.robot: Any = self.module.load("numpy")
        draw = np.random.default_rng(5)
        self.q, self.qd, self.qdd = draw.uniform(-1.5, 1.5, (3, SAMPLES, self.robot.n))
        self.tau = draw.uniform(-80.0, 80.0, (SAMPLES, self.robot.n))


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Leg:
    return Leg(tmp_path_factory.mktemp("leg"))


def test_torques_and_mass_matrix_are_opensims(leg: Leg) -> None:
    for q, qd, qdd in zip(leg.q, leg.qd, leg.qdd, strict=True):
        model = OpenSimModel(LEG)
        state = model.state(q, qd)
        order, n = model.order(state), leg.robot.n
        moved, mass = osim.Vector(n, 0.0), osim.Matrix()
        for place, value in zip(order, qdd, strict=True):
            moved.set(place, float(value))
        torque = numbers(osim.InverseDynamicsSolver(model.model).solve(state, moved))[order]
        assert relative_error(leg.robot.inverse_dynamics(q, qd, qdd), torque) <= LIMIT
        model.model.getMatterSubsystem().calcM(state, mass)
        expected = np.array([[mass.get(i, k) for k in order] for i in order])
        assert relative_error(leg.robot.mass_matrix(q), expected) <= LIMIT


def sources(shares: Any, names: tuple[str, ...], loads: tuple[str, ...] = ()) -> dict[str, Any]:
    """Shares as OpenSim has them: what velocities turn, of joints, constraints and points, is one."""
    own = shares.velocity.sum((-2, -1)) + shares.constraints.sum(-1) + shares.kinematic.sum(-1)
    motors = {f"motor_{name}": shares.actuators[..., k] for k, name in enumerate(names)}
    forces = {name: shares.loads[..., k] for k, name in enumerate(loads)}
    return motors | forces | {"gravity": shares.gravity.sum(-1), "velocity": own, "total": shares.total}


def assert_same(found: dict[str, Any], expected: dict[str, Any]) -> None:
    """Each source's share, as a part of the largest."""
    assert found.keys() == expected.keys()
    both = (np.array([answer[source] for source in expected]) for answer in (found, expected))
    assert relative_error(*both) <= LIMIT


def beside(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Rows of several answers, by source."""
    return {source: np.concatenate([part[source] for part in parts]) for source in parts[0]}


class Asked:
    """A question to both: a state, torques, a muscle, a hand's push, and whether the foot is held."""

    def __init__(self, leg: Leg, foot: Foot | None, sample: int, folder: Path) -> None:
        self.leg, self.folder = leg, folder
        q, qd, tau = leg.q[sample], leg.qd[sample], leg.tau[sample]
        self.given: dict[str, Any] = {"q": q, "qd": qd, "tau": tau, "constraints": False}
        if foot:
            contact = leg.module.Contact(foot.body, "held" if foot.welded else "point", foot.point)
            standing = leg.robot.constrained(contacts=[contact], at=q)
            qd = standing.velocity(q, qd[: len(standing.independent)])
            self.given |= {"qd": qd, "constraints": standing}
        model = OpenSimModel(LEG)
        model.motors(tau)
        model.muscle("calf", CALF, TENSION)
        model.push("hand", "torso", HAND, PUSH)
        induced_accelerations(model, q, qd, foot, folder)
        self.given["loads"] = [self._calf(q), leg.module.AppliedLoad("torso", PUSH, point=HAND)]

    def _calf(self, q: Any) -> list[Any]:
        """Return the two loads of a muscle that pulls both ends together."""
        ends = [self.leg.robot.kinematics.pose(q, name) @ (*point, 1.0) for name, point in CALF.items()]
        line = (ends[1] - ends[0])[:3]
        pull = TENSION * line / np.linalg.norm(line)
        pairs = zip(CALF.items(), (pull, -pull), strict=True)
        return [self.leg.module.AppliedLoad(name, force, point=point) for (name, point), force in pairs]

    def sources(self, shares: Any) -> dict[str, Any]:
        return sources(shares, self.leg.robot.joint_names, ("calf", "hand"))

    def opensims(self, name: str, *ends: str) -> dict[str, Any]:
        return by_source(self.folder / f"_induced_{name}.sto", *ends)


def at_origin(rows: Any, point: Any) -> Any:
    """A moment, where there is one, and a force on a point as those on the body's origin."""
    moment, force = np.concatenate([np.zeros(6 - len(rows)), rows]).reshape(2, 3)
    return np.concatenate([moment + np.cross(point, force), force])


@pytest.mark.parametrize("sample", range(SAMPLES))
@pytest.mark.parametrize("kind", FEET)
def test_each_source_accelerates_as_opensims_analysis_says(
    kind: str, sample: int, leg: Leg, tmp_path: Path
) -> None:
    asked = Asked(leg, FEET[kind], sample, tmp_path)
    answer, bodies = asked.leg.robot.induced_accelerations, [(link.name, link.com) for link in LEG.links[1:]]
    names = asked.leg.robot.joint_names
    assert_same(asked.sources(answer(**asked.given)), beside([asked.opensims(name, "") for name in names]))
    points = [asked.sources(answer(**asked.given, frame=name, point=com)) for name, com in bodies]
    ends = "_Ox", "_Oy", "_Oz", "_X", "_Y", "_Z"
    assert_same(beside(points), beside([asked.opensims(name, *ends) for name, _ in bodies]))
    centre = asked.sources(answer(**asked.given, frame="centre of mass"))
    assert_same(centre, asked.opensims("center_of_mass", "_X", "_Y", "_Z"))


@pytest.mark.parametrize("sample", range(SAMPLES))
@pytest.mark.parametrize("kind", ["stands", "stuck"])
def test_the_ground_bears_of_each_source_what_opensim_says(
    kind: str, sample: int, leg: Leg, tmp_path: Path
) -> None:
    asked = Asked(leg, FEET[kind], sample, tmp_path)
    borne = asked.sources(asked.leg.robot.induced_reactions(**asked.given))
    ends = tuple(f"_held_foot_{row}" for row in ("Mx", "My", "Mz", "Fx", "Fy", "Fz"))
    expected = asked.opensims("induced_constraint_reactions", *ends)
    place = asked.leg.robot.kinematics.pose(asked.given["q"], "foot")[:3, :3] @ SOLE
    # OpenSim's are those of Simbody's multipliers, which the foot gives: Newton's law tells their sign.
    assert_same({source: -at_origin(rows, place) for source, rows in borne.items()}, expected)
    moved = asked.opensims("center_of_mass", "_X", "_Y", "_Z")["gravity"] - LEG.gravity
    assert relative_error(borne["gravity"][-3:], sum(link.mass for link in LEG.links) * moved) <= LIMIT


@pytest.mark.parametrize("name", ["fourbar", "fivebar"])
def test_a_closed_loop_moves_by_each_source_as_opensims_does(name: str, tmp_path: Path) -> None:
    mechanism, draw = MECHANISMS[name], np.random.default_rng(6)
    (tmp_path / "robot.toml").write_text(mechanism.text)
    robot: Any = package(tmp_path, name).load("numpy")
    loop, names = robot.constraints, robot.joint_names
    q = loop.closed(np.array(mechanism.q))
    qd = loop.velocity(q, draw.uniform(-2.0, 2.0, mechanism.free))
    tau = draw.uniform(-5.0, 5.0, robot.n)
    model = OpenSimModel(mechanism.robot)
    for tie in mechanism.ties:  # a hinge holds no more than a point does where all moves in a plane
        model.pin(tie.name, (tie.first.frame, tie.first.xyz), (tie.second.frame, tie.second.xyz))
    model.motors(tau)
    state = induced_accelerations(model, q, qd, None, tmp_path)
    each = [by_source(tmp_path / f"_induced_{joint}.sto", "") for joint in names]
    assert_same(sources(robot.induced_accelerations(q, qd, tau), names), beside(each))
    found = loop.forward_dynamics(q, qd, tau)
    assert relative_error(found.qdd, beside(each)["total"]) <= LIMIT
    assert relative_error(found.forces[-3:], model.borne(state)) <= LIMIT
