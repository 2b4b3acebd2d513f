"""Pinocchio's own reading of a URDF file, asked in linkwise's coordinates."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from linkwise.robot.readers.urdf.reader import read_urdf

BASE = {
    "base_x": pin.JointModelPX,
    "base_y": pin.JointModelPY,
    "base_z": pin.JointModelPZ,
    "base_yaw": pin.JointModelRZ,
    "base_pitch": pin.JointModelRY,
    "base_roll": pin.JointModelRX,
}
"""A floating base's coordinates: where it is in the world, then its turns about the moved z, y and x."""


class Map(NamedTuple):
    """Motion of one degree of freedom of Pinocchio's: ratio · q[coordinate] + offset; None stands still."""

    at: int
    velocity_at: int
    circle: bool
    coordinate: int | None
    ratio: float = 1.0
    offset: float = 0.0


def on_floating_base(model: Any) -> Any:
    """The model on six joints of one axis: Pinocchio's Coriolis matrix is not right for a composite one."""
    base, joint = pin.Model(), 0
    for name, part in BASE.items():
        joint = base.addJoint(joint, part(), pin.SE3.Identity(), name)
    frame = base.addFrame(pin.Frame("moved", joint, 0, pin.SE3.Identity(), pin.OP_FRAME))
    return pin.appendModel(base, model, frame, pin.SE3.Identity())


class PinocchioModel:
    """Inverse dynamics of a whole robot or of one link's mass alone.

    Joints are matched by name. Mimic joints are undone here: Pinocchio moves them as joints of their own,
    and their torque goes to the master times the ratio; one without a master moves by itself.
    Links are matched by the frame that bears their name.
    """

    def __init__(
        self, path: Path, system: Any, floating: bool = False, lock: dict[str, float] | None = None
    ) -> None:
        model = pin.buildModelFromUrdf(str(path))
        self.model = on_floating_base(model) if floating else model
        self.data = self.model.createData()
        self.model.gravity.linear = np.array(system.robot.gravity, dtype=float)
        self.n = len(system.coordinates)
        self.maps = self._maps(path, system, lock or {})
        self.alone = {link.name: self._alone(link.name, lock or {}) for link in system.links}

    def _maps(self, path: Path, system: Any, lock: dict[str, float]) -> list[Map]:
        mimics = {c.name: c.mimic for c in read_urdf(path).connections if c.mimic}
        index = {c.name: k for k, c in enumerate(system.coordinates)}
        maps = []
        for number in range(1, self.model.njoints):
            name, joint = self.model.names[number], self.model.joints[number]
            mimic = mimics.get(name)
            where = joint.idx_q, joint.idx_v, joint.nq == 2
            if name in lock:
                maps.append(Map(*where, None, offset=lock[name]))
            elif mimic and mimic.master in index:
                maps.append(Map(*where, index[mimic.master], mimic.ratio, mimic.offset))
            else:
                maps.append(Map(*where, index[name]))
        return maps

    def _alone(self, link: str, lock: dict[str, float]) -> Any:
        """The model with only the mass that moves with `link`, what hangs on it by locked joints included."""
        alone = self.model.copy()
        still = {self.model.getJointId(name) for name in lock}
        moves_with = list(range(alone.njoints))
        for joint in sorted(still):
            moves_with[joint] = moves_with[alone.parents[joint]]
        own = moves_with[self.model.frames[self.model.getFrameId(link, pin.BODY)].parentJoint]
        for joint in range(alone.njoints):
            if moves_with[joint] != own:
                alone.inertias[joint] = pin.Inertia.Zero()
        return alone

    def torque(self, q: Any, qd: Any, qdd: Any, link: str | None = None) -> Any:
        """τ of all links, or τ_ij of one."""
        model = self.model if link is None else self.alone[link]
        full = pin.rnea(model, self.data, *self._state(q, qd, qdd))
        return self.tie.T @ full

    def regressor(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Y of all joints' bodies (n, joints, 10), in the frames of Pinocchio's joints."""
        full = pin.computeJointTorqueRegressor(self.model, self.data, *self._state(q, qd, qdd))
        rows = self.tie.T @ full
        return rows.reshape(self.n, -1, 10)

    def mass(self, q: Any) -> Any:
        """M (n, n)."""
        full = np.triu(pin.crba(self.model, self.data, self._state(q, 0 * q, 0 * q)[0]))
        return self.tie.T @ (full + np.triu(full, 1).T) @ self.tie

    def coriolis(self, q: Any, qd: Any) -> Any:
        """C (n, n)."""
        state = self._state(q, qd, 0 * qd)[:2]
        return self.tie.T @ pin.computeCoriolisMatrix(self.model, self.data, *state) @ self.tie

    def gravity(self, q: Any) -> Any:
        """g (n,)."""
        state = self._state(q, 0 * q, 0 * q)[0]
        return self.tie.T @ pin.computeGeneralizedGravity(self.model, self.data, state)

    def acceleration(self, q: Any, qd: Any, tau: Any) -> Any:
        """qdd (n,) by the articulated-body algorithm, or where joints follow others, from M."""
        if self.model.nv > self.n:
            return np.linalg.solve(self.mass(q), tau - self.torque(q, qd, 0 * qd))
        back = np.linalg.inv(self.tie)
        return back @ pin.aba(self.model, self.data, *self._state(q, qd, qd)[:2], back.T @ tau)

    def energies(self, q: Any, qd: Any, link: str) -> tuple[float, float]:
        """Kinetic and potential energy of one link in J."""
        at, speed, _ = self._state(q, qd, qd)
        model = self.alone[link]
        kinetic = pin.computeKineticEnergy(model, self.data, at, speed)
        return kinetic, pin.computePotentialEnergy(model, self.data, at)

    @property
    def tie(self) -> Any:
        """Velocities of Pinocchio's joints for those of the coordinates (nv, n)."""
        tie = np.zeros((self.model.nv, self.n))
        for _, v, _, k, ratio, _ in self.maps:
            if k is not None:
                tie[v, k] += ratio
        return tie

    def _state(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, Any, Any]:
        state = np.zeros(self.model.nq)
        for at, _, circle, k, ratio, offset in self.maps:
            angle = offset if k is None else ratio * q[k] + offset
            if circle:
                state[at : at + 2] = np.cos(angle), np.sin(angle)
            else:
                state[at] = angle
        return state, self.tie @ qd, self.tie @ qdd
