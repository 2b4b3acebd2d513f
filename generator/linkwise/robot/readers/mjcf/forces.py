"""Forces of a compiled MJCF model's joints: springs, damping, friction, armature, limits, and flags of them.

Every flag of MJCF's <option> that MuJoCo has is in one table, with its effect on the torques; MuJoCo's XML
reference, section option/flag, says what each flag stands for.
"""

import math
from collections.abc import Collection
from typing import Any

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.robot.robot import Limits, Passive

SPRING = ("jnt_stiffness", "jnt_stiffnesspoly")
DAMPING = ("dof_damping", "dof_dampingpoly")
FRICTION = ("dof_frictionloss",)
ARMATURE = ("dof_armature",)
"""Fields of mjModel: the first is proportional to the motion, or constant; the next are of higher order."""

YIELDS = "jnt_springyield"
"""Field for where a spring gives way; the law is then no longer that of a spring."""

SWITCHED_OFF: dict[str, tuple[str, ...]] = {
    "CONSTRAINT": ("equality", "friction"),
    "EQUALITY": ("equality",),
    "FRICTIONLOSS": ("friction",),
    "SPRING": ("spring",),
    "DAMPER": ("damping",),
    "GRAVITY": ("gravity", "gravity compensation"),
    # Contacts and limits are not modelled anyway: the torques are those of joints within their limits.
    "CONTACT": (),
    "LIMIT": (),
    "FILTERPARENT": (),
    "MIDPHASE": (),
    "NATIVECCD": (),
    "MULTICCD": (),
    # Torques are what the actuators must give, whether they are on or not; their rotors turn either way.
    "ACTUATION": (),
    "CLAMPCTRL": (),
    "SENSOR": (),
    # How the constraint solver and the integrator go from one time step to the next.
    "WARMSTART": (),
    "REFSAFE": (),
    "EULERDAMP": (),
    "AUTORESET": (),
    "ISLAND": (),
}
"""Forces that each flag of mjtDisableBit switches off, in the words of `unmodelled`."""

PASSIVE = ("gravity compensation", "fluid", "plugin")
"""Forces that are switched off too where both springs and dampers are."""

SWITCHED_ON: dict[str, str] = {
    "INVDISCRETE": "differences in place of accelerations",
    # Contacts, constraints, statistics and bookkeeping of a simulation: no part in the torques.
    "OVERRIDE": "",
    "ENERGY": "",
    "FWDINV": "",
    "SLEEP": "",
    "DIAGEXACT": "",
    "IPC": "",
    "SPECULATIVE": "",
    "MULTICCD": "",  # a flag to enable in MuJoCo 3, one to disable since
    "ISLAND": "",
}
"""Effect that each flag of mjtEnableBit adds and that the torques leave out; empty: none."""


def numbers_of(model: Any, fields: Collection[str], index: int) -> list[float]:
    """Return the numbers of one joint, body or tendon; a field that this MuJoCo lacks has none."""
    arrays = (getattr(model, name, None) for name in fields)
    return [float(value) for array in arrays if array is not None for value in np.ravel(array[index])]


def is_passive(mujoco: Any, model: Any, joint: int, fields: tuple[str, ...]) -> bool:
    """Return whether `Passive` can hold these fields of a joint: of one axis, and nothing of higher order."""
    kinds = mujoco.mjtJoint
    if kinds(int(model.jnt_type[joint])) not in (kinds.mjJNT_HINGE, kinds.mjJNT_SLIDE):
        return False
    _, *higher = numbers_of(model, fields, _index(model, joint, fields))
    return not any(higher) and not (fields == SPRING and any(numbers_of(model, (YIELDS,), joint)))


def passive_of(mujoco: Any, model: Any, joint: int, off: Collection[str]) -> Passive:
    """Return the passive properties of a joint, without the forces that flags switch `off`.

    `off` has the words of `SWITCHED_OFF`.
    """

    def number(fields: tuple[str, ...], switch: str = "") -> float:
        if switch in off or not is_passive(mujoco, model, joint, fields):
            return 0.0
        return numbers_of(model, fields, _index(model, joint, fields))[0]

    stiffness = number(SPRING, "spring")
    rest = float(model.qpos_spring[model.jnt_qposadr[joint]]) if stiffness else 0.0
    return Passive(
        stiffness, rest, number(DAMPING, "damping"), number(FRICTION, "friction"), number(ARMATURE)
    )


def limits_of(model: Any, joint: int) -> Limits:
    """Return the range of a joint of one axis, and the limit of the force on it; MJCF limits no speed."""
    lower, upper = map(float, model.jnt_range[joint]) if model.jnt_limited[joint] else (-math.inf, math.inf)
    forces = model.jnt_actfrcrange[joint] if model.jnt_actfrclimited[joint] else (math.inf,)
    # A range may be wider on one side; the nearer end is what either way allows.
    return Limits(lower, upper, effort=min(abs(float(force)) for force in forces))


def _index(model: Any, joint: int, fields: tuple[str, ...]) -> int:
    """Return the index of a joint, or of its first degree of freedom, in the arrays of these fields."""
    return joint if fields[0].startswith("jnt_") else int(model.jnt_dofadr[joint])


def switched_off(mujoco: Any, model: Any) -> frozenset[str]:
    """Return the forces that the file's flags switch off; raises LinkwiseError for an unknown flag."""
    flags = _changed(mujoco.mjtDisableBit, model.opt.disableflags, SWITCHED_OFF)
    off = {what for flag in flags for what in SWITCHED_OFF[flag]}
    return frozenset(off | set(PASSIVE) if {"spring", "damping"} <= off else off)


def switched_on(mujoco: Any, model: Any) -> tuple[str, ...]:
    """Return the effects that the file's flags switch on; raises LinkwiseError for an unknown flag."""
    flags = _changed(mujoco.mjtEnableBit, model.opt.enableflags, SWITCHED_ON)
    return tuple(SWITCHED_ON[flag] for flag in flags if SWITCHED_ON[flag])


def _changed(bits: Any, value: int, known: Collection[str]) -> list[str]:
    """Return the names of the bits set in `value`; raises LinkwiseError for one that is not `known`."""
    flags = [
        name.partition("_")[2]
        for name, bit in bits.__members__.items()
        if "_" in name and int(value) & int(bit)
    ]
    for flag in flags:
        if flag not in known:
            raise LinkwiseError(
                f"<option> changes the flag {flag.lower()!r}, which this version of linkwise does not know; "
                "leave it at its default"
            )
    return flags
