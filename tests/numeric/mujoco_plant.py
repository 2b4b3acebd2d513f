"""Robots as MuJoCo moves them, torque-controlled and pushed from outside: nothing of linkwise is in them."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

STEP = 5e-4
"""s; MuJoCo's RK4 at it moves Panda as at a tenth of it, within 1e-9 of what it moves."""
PANDA_AT_WORK = np.array([0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.785])
"""A position with the hand before the arm and all joints far from their limits and from singular places."""
LINK = """<body name="link{number}" pos="{at} 0 0"><joint name="joint{number}" type="hinge" axis="0 0 1"/>
<inertial pos="0.125 0 0" mass="0.6" diaginertia="0.005 0.005 0.005"/>{inner}</body>"""

# What pushes: (time) -> torques (copies, joints), or wrenches (copies, 6) of the world's axes, moment first.
Push = Callable[[float], Any]
# (time, q, qd) -> torques (copies, joints)
Law = Callable[[float, Any, Any], Any]


def table_2_arm(links: int = 3) -> str:
    """The first links of the arm of the paper's Table 2 as MJCF."""
    inner = ""
    for number in range(links, 0, -1):
        inner = LINK.format(number=number, at=0.25 if number > 1 else 0.0, inner=inner)
    return f"""<mujoco><option gravity="0 -9.80665 0"/><compiler balanceinertia="false"/>
    <worldbody>{inner}</worldbody></mujoco>"""


def planar_model(links: int = 3) -> Any:
    """MuJoCo's model of these links."""
    return _free(mujoco.MjSpec.from_string(table_2_arm(links)).compile())


def panda_spec(urdf: Path) -> Any:
    """Return what MuJoCo's own compiler reads of Panda's URDF, its fingers held, with the shapes of its
    links."""
    text = re.sub('type="prismatic"', 'type="fixed"', urdf.read_text())
    # Bodies on fixed joints stay bodies, so that the hand can be pushed by its name.
    options = '<mujoco><compiler fusestatic="false" balanceinertia="false"/></mujoco>'
    spec = mujoco.MjSpec.from_string(text.replace("</robot>", f"{options}</robot>"))
    spec.meshdir = str(urdf.parents[1] / "meshes" / "collision")
    for mesh in spec.meshes:
        mesh.file = Path(mesh.file).name
    return spec


def panda_model(urdf: Path) -> Any:
    """MuJoCo's model of Panda without shapes, which only pictures need."""
    spec = panda_spec(urdf)
    for geom in list(spec.geoms):
        spec.delete(geom)
    return _free(spec.compile())


def _free(model: Any) -> Any:
    """The model without contacts and joint limits, which the equation of motion does not know."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = STEP
    return model


def heavier(model: Any, factors: Any) -> Any:
    """The model with each moving link's mass and inertia times its factor: the controller's is then wrong."""
    moving = np.flatnonzero(model.body_weldid)
    links = np.searchsorted(np.unique(model.body_weldid[moving]), model.body_weldid[moving])
    scale = np.asarray(factors, float)[links]
    model.body_mass[moving] *= scale
    model.body_inertia[moving] *= scale[:, None]
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


class MujocoPlant:
    """Copies of a robot side by side, each of its own model; states are arrays (copies, joints)."""

    def __init__(self, models: list[Any], pushed: str | None = None) -> None:
        """`pushed`: the body that wrenches act on, at its centre of mass; without mass, at its origin."""
        self.models, self.time, self.pushed = models, 0.0, pushed
        self.data = [mujoco.MjData(model) for model in models]

    def start(self, q: Any, qd: Any = 0.0) -> None:
        """Put every copy at a state, at time 0."""
        self.time = 0.0
        self._put(q, qd)

    @property
    def q(self) -> Any:
        return np.array([data.qpos for data in self.data])

    @property
    def qd(self) -> Any:
        return np.array([data.qvel for data in self.data])

    def hold(self, tau: Any, period: float, joints: Push | None = None, body: Push | None = None) -> None:
        """Hold torques (copies, joints) over a period, while pushes on the joints and on the body go on."""
        steps = max(1, round(period / STEP))
        for model in self.models:
            model.opt.timestep = period / steps
        for _ in range(steps):
            self._push(self.time + period / steps / 2, tau, joints, body)
            for model, data in zip(self.models, self.data, strict=True):
                mujoco.mj_step(model, data)
            self.time += period / steps

    def follow(self, law: Law, period: float, joints: Push | None = None, body: Push | None = None) -> None:
        """Torques that follow the motion at once, as of an ideal controller: RK4 over MuJoCo's qacc."""

        def rates(t: float, q: Any, qd: Any) -> tuple[Any, Any]:
            self._put(q, qd)
            self._push(t, law(t, q, qd), joints, body)
            for model, data in zip(self.models, self.data, strict=True):
                mujoco.mj_forward(model, data)
            return qd, np.array([data.qacc for data in self.data])

        q, qd, t, h = self.q, self.qd, self.time, period
        v1, a1 = rates(t, q, qd)
        v2, a2 = rates(t + h / 2, q + h / 2 * v1, qd + h / 2 * a1)
        v3, a3 = rates(t + h / 2, q + h / 2 * v2, qd + h / 2 * a2)
        v4, a4 = rates(t + h, q + h * v3, qd + h * a3)
        self._put(q + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4), qd + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4))
        self.time += period

    def _put(self, q: Any, qd: Any) -> None:
        shape = (len(self.models), self.models[0].nv)
        states = np.broadcast_to(q, shape), np.broadcast_to(qd, shape)
        for data, at, rate in zip(self.data, *states, strict=True):
            data.qpos[:], data.qvel[:] = at, rate

    def _push(self, t: float, tau: Any, joints: Push | None, body: Push | None) -> None:
        push = tau if joints is None else tau + joints(t)
        wrench = None if body is None else body(t)
        for copy, (model, data) in enumerate(zip(self.models, self.data, strict=True)):
            data.qfrc_applied[:] = push[copy]
            if wrench is not None:  # MuJoCo has the force first
                data.xfrc_applied[model.body(self.pushed).id] = np.roll(wrench[copy], 3)
