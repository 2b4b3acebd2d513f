"""Content of a compiled MJCF model beyond the dynamics of rigid bodies and what `forces` reads.

`ACTING` has one row for everything in MuJoCo's mjModel that exerts a force or adds inertia. A robot's torques
are those that its actuators must give while it touches nothing and stays within its limits.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from linkwise.robot.notes import Note, Omission
from linkwise.robot.readers.mjcf.equalities import bodies_along, joints_of
from linkwise.robot.readers.mjcf.forces import (
    ARMATURE,
    DAMPING,
    FRICTION,
    SPRING,
    is_passive,
    numbers_of,
    switched_off,
    switched_on,
)

COUNTS = {
    "actuator": "nu",
    "camera": "ncam",
    "contact pair": "npair",
    "keyframe": "nkey",
    "light": "nlight",
    "mocap": "nmocap",
    "sensor": "nsensor",
    "tendon": "ntendon",
}
"""Things that are counted though they load no joint by themselves."""

ARRAYS = {"limit": "jnt_limited"}
"""Things that are counted where the array is not zero."""

Owner = Literal["dof", "joint", "body", "tendon", "actuator", "model"]


@dataclass(frozen=True)
class _Acting:
    """A force or an inertia: `what` it is, its owner, and the arrays that are not zero where it acts.

    `switch` is the word of `forces` that turns it off; `units` are those about a hinge and along a
    slide.
    """

    what: str
    owner: Owner
    fields: tuple[str, ...]
    switch: str = ""
    units: tuple[str, str] = ("", "")


ACTING = (
    _Acting("damping", "dof", DAMPING, "damping", ("N·m·s/rad", "N·s/m")),
    _Acting("friction", "dof", FRICTION, "friction", ("N·m", "N")),
    _Acting("armature", "dof", ARMATURE, "", ("kg·m²", "kg")),
    _Acting("spring", "joint", SPRING, "spring", ("N·m/rad", "N/m")),
    _Acting(
        "gravity compensation", "body", ("body_gravcomp",), "gravity compensation", ("of its weight",) * 2
    ),
    _Acting("tendon spring", "tendon", ("tendon_stiffness", "tendon_stiffnesspoly"), "spring"),
    _Acting("tendon damping", "tendon", ("tendon_damping", "tendon_dampingpoly"), "damping"),
    _Acting("tendon friction", "tendon", ("tendon_frictionloss",), "friction"),
    _Acting("tendon armature", "tendon", ("tendon_armature",)),
    _Acting("armature", "actuator", ("actuator_armature",)),
    _Acting("damping", "actuator", ("actuator_damping", "actuator_dampingpoly"), "damping"),
    _Acting("fluid", "model", ("density", "viscosity"), "fluid"),
    _Acting("flex spring", "model", ("flex_edgestiffness", "flex_stiffness", "flex_bending"), "spring"),
    _Acting("flex damping", "model", ("flex_edgedamping", "flex_damping"), "damping"),
    _Acting("plugin", "model", ("nplugin",), "plugin"),
)


@dataclass(frozen=True)
class _CompiledModel:
    """A compiled model, and the names of its joints and bodies as the description has them."""

    mujoco: Any
    model: Any
    joints: Sequence[str]
    bodies: Sequence[str]

    def along(self, tendon: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the joints of a fixed tendon, and the bodies that a spatial one passes."""
        joints = joints_of(self.mujoco, self.model, tendon)
        bodies = bodies_along(self.mujoco, self.model, tendon)
        return tuple(self.joints[j] for j in joints), tuple(self.bodies[b] for b in bodies)

    def values(self, acting: _Acting, index: int) -> list[float]:
        """Return the numbers of one joint, body or tendon."""
        return numbers_of(self.model, acting.fields, index)


def omissions(mujoco: Any, model: Any, joints: Sequence[str], bodies: Sequence[str]) -> tuple[Omission, ...]:
    """Return the forces and inertias that the torques leave out, by names of MuJoCo's joints and bodies."""
    names, off = _CompiledModel(mujoco, model, joints, bodies), switched_off(mujoco, model)
    acting = [row for row in ACTING if row.switch not in off]
    found = [omission for row in acting for omission in _OWNERS[row.owner](names, row)]
    return (*found, *(Omission(what, "by a flag of <option>") for what in switched_on(mujoco, model)))


def unused(model: Any) -> tuple[Note, ...]:
    """Return a note, with a count, for each kind of thing that is there and loads no joint by itself."""
    counts = {what: int(np.count_nonzero(getattr(model, field))) for what, field in ARRAYS.items()}
    counts |= {what: int(getattr(model, field)) for what, field in COUNTS.items()}
    return tuple(Note("ignored", what, f"{count} ×") for what, count in sorted(counts.items()) if count)


def _of_joints(names: _CompiledModel, acting: _Acting) -> Iterator[Omission]:
    """Yield what `Passive` cannot hold: on balls and free joints, or of a higher order."""
    for number, name in enumerate(names.joints):
        if is_passive(names.mujoco, names.model, number, acting.fields):
            continue
        index = int(names.model.jnt_dofadr[number]) if acting.owner == "dof" else number
        if any(values := names.values(acting, index)):
            slides = names.model.jnt_type[number] == names.mujoco.mjtJoint.mjJNT_SLIDE
            yield Omission(acting.what, name, _detail(values, acting.units[slides]), joints=(name,))


def _of_bodies(names: _CompiledModel, acting: _Acting) -> Iterator[Omission]:
    """Yield gravity compensation, except on joints whose actuators give it: their torques contain it."""
    model = names.model
    for number, name in enumerate(names.bodies):
        at, joints = number, list[str]()
        while at:
            first = int(model.body_jntadr[at])
            own = range(first, first + int(model.body_jntnum[at]))
            joints += [names.joints[joint] for joint in own if not model.jnt_actgravcomp[joint]]
            at = int(model.body_parentid[at])
        if joints and any(model.opt.gravity) and any(values := names.values(acting, number)):
            yield Omission(acting.what, name, _detail(values, acting.units[0]), tuple(joints), needs=(name,))


def _of_tendons(names: _CompiledModel, acting: _Acting) -> Iterator[Omission]:
    for number in range(int(names.model.ntendon)):
        if any(values := names.values(acting, number)):
            name = names.model.tendon(number).name or f"tendon{number}"
            yield Omission(acting.what, name, _detail(values, ""), *names.along(number))


def _of_actuators(names: _CompiledModel, acting: _Acting) -> Iterator[Omission]:
    """Yield inertia and damping of motors, which act whether or not these are on."""
    model, kinds = names.model, names.mujoco.mjtTrn
    for number in range(len(model.actuator_trntype)):
        if any(values := names.values(acting, number)):
            kind, target = model.actuator_trntype[number], int(model.actuator_trnid[number][0])
            along: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
            if kind in (kinds.mjTRN_JOINT, kinds.mjTRN_JOINTINPARENT):
                along = (names.joints[target],), ()
            elif kind == kinds.mjTRN_TENDON:
                along = names.along(target)
            name = model.actuator(number).name or f"actuator{number}"
            yield Omission(acting.what, name, _detail(values, ""), *along)


def _of_model(names: _CompiledModel, acting: _Acting) -> Iterator[Omission]:
    model = names.model
    arrays = (getattr(model, name, getattr(model.opt, name, 0)) for name in acting.fields)
    if any(np.any(array) for array in arrays):
        yield Omission(acting.what, "everywhere in the file")


def _detail(values: list[float], unit: str) -> str:
    """Return the value with its unit, or with the remark that there are coefficients of higher order too."""
    return f"{values[0]:g} and of higher order" if any(values[1:]) else f"{values[0]:g} {unit}".strip()


_OWNERS = {
    "dof": _of_joints,
    "joint": _of_joints,
    "body": _of_bodies,
    "tendon": _of_tendons,
    "actuator": _of_actuators,
    "model": _of_model,
}
