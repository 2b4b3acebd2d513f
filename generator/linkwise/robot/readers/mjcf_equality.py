"""The active equality constraints of a compiled MJCF model: joints that follow others, and loops."""

from collections.abc import Iterator
from typing import Any

from linkwise.robot.description import Coupling, Loop
from linkwise.robot.readers.mjcf_options import switched_off
from linkwise.robot.readers.mjcf_tendons import joints_of, ties

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
            of_joints = any(joints_of(mujoco, model, tendon) for tendon in tendons)
            tied = [tie for tendon in tendons for tie in ties(mujoco, model, tendon, of_joints)]
            pairs = tuple((bodies[a], bodies[b]) for a, b in tied)
            found.append(Loop(f"{what} ties links together by tendon {names}", CUT, pairs, of_joints))
        elif kind != JOINT:
            found.append(Loop(f"{what} ties parts of the model together", REMOVE))
    return tuple(found)


def _active(mujoco: Any, model: Any) -> Iterator[tuple[int, str, int, int]]:
    """Number, kind and objects of each equality that acts from the start."""
    if "equality" in switched_off(mujoco, model):
        return
    for number in range(int(model.neq)):
        if model.eq_active0[number]:
            kind = mujoco.mjtEq(int(model.eq_type[number])).name.removeprefix("mjEQ_").lower()
            yield number, kind, int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
