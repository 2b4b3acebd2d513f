"""The active equality constraints of a compiled MJCF model, and the tendons that some of them are of.

They are ties of bodies, couplings of joints, and others, which are not modelled.

MuJoCo's conditions are in its engine_core_constraint.c, mj_instantiateEquality; eq_data of a compiled model:

    connect  anchor on the first body, anchor on the second; of sites: none, their origins meet
    weld     anchor on the second body, place and quaternion of the first one's, scale of the torque; of
             sites: the scale, their origins and axes meet
    joint    y − y0 = Σ a_p (x − x0)^p, y the first joint and x the second, a_0 … a_4; no second: y − y0 = a_0
    tendon   as for joints, with the tendons' lengths for x and y
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from linkwise.robot import transforms
from linkwise.robot.constraints import compose_polynomial
from linkwise.robot.description import IDENTITY, Anchor, AnchoredTie, JointCoupling, Loop
from linkwise.robot.notes import Note
from linkwise.robot.readers.mjcf.forces import switched_off
from linkwise.robot.robot import Rotation, TieKind

POWERS = 5
"""Number of coefficients of a polynomial."""
TORQUE_SCALE = 10
"""Index of the torque's scale in eq_data."""

CUT = (
    "remove it from the file, hold the joints between them with --lock, or cut off what it ties with --root "
    "or --tip"
)
REMOVE = "remove it from the file"


@dataclass(frozen=True)
class Equalities:
    """Equalities of a model: ties, couplings, and `loops`, not modelled; `notes` are on inactive ones."""

    ties: tuple[AnchoredTie, ...]
    couplings: tuple[JointCoupling, ...]
    loops: tuple[Loop, ...]
    notes: tuple[Note, ...]


@dataclass(frozen=True)
class _Equality:
    """An active equality: its kind as MJCF has it, its name or one made of kind and number, its objects."""

    kind: str
    name: str
    one: int
    other: int
    data: tuple[float, ...]
    of_sites: bool


def equalities(mujoco: Any, model: Any, joints: list[str], bodies: list[str]) -> Equalities:
    """Return the active equalities, by the names of MuJoCo's joints and bodies."""
    tied: list[AnchoredTie] = []
    coupled: list[JointCoupling] = []
    loops: list[Loop] = []
    for equality in _active(mujoco, model):
        if equality.kind in ("connect", "weld"):
            tied.append(_tie(model, equality, bodies))
        elif (coupling := _coupling(mujoco, model, equality, joints)) is not None:
            coupled.append(coupling)
        else:
            loops.append(_unmodelled(mujoco, model, equality, bodies))
    inactive = int(model.neq) - len(tied) - len(coupled) - len(loops)
    notes = (Note("ignored", "inactive equality", f"{inactive} ×"),) if inactive else ()
    return Equalities(tuple(tied), tuple(coupled), tuple(loops), notes)


def _active(mujoco: Any, model: Any) -> Iterator[_Equality]:
    """Yield the equalities that act from the start."""
    if "equality" in switched_off(mujoco, model):
        return
    named = [model.equality(number).name for number in range(int(model.neq))]
    for number, name in enumerate(named):
        if not model.eq_active0[number]:
            continue
        kind = mujoco.mjtEq(int(model.eq_type[number])).name.removeprefix("mjEQ_").lower()
        made = f"{kind}{number + 1}"
        while made in named:
            made += "_"
        of_sites = mujoco.mjtObj(int(model.eq_objtype[number])) == mujoco.mjtObj.mjOBJ_SITE
        objects = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
        yield _Equality(kind, name or made, *objects, tuple(map(float, model.eq_data[number])), of_sites)


def _tie(model: Any, equality: _Equality, bodies: list[str]) -> AnchoredTie:
    data, (one, other) = equality.data, (equality.one, equality.other)
    # Scaled by 0, a weld leaves the bodies free to turn.
    turns = equality.kind == "connect" or data[TORQUE_SCALE] == 0.0
    kind: TieKind = "point" if turns else "frame"
    if equality.of_sites:
        first, second = (_site(model, site, bodies) for site in (one, other))
    elif equality.kind == "connect":
        first, second = _place(bodies[one], data[0:3]), _place(bodies[other], data[3:6])
    else:
        turn = transforms.snap(transforms.from_quaternion(*data[6:10]))
        first, second = _place(bodies[one], data[3:6], turn), _place(bodies[other], data[0:3])
    return AnchoredTie(equality.name, kind, first, second)


def _place(body: str, place: Sequence[float], turn: Rotation = IDENTITY) -> Anchor:
    x, y, z = place
    return Anchor(body, turn, (x, y, z))


def _site(model: Any, site: int, bodies: list[str]) -> Anchor:
    turn = transforms.snap(transforms.from_quaternion(*map(float, model.site_quat[site])))
    x, y, z = map(float, model.site_pos[site])
    return Anchor(bodies[int(model.site_bodyid[site])], turn, (x, y, z))


def _coupling(mujoco: Any, model: Any, equality: _Equality, joints: list[str]) -> JointCoupling | None:
    """Return the coupling of a joint equality, or of fixed tendons that are sums over joints; else None."""
    numbers = [number for number in (equality.one, equality.other) if number >= 0]
    if equality.kind == "joint":
        sides = [(_itself(number), float(model.qpos0[model.jnt_qposadr[number]])) for number in numbers]
    elif equality.kind == "tendon":
        sides = [(lengths_of(mujoco, model, n), float(model.tendon_length0[n])) for n in numbers]
    else:
        return None
    powers = equality.data[:POWERS]
    if not all(terms for terms, _ in sides) or (any(powers[2:]) and len(sides[-1][0]) > 1):
        return None
    (follower, rest), *masters = sides
    # The first side less its rest, less the polynomial of the second one less its own.
    found: list[tuple[str, tuple[float, ...]]] = [(joints[j], (0.0, factor)) for j, factor in follower]
    found[0] = found[0][0], (-rest - powers[0], follower[0][1])
    for length, at in masters:
        slopes = (0.0, *(-c for c in powers[1:]))
        shifted = compose_polynomial(slopes, 1.0, -at)
        for number, (j, factor) in enumerate(length):
            own = compose_polynomial(shifted, factor, 0.0)
            found.append((joints[j], own if number == 0 else (0.0, *own[1:])))
    return JointCoupling(equality.name, tuple(found), equality.kind == "joint")


def _itself(joint: int) -> tuple[tuple[int, float], ...]:
    return ((joint, 1.0),)


def _unmodelled(mujoco: Any, model: Any, equality: _Equality, bodies: list[str]) -> Loop:
    what = f"the {equality.kind} equality {equality.name!r}"
    if equality.kind != "tendon":
        return Loop(f"{what} ties parts of the model together", REMOVE)
    tendons = [tendon for tendon in (equality.one, equality.other) if tendon >= 0]
    names = ", ".join(repr(model.tendon(tendon).name) for tendon in tendons)
    of_joints = any(joints_of(mujoco, model, tendon) for tendon in tendons)
    tied = [tie for tendon in tendons for tie in ties(mujoco, model, tendon, of_joints)]
    pairs = tuple((bodies[a], bodies[b]) for a, b in tied)
    return Loop(f"{what} ties links together by tendon {names}", CUT, pairs, of_joints)


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
