"""Muscles as causes, against OpenSim: moment arms, joint reactions, accelerations and power of forces."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import relative_error
from helpers.command_line import run_linkwise
from helpers.muscled_leg import COORDINATES, MUSCLES, RESERVE, built, forces, motion, reserves, write_sto
from linkwise import Load, Muscles, kept_package
from linkwise.analysis import Analysis, analyze
from linkwise.analysis.loads.muscles import grouped
from linkwise.errors import LinkwiseError

pytest.importorskip(
    "opensim", reason="needs opensim, which has wheels for Linux on x86-64: pip install opensim"
)
import opensim as osim

LIMIT, STEP = 1e-6, 1e-5


class Leg:
    """The leg in OpenSim, and its analysis with the forces of its muscles."""

    def __init__(self, folder: Path) -> None:
        osim.Logger.removeFileSink()
        osim.Logger.setLevelString("Off")
        self.folder, self.file = folder, folder / "leg.osim"
        built(osim, self.file)
        reserves(osim, folder / "reserves.xml")
        self.time, q = motion()
        self.tension = forces(self.time)
        write_sto(folder / "motion.sto", COORDINATES, self.time, q)
        write_sto(folder / "force.sto", MUSCLES, self.time, self.tension)
        self.result = self.analysed(
            self.muscles(), induced=["joints"], induced_power=True, reactions=["knee,world"]
        )

    def muscles(self, *groups: str, **more: Any) -> Muscles:
        return Muscles(self.folder / "force.sto", self.file, groups, **more)

    def analysed(self, muscles: Muscles | None, **asked: Any) -> Analysis:
        return analyze(self.folder / "motion.sto", kept_package(self.file), muscles=muscles, **asked)


class InOpenSim:
    """The leg in OpenSim in the states of an analysis, with muscles that pull as they are told."""

    def __init__(self, leg: Leg) -> None:
        self.model, self.leg = osim.Model(str(leg.file)), leg
        for name in COORDINATES:
            drive = osim.CoordinateActuator(name)
            drive.setName(f"drive_{name}")
            self.model.addForce(drive)
        self.state = self.model.initSystem()
        self.coordinates = [self.model.getCoordinateSet().get(name) for name in COORDINATES]
        self.muscles = [self.model.getMuscles().get(name) for name in MUSCLES]

    def at(self, s: int) -> None:
        """Bring it to sample s, with the muscles' forces."""
        result = self.leg.result
        self._move(result.q[s])
        for name, coordinate in zip(COORDINATES, self.coordinates, strict=True):
            coordinate.setSpeedValue(self.state, float(result.qd[s, result.robot.joints.index(name)]))
            self._set(f"drive_{name}", 0.0)
        for name, force in zip(MUSCLES, self.leg.tension[s], strict=True):
            self._set(name, float(force))
        self.model.realizeAcceleration(self.state)

    def drive(self, s: int) -> None:
        """Have coordinates give what OpenSim's muscles leave of the motion's torques at sample s."""
        whole = in_order(self.leg.result, self.leg.result.dense("tau_before_muscles"))[s]
        given = [[m.computeMomentArm(self.state, c) for m in self.muscles] for c in self.coordinates]
        for name, drive in zip(COORDINATES, whole - np.array(given) @ self.leg.tension[s], strict=True):
            self._set(f"drive_{name}", float(drive))
        self.model.realizeAcceleration(self.state)

    def _set(self, name: str, force: float) -> None:
        one = osim.ScalarActuator.safeDownCast(self.model.getForceSet().get(name))
        one.overrideActuation(self.state, True)
        one.setOverrideActuation(self.state, force)

    def _move(self, q: np.ndarray) -> None:
        joints = self.leg.result.robot.joints
        for name, coordinate in zip(COORDINATES, self.coordinates, strict=True):
            coordinate.setValue(self.state, float(q[joints.index(name)]), False)
        self.model.realizePosition(self.state)

    def shortening(self, s: int, towards: np.ndarray) -> np.ndarray:
        """Rates (muscles,) at which lengths shrink as q of sample s goes in a direction."""
        ends = []
        for step in (STEP, -STEP):
            self._move(self.leg.result.q[s] + step * towards)
            ends.append(np.array([muscle.getLength(self.state) for muscle in self.muscles]))
        return (ends[1] - ends[0]) / (2 * STEP)

    def torques(self, s: int) -> np.ndarray:
        """Torque (coordinates, muscles) of each force: by virtual work, force times shortening by q."""
        joints = self.leg.result.robot.joints
        ways = [np.eye(len(joints))[joints.index(name)] for name in COORDINATES]
        return np.array([self.shortening(s, way) for way in ways]) * self.leg.tension[s]


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Leg:
    return Leg(tmp_path_factory.mktemp("muscles"))


def in_order(result: Analysis, values: np.ndarray) -> np.ndarray:
    """Values (S, n, ...) of joints in the order of OpenSim's coordinates."""
    return values[:, [result.robot.joints.index(name) for name in COORDINATES]]


def test_a_muscle_gives_its_force_times_its_moment_arm(leg: Leg) -> None:
    there, arms, work, wrapped, points = InOpenSim(leg), [], [], [], []
    for s in range(len(leg.time)):
        there.at(s)
        arms.append([[m.computeMomentArm(there.state, c) for m in there.muscles] for c in there.coordinates])
        sizes = [muscle.getGeometryPath().getCurrentPath(there.state).getSize() for muscle in there.muscles]
        wrapped.append(sizes[1] == 4)
        points.append(sizes[3])
        work.append(there.torques(s))
    assert all(wrapped), "two points more, where it touches the cylinder"
    assert {*points} == {2, 3}, "with the conditional point, and without"
    ours = -in_order(leg.result, leg.result.load_torque)
    assert leg.result.rows.axes["load"].names == MUSCLES
    assert relative_error(ours, np.array(work)) <= LIMIT
    # OpenSim 4.6 has of a point that moves in the midst of a path one side's pull alone.
    alike = [at for at, name in enumerate(MUSCLES) if name != "moving"]
    given = np.array(arms) * leg.tension[:, None]
    assert relative_error(ours[..., alike], given[..., alike]) <= LIMIT


def test_joint_torques_are_what_muscles_leave_of_inverse_dynamics(leg: Leg) -> None:
    bare, result = leg.analysed(None), leg.result
    whole = in_order(result, result.dense("tau_before_muscles"))
    assert relative_error(whole, in_order(bare, bare.torque)) <= 1e-12
    there = InOpenSim(leg)
    given = [there.torques(s).sum(axis=1) for s in range(len(leg.time))]
    assert relative_error(in_order(result, result.torque), whole - np.array(given)) <= LIMIT
    told = {one["joint"]: one for one in result.record()["left_by_muscles"]}
    knee = result.torque[:, result.robot.joints.index("knee")]
    assert told["knee"]["rms"] == pytest.approx(np.sqrt(np.mean(knee**2)))
    assert told["knee"]["peak"] == pytest.approx(np.abs(knee).max())


def test_the_knee_bears_what_opensims_joint_reaction_says(leg: Leg) -> None:
    there = InOpenSim(leg)
    knee, found = there.model.getJointSet().get("knee_joint"), []
    for s in range(len(leg.time)):
        there.at(s)
        there.drive(s)
        spatial = knee.calcReactionOnChildExpressedInGround(there.state)
        found.append([*spatial.get(0).to_numpy(), *spatial.get(1).to_numpy()])
    assert relative_error(leg.result.dense("reaction")[:, 0], np.array(found)) <= LIMIT


def test_each_muscle_accelerates_joints_and_gives_power_as_in_opensim(leg: Leg) -> None:
    there, accelerated, power, result = InOpenSim(leg), [], [], leg.result
    matter = there.model.getMatterSubsystem()
    for s in range(len(leg.time)):
        torques = there.torques(s)
        power.append(leg.tension[s] * there.shortening(s, result.qd[s]))
        there.at(s)
        each = []
        for torque in torques.T:
            moved = osim.Vector()
            matter.multiplyByMInv(there.state, osim.Vector.createFromMat(torque.copy()), moved)
            each.append(moved.to_numpy())
        accelerated.append(np.array(each).T)
    ours = in_order(result, result.dense("acc_load")[:, 0])
    assert relative_error(ours, np.array(accelerated)) <= LIMIT
    assert relative_error(result.dense("gain_load").sum(axis=1), np.array(power)) <= LIMIT
    assert result.closure.induced_relative is not None
    assert result.closure.induced_relative <= 1e-12
    assert result.closure.power_relative is not None
    assert result.closure.power_relative <= 1e-12


def test_muscles_of_a_group_are_one_load(leg: Leg) -> None:
    both = leg.analysed(leg.muscles("front=wrap*, moving", "rest=straight"))
    assert both.rows.axes["load"].names == ("front", "rest", "conditional")
    alone = leg.result.load_torque
    assert relative_error(both.load_torque[..., 0], alone[..., 1] + alone[..., 2]) <= 1e-12
    of_model = leg.analysed(leg.muscles("thigh muscles"))
    assert relative_error(of_model.load_torque[..., 0], both.load_torque[..., 0]) <= 1e-12


def test_a_reserve_of_another_file_is_a_generalized_force(leg: Leg) -> None:
    values = forces(leg.time, (*MUSCLES, RESERVE))
    write_sto(leg.folder / "more.sto", (*MUSCLES, RESERVE), leg.time, values)
    with_file = Muscles(leg.folder / "more.sto", leg.file, force_sets=(leg.folder / "reserves.xml",))
    result = leg.analysed(with_file, reactions=["knee,world"], induced_power=True)
    knee, number = result.robot.joints.index("knee"), result.rows.axes["load"].names.index(RESERVE)
    assert np.allclose(result.load_torque[:, knee, number], -values[:, -1], rtol=1e-12)
    assert np.abs(np.delete(result.load_torque[..., number], knee, axis=1)).max() == 0.0
    assert not result.dense("reaction_load")[..., number].any(), "no body is pulled at"
    assert result.load_labels[number] == f"actuator {RESERVE}"
    assert result.closure.power_relative is not None
    assert result.closure.power_relative <= 1e-12
    without = leg.analysed(Muscles(leg.folder / "more.sto", leg.file), induced_power=True)
    given, alone = (one["flow/knee"] - one["flow_before/knee"] for one in (result, without))
    assert relative_error(given, alone) <= 1e-12, "what the reserve does not give, the joint gives"
    assert any(RESERVE in warning and "left out" in warning for warning in without.load_warnings)


def test_a_muscle_and_a_reserve_of_one_group_give_what_both_give(leg: Leg) -> None:
    values = forces(leg.time, (*MUSCLES, RESERVE))
    write_sto(leg.folder / "both.sto", (*MUSCLES, RESERVE), leg.time, values)
    given = leg.folder / "both.sto", leg.file
    apart = leg.analysed(Muscles(*given, force_sets=(leg.folder / "reserves.xml",)))
    groups = (f"one=moving, {RESERVE}",)
    both = leg.analysed(Muscles(*given, groups=groups, force_sets=(leg.folder / "reserves.xml",)))
    names, (one, *_) = apart.rows.axes["load"].names, both.rows.axes["load"].names
    assert one == "one"
    torque = sum(apart.load_torque[..., names.index(name)] for name in ("moving", RESERVE))
    assert relative_error(both.load_torque[..., 0], torque) <= 1e-12


def test_moment_arms_by_functions_give_torques(tmp_path: Path) -> None:
    model, zero = osim.Model(), osim.Vec3(0)
    arm = osim.Body("arm", 1.0, osim.Vec3(0, -0.2, 0), osim.Inertia(0.02, 0.005, 0.02))
    pin = osim.PinJoint("pin", model.getGround(), zero, zero, arm, zero, zero)
    pin.updCoordinate().setName("elbow")
    model.addBody(arm)
    model.addJoint(pin)
    path = osim.FunctionBasedPath()
    path.setLengthFunction(osim.PolynomialFunction(osim.Vector.createFromMat(np.array([0.1, -0.05, 0.3]))))
    path.append_coordinate_paths("/jointset/pin/elbow")
    muscle = osim.PathActuator()
    muscle.setName("biceps")
    muscle.set_path(path)
    model.addForce(muscle)
    model.finalizeConnections()
    model.printToXML(str(tmp_path / "arm.osim"))
    time = np.arange(40) / 100
    angle, pull = 0.5 * np.sin(5 * time), 100 + 20 * np.cos(3 * time)
    write_sto(tmp_path / "motion.sto", ("elbow",), time, angle[:, None])
    write_sto(tmp_path / "force.sto", ("biceps",), time, pull[:, None])
    muscles = Muscles(tmp_path / "force.sto", tmp_path / "arm.osim")
    result = analyze(tmp_path / "motion.sto", kept_package(tmp_path / "arm.osim"), muscles=muscles)
    shortening = -(0.2 * angle - 0.05)
    assert relative_error(result.load_torque[:, 0, 0], -pull * shortening) <= 1e-12
    assert any("functions give the moment arms of biceps" in warning for warning in result.load_warnings)


def test_reserves_of_ball_and_free_joints_give_the_power_of_opensims_speeds(tmp_path: Path) -> None:
    """Speeds of these joints are angular velocities, which are not the rates of the coordinates."""
    model, zero = osim.Model(), osim.Vec3(0)
    bodies = [osim.Body(n, 2.0, osim.Vec3(0.1, 0, 0), osim.Inertia(0.2, 0.2, 0.3)) for n in ("box", "top")]
    free = osim.FreeJoint("free", model.getGround(), zero, zero, bodies[0], zero, zero)
    ball = osim.BallJoint("ball", bodies[0], osim.Vec3(0, 0.3, 0), zero, bodies[1], zero, zero)
    for body, joint in zip(bodies, (free, ball), strict=True):
        model.addBody(body)
        model.addJoint(joint)
    model.finalizeConnections()
    there = model.getCoordinateSet()
    names = tuple(there.get(at).getName() for at in range(there.getSize()))
    for name in names:
        reserve = osim.CoordinateActuator(name)
        reserve.setName(f"reserve_{name}")
        model.addForce(reserve)
    model.finalizeConnections()
    model.printToXML(str(tmp_path / "box.osim"))
    time = np.arange(60) / 100
    q = 0.4 + 0.4 * np.sin(3 * time[:, None] + np.arange(9))
    given = 5 + np.arange(9) + np.cos(2 * time[:, None] + np.arange(9))
    write_sto(tmp_path / "motion.sto", names, time, q)
    write_sto(tmp_path / "force.sto", tuple(f"reserve_{name}" for name in names), time, given)
    muscles = Muscles(tmp_path / "force.sto", tmp_path / "box.osim")
    result = analyze(tmp_path / "motion.sto", kept_package(tmp_path / "box.osim"), muscles=muscles)
    rates = result.qd[:, [result.robot.joints.index(name) for name in names]]
    ours = -(result.load_torque.sum(axis=2) * result.qd).sum(axis=1)
    state, wanted = model.initSystem(), []
    for s in range(len(time)):
        ends = []
        for step in (-STEP, STEP):
            for at, name in enumerate(names):
                there.get(name).setValue(state, float(q[s, at] + step * rates[s, at]), False)
            model.realizePosition(state)
            ends.append([_turn(joint, state) for joint in (free, ball)])
        turning = [_rate(before, after) for before, after in zip(*ends, strict=True)]
        wanted.append(given[s] @ [*turning[0], *rates[s, 3:6], *turning[1]])
    assert relative_error(ours, np.array(wanted)) <= LIMIT


def _turn(joint: Any, state: Any) -> np.ndarray:
    """Rotation (3, 3) of a joint's child in its parent."""
    whole = joint.getChildFrame().findTransformBetween(state, joint.getParentFrame())
    turn = whole.R()  # refers to `whole`, which therefore has a name
    entries = turn.asMat33()
    return np.array([[entries.get(row, column) for column in range(3)] for row in range(3)])


def _rate(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Angular velocity (3,), in the parent's axes, of rotations 2 STEP apart."""
    spin = (after - before) @ ((after + before) / 2).T / (2 * STEP)
    return np.array([spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]) / 2


@pytest.mark.parametrize(
    ("groups", "said"),
    [
        (("front",), "write it as NAME=MUSCLE"),
        (("front=biceps",), "no actuator is named 'biceps'"),
        (("front=a,bicepps*",), r"no actuator is named 'bicepps\*'"),
        (("b=a",), "an actuator that is in no group has that name"),
        (("front=a", "back=*"), "'a' is in 'front' already"),
        (("front=a", "front=b"), "another group has that name"),
    ],
)
def test_groups_that_are_not_clear_are_refused(groups: tuple[str, ...], said: str) -> None:
    with pytest.raises(LinkwiseError, match=said):
        grouped(groups, ("a", "b"), {"legs": ("a",)})


def test_a_muscle_that_the_model_does_not_apply_is_told(leg: Leg, tmp_path: Path) -> None:
    model = osim.Model(str(leg.file))
    model.updForceSet().get("straight").set_appliesForce(False)
    model.finalizeConnections()
    model.printToXML(str(tmp_path / "off.osim"))
    package = kept_package(tmp_path / "off.osim")
    for force, said in ((leg.folder / "force.sto", True), (tmp_path / "others.sto", False)):
        write_sto(tmp_path / "others.sto", MUSCLES[1:], leg.time, leg.tension[:, 1:])
        muscles = Muscles(force, tmp_path / "off.osim")
        told = analyze(leg.folder / "motion.sto", package, muscles=muscles).load_warnings
        assert any("does not apply straight" in warning for warning in told) == said
        assert not any("no column for" in warning for warning in told)
    shown = run_linkwise("inspect", tmp_path / "off.osim", "--details", folder=tmp_path)
    assert "a Thelen2003Muscle that the model does not apply" in shown.stdout


def test_a_load_that_is_called_as_a_muscle_is_refused(leg: Leg) -> None:
    named = Load("straight", "shank", force=(0.0, 9.0, 0.0))
    with pytest.raises(LinkwiseError, match="muscle 'straight': another has that name; rename one of them"):
        leg.analysed(leg.muscles(), loads=[named])


def test_files_that_do_not_fit_are_refused_in_a_line(leg: Leg, tmp_path: Path) -> None:
    with pytest.raises(LinkwiseError, match=r"give its \.osim file as --robot"):
        Muscles(leg.folder / "force.sto", tmp_path)
    write_sto(tmp_path / "late.sto", MUSCLES, leg.time + 0.5, leg.tension)
    with pytest.raises(LinkwiseError, match=r"late\.sto: row .* begins at 0\.5 s"):
        leg.analysed(Muscles(tmp_path / "late.sto", leg.file))
    write_sto(tmp_path / "other.sto", ("biceps",), leg.time, leg.tension[:, :1])
    twice = ("straight", "/forceset/straight")
    write_sto(tmp_path / "twice.sto", twice, leg.time, leg.tension[:, :2])
    with pytest.raises(LinkwiseError, match="'straight' and '/forceset/straight' are both 'straight'"):
        leg.analysed(Muscles(tmp_path / "twice.sto", leg.file))
    with pytest.raises(LinkwiseError, match="no column is an actuator of the model"):
        leg.analysed(Muscles(tmp_path / "other.sto", leg.file))
    write_sto(tmp_path / "whole.sto", MUSCLES, leg.time, leg.tension)
    (tmp_path / "longer.osim").write_text(leg.file.read_text().replace("0 -0.41999", "0 -0.51999"))
    told = r"body 'shank' is up to 0\.1 m from where .*longer\.osim has it; the motion or the robot does not"
    with pytest.raises(LinkwiseError, match=told):
        leg.analysed(Muscles(tmp_path / "whole.sto", tmp_path / "longer.osim"))


def test_the_command_tells_what_muscles_leave(leg: Leg, tmp_path: Path) -> None:
    given = ["analyze", leg.folder / "motion.sto", "--robot", leg.file, "--out", tmp_path / "out"]
    given += ["--muscles", leg.folder / "force.sto", "--muscle-group", "thigh muscles", "--no-page"]
    told = run_linkwise(*given, folder=tmp_path)
    assert "muscles leave of joint torques" in told.stdout
    refused = run_linkwise(*given, "--uncertain", leg.folder / "motion.sto", folder=tmp_path)
    assert refused.returncode == 2
    assert "leave it or --muscles out" in refused.stderr
