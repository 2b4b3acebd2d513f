"""Frames of real robots against Pinocchio, and of an MJCF file against MuJoCo."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

import pinocchio as pin
from tools.corpus import ROBOTS

from numeric.pinocchio_model import BASE, PinocchioModel

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

LARGEST_ERROR = 1e-11
OPTIONS: dict[str, dict[str, Any]] = {
    "kinova": {},
    "panda": {},
    "solo12": {"base": "floating"},
    "allegro_left_hand": {"allow_unphysical": True},
    "human": {"base": "floating"},
    "simple_humanoid_classical": {},
    "romeo": {"allow_unphysical": True},
    "ur5_robot": {"lock": {"elbow_joint": 0.7}},
    "talos_reduced": {"base": "floating"},
    "tiago": {"allow_unphysical": True},
}
WORLD = pin.LOCAL_WORLD_ALIGNED


class WithFrames(PinocchioModel):
    """A floating base is a chain of six joints: Pinocchio has no rate of the Jacobian of composite joints."""

    def __init__(self, path: Path, system: Any, options: dict[str, Any]) -> None:
        floating = options.get("base") == "floating"
        super().__init__(path, system, floating, options.get("lock"))
        if floating:
            base, joint = pin.Model(), 0
            for name, part in BASE.items():
                joint = base.addJoint(joint, part(), pin.SE3.Identity(), name)
                base.addJointFrame(joint)
            own = pin.buildModelFromUrdf(str(path))
            self.model = pin.appendModel(base, own, base.getFrameId(name), pin.SE3.Identity())
            self.data = self.model.createData()
            self.maps = self._maps(path, system, options.get("lock") or {})

    def at(self, q: Any, qd: Any, qdd: Any) -> Any:
        """The data of a state."""
        state = self._state(q, qd, qdd)
        pin.computeJointJacobiansTimeVariation(self.model, self.data, *state[:2])
        pin.forwardKinematics(self.model, self.data, *state)
        pin.updateFramePlacements(self.model, self.data)
        pin.jacobianCenterOfMass(self.model, self.data, state[0])
        return self.data

    def frame(self, name: str) -> dict[str, Any]:
        """Return what Pinocchio says of a body's frame, with the rows of rotation first."""
        model, data, at = self.model, self.data, self.model.getFrameId(name, pin.BODY)
        swap = np.r_[3:6, :3]
        return {
            "pose": data.oMf[at].homogeneous,
            "jacobian": pin.getFrameJacobian(model, data, at, WORLD)[swap] @ self.tie,
            "rate": pin.getFrameJacobianTimeVariation(model, data, at, WORLD)[swap] @ self.tie,
            "velocity": pin.getFrameVelocity(model, data, at, WORLD).vector[swap],
            "acceleration": pin.getFrameClassicalAcceleration(model, data, at, WORLD).vector[swap],
        }

    def torque_under_load(self, motion: Any, name: str, point: Any, moment: Any, force: Any) -> Any:
        """Inverse dynamics with a wrench, in the world's axes, on a point of a body's frame."""
        frame = self.model.frames[self.model.getFrameId(name, pin.BODY)]
        state = self._state(*motion)
        pin.forwardKinematics(self.model, self.data, state[0])
        carrier = self.data.oMi[frame.parentJoint]
        at = carrier.act(frame.placement.act(point))
        loads = pin.StdVec_Force()
        loads.extend([pin.Force.Zero()] * self.model.njoints)
        if frame.parentJoint:
            wrench = pin.Force(force, moment + np.cross(at, force))
            loads[frame.parentJoint] = carrier.actInv(wrench)
        return self.tie.T @ pin.rnea(self.model, self.data, *state, loads)


@pytest.mark.parametrize("robot", OPTIONS)
def test_frames_and_their_jacobians_are_pinocchios(robot: str, tmp_path: Path) -> None:
    path = next(ROBOTS.rglob(f"{robot}.urdf"))
    system = read_system(path, Options(**OPTIONS[robot]))
    write_package(generate(system, ["numpy"], "robot", kernel="loops"), tmp_path / "robot")
    dynamics = import_package(tmp_path / "robot").load("numpy")
    kinematics, oracle = dynamics.kinematics, WithFrames(path, system, OPTIONS[robot])
    motion = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 3, dynamics.n))
    bodies = [name for name in kinematics.frames if oracle.model.existFrame(name, pin.BODY)]
    files = {frame.name for frame in oracle.model.frames if frame.type == pin.BODY} - {"universe"}
    assert files == set(bodies), "every body of the file is a frame"
    errors: dict[str, float] = {}

    def held(what: str, given: Any, expected: Any) -> None:
        error = float(np.abs(given - expected).max() / max(1.0, np.abs(expected).max()))
        errors[what] = max(errors.get(what, 0.0), error)

    for q, qd, qdd in motion:
        data = oracle.at(q, qd, qdd)
        for name in bodies:
            expected = oracle.frame(name)
            held("pose", kinematics.pose(q, name), expected["pose"])
            held("jacobian", kinematics.jacobian(q, name), expected["jacobian"])
            held("rate", kinematics.jacobian_rate(q, qd, name), expected["rate"])
            held("velocity", kinematics.velocity(q, qd, name), expected["velocity"])
            held("acceleration", kinematics.acceleration(q, qd, qdd, name), expected["acceleration"])
        for name in bodies:
            wrench = np.random.default_rng(1).uniform(-9.0, 9.0, (3, 3))
            expected = oracle.torque_under_load((q, qd, qdd), name, *wrench)
            point, moment, force = wrench
            added = kinematics.load_torque(q, name, force, moment, point)
            held("torque under a load", dynamics.inverse_dynamics(q, qd, qdd) + added, expected)
        held("centre of mass", kinematics.centre_of_mass(q), data.com[0])
        held("its Jacobian", kinematics.centre_of_mass_jacobian(q), data.Jcom @ oracle.tie)
        pin.centerOfMass(oracle.model, data, *oracle._state(q, qd, qdd))
        acceleration = kinematics.centre_of_mass_jacobian(q) @ qdd
        acceleration += kinematics.centre_of_mass_jacobian_rate(q, qd) @ qd
        held("its acceleration", acceleration, data.acom[0])
    poses = kinematics.poses(motion[:, 0])
    for f, name in enumerate(kinematics.frames):
        held("all poses", poses[:, f], kinematics.pose(motion[:, 0], name))
    assert max(errors.values()) <= LARGEST_ERROR, errors


def test_bodies_and_sites_are_where_mujoco_has_them(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "arm.xml"
    path.write_text(
        """<mujoco model="arm"><compiler angle="radian"/><worldbody><site name="floor" pos="1 2 3"/>
        <body name="mast" pos="0.1 0 0.5" euler="0.3 0.2 0.1"><joint name="lift" type="slide" axis="1 0.5 0"/>
        <joint name="swing" axis="0 1 1" pos="0.1 0.2 0.3" ref="-0.4"/><geom size="0.1" mass="1"/>
        <body name="plate" pos="0 0 0.7" quat="0.9 0.1 0.3 0.2"><geom size="0.1" mass="0.5"/>
        <site name="grip" pos="0.1 0 0.2" euler="1 0 0.5"/>
        <body name="hook" pos="0.2 0 0"><joint name="neck" pos="0 0.1 0"/><geom size="0.1" mass="0.5"/>
        </body></body></body></worldbody></mujoco>"""
    )
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    write_package(generate(read_system(path), ["numpy"]), tmp_path / "arm")
    kinematics = import_package(tmp_path / "arm").load("numpy").kinematics
    assert set(kinematics.frames) >= {"world", "mast", "plate", "hook", "floor", "grip"}
    q = np.array([0.4, -0.7, 1.1])
    data.qpos = q
    mujoco.mj_kinematics(model, data)
    for name in ("mast", "plate", "hook", "world"):
        expected = data.body(name)
        pose = kinematics.pose(q, name)
        np.testing.assert_allclose(pose[:3, 3], expected.xpos, rtol=0, atol=1e-14)
        np.testing.assert_allclose(pose[:3, :3].ravel(), expected.xmat, rtol=0, atol=1e-14)
    for name in ("floor", "grip"):
        pose = kinematics.pose(q, name)
        np.testing.assert_allclose(pose[:3, 3], data.site(name).xpos, rtol=0, atol=1e-14)
        np.testing.assert_allclose(pose[:3, :3].ravel(), data.site(name).xmat, rtol=0, atol=1e-14)
