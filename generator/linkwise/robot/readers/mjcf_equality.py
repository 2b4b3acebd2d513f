"""The active equality constraints of a compiled MJCF model: joints that follow others, and loops."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from linkwise.robot.description import Coupling, Loop

JOINT, TENDON = "joint", "tendon"
OF_BODIES = ("connect", "weld")

CUT = (
    "remove it from the file, hold the joints between them with --lock, or cut off what it ties with --root "
    "or --tip"
)
REMOVE = "remove it from the file"


def couplings(mujoco: Any, model: Any, joints: list[str]) -> tuple[Coupling, ...]:
    """Return which joint follows which, of the moving joints' names; no master stands for a constant."""
    return tuple(
        Coupling(joints[one], joints[other] if other >= 0 else "")
        for _, kind, one, other in _active(mujoco, model)
        if kind == JOINT
    )


def loops(mujoco: Any, model: Any, bodies: list[str]) -> tuple[Loop, ...]:
    """Return the equalities that are not of joints, of the bodies' names."""
    found = []
    for number, kind, one, other in _active(mujoco, model):
        name = model.equality(number).name
        what = f"the {kind} equality {name!r}" if name else f"an unnamed {kind} equality"
        if kind in OF_BODIES:
            if mujoco.mjtObj(int(model.eq_objtype[number])) == mujoco.mjtObj.mjOBJ_SITE:
                one, other = int(model.site_bodyid[one]), int(model.site_bodyid[other])
            ends = bodies[one], bodies[other]
            found.append(Loop(f"{what} ties link {ends[0]!r} to link {ends[1]!r}", CUT, (ends,)))
        elif kind == TENDON:
            tendons = [tendon for tendon in (one, other) if tendon >= 0]
            names = ", ".join(repr(model.tendon(tendon).name) for tendon in tendons)
            joints = tuple(tie for tendon in tendons for tie in _joints(mujoco, model, tendon, bodies))
            along = tuple(tie for tendon in tendons for tie in _along(mujoco, model, tendon, bodies))
            named = f"{what} ties links together by tendon {names}"
            found.append(Loop(named, CUT, joints or along, of_joints=bool(joints)))
        elif kind != JOINT:
            found.append(Loop(f"{what} ties parts of the model together", REMOVE))
    return tuple(found)


def _joints(mujoco: Any, model: Any, tendon: int, bodies: list[str]) -> Iterator[tuple[str, str]]:
    """Parent and child of each joint of a fixed tendon; none of a spatial one."""
    for kind, joint in _wraps(mujoco, model, tendon):
        if kind == mujoco.mjtWrap.mjWRAP_JOINT:
            child = int(model.jnt_bodyid[joint])
            yield bodies[int(model.body_parentid[child])], bodies[child]


def _along(mujoco: Any, model: Any, tendon: int, bodies: list[str]) -> Iterator[tuple[str, str]]:
    """Neighbours among the bodies that a spatial tendon passes."""
    wrap = mujoco.mjtWrap
    passed = []
    for kind, thing in _wraps(mujoco, model, tendon):
        if kind == wrap.mjWRAP_SITE:
            passed.append(bodies[int(model.site_bodyid[thing])])
        elif kind in (wrap.mjWRAP_SPHERE, wrap.mjWRAP_CYLINDER):
            passed.append(bodies[int(model.geom_bodyid[thing])])
    yield from pairwise(passed)


def _wraps(mujoco: Any, model: Any, tendon: int) -> Iterator[tuple[Any, int]]:
    """Kind and object of each thing that a tendon is made of."""
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    for at in range(first, first + count):
        yield mujoco.mjtWrap(int(model.wrap_type[at])), int(model.wrap_objid[at])


def _active(mujoco: Any, model: Any) -> Iterator[tuple[int, str, int, int]]:
    """Number, kind and objects of each equality that acts from the start."""
    off = mujoco.mjtDisableBit.mjDSBL_EQUALITY | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    if int(model.opt.disableflags) & int(off):
        return
    for number in range(int(model.neq)):
        if model.eq_active0[number]:
            kind = mujoco.mjtEq(int(model.eq_type[number])).name.removeprefix("mjEQ_").lower()
            yield number, kind, int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
