"""Springs, damping, friction, armature and limits of a compiled MJCF model's hinges and slides."""

import math
from collections.abc import Collection
from typing import Any

import numpy as np

from linkwise.robot.robot import Limits, Passive

SPRING = ("jnt_stiffness", "jnt_stiffnesspoly")
DAMPING = ("dof_damping", "dof_dampingpoly")
FRICTION = ("dof_frictionloss",)
ARMATURE = ("dof_armature",)
"""Fields of mjModel: the first is proportional to the motion, or constant; the next are of higher order."""

YIELDS = "jnt_springyield"
"""Field for where a spring gives way; the law is then no longer that of a spring."""


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

    `off` has the words of `mjcf_options`.
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
