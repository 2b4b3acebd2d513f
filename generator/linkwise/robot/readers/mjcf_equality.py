"""The active equality constraints of a compiled MJCF model: joints that follow others, and loops."""

from collections.abc import Iterator
from typing import Any

from linkwise.robot.description import Coupling, Loop

JOINT = "joint"
OF_BODIES = ("connect", "weld")
SITES = "site"

CUT = (
    "remove it from the file, or cut both bodies off with --root or --tip, or hold the joints between them "
    "with --lock"
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
        if kind == JOINT:
            continue
        if kind not in OF_BODIES:
            found.append(Loop(f"{what} ties parts of the model together", REMOVE))
            continue
        if mujoco.mjtObj(int(model.eq_objtype[number])) == mujoco.mjtObj.mjOBJ_SITE:
            one, other = int(model.site_bodyid[one]), int(model.site_bodyid[other])
        ends = bodies[one], bodies[other]
        found.append(Loop(f"{what} ties link {ends[0]!r} to link {ends[1]!r}", CUT, ends))
    return tuple(found)


def _active(mujoco: Any, model: Any) -> Iterator[tuple[int, str, int, int]]:
    """Number, kind and objects of each equality that acts from the start."""
    off = mujoco.mjtDisableBit.mjDSBL_EQUALITY | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    if int(model.opt.disableflags) & int(off):
        return
    for number in range(int(model.neq)):
        if model.eq_active0[number]:
            kind = mujoco.mjtEq(int(model.eq_type[number])).name.removeprefix("mjEQ_").lower()
            yield number, kind, int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
