"""Joints and bodies that the tendons of a compiled MJCF model run along."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any


def joints_of(mujoco: Any, model: Any, tendon: int) -> tuple[int, ...]:
    """Return the joints of a fixed tendon; none for a spatial one."""
    return tuple(
        joint for kind, joint in _wraps(mujoco, model, tendon) if kind == mujoco.mjtWrap.mjWRAP_JOINT
    )


def lengths_of(mujoco: Any, model: Any, tendon: int) -> tuple[tuple[int, float], ...]:
    """Return the joints of a fixed tendon with factors: its length is the sum of positions times these."""
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    joints = joints_of(mujoco, model, tendon)
    return tuple(zip(joints, map(float, model.wrap_prm[first : first + count]), strict=False))


def bodies_along(mujoco: Any, model: Any, tendon: int) -> tuple[int, ...]:
    """Return the bodies that a spatial tendon passes; none for a fixed one."""
    wrap = mujoco.mjtWrap
    passed = []
    for kind, thing in _wraps(mujoco, model, tendon):
        if kind == wrap.mjWRAP_SITE:
            passed.append(int(model.site_bodyid[thing]))
        elif kind in (wrap.mjWRAP_SPHERE, wrap.mjWRAP_CYLINDER):
            passed.append(int(model.geom_bodyid[thing]))
    return tuple(passed)


def ties(mujoco: Any, model: Any, tendon: int, of_joints: bool) -> tuple[tuple[int, int], ...]:
    """Return the pairs of bodies that a tendon ties: parent and child of its joints, or neighbours on it."""
    if not of_joints:
        return tuple(pairwise(bodies_along(mujoco, model, tendon)))
    children = (int(model.jnt_bodyid[joint]) for joint in joints_of(mujoco, model, tendon))
    return tuple((int(model.body_parentid[child]), child) for child in children)


def _wraps(mujoco: Any, model: Any, tendon: int) -> Iterator[tuple[Any, int]]:
    """Yield the kind and the index of each object that a tendon is made of."""
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    for at in range(first, first + count):
        yield mujoco.mjtWrap(int(model.wrap_type[at])), int(model.wrap_objid[at])
