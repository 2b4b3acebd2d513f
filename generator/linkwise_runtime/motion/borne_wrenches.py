"""Wrenches that joints carry, by cause: those of links, of loads, and what ties and contacts pass on.

Forces of ties and contacts are linear in the torques that dependent joints need and do not give, see
`closed_places`; each cause x has its own torques T_x, and so its own

    lambda_x = A_d^+T T_x,d        W_x = W_x of the tree + sum_c e_c lambda_x,c

where e_c is what a joint carries of a unit force of row c.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays.backend import ArrayBackend
from ..call_table import PASSIVE_KINDS
from ..chosen_names import choice, listed, position_of, short
from ..constraints.closed_places import ClosedPlace, tie_forces
from ..constraints.robot_constraints import Constraints
from ..constraints.tie_rows import TieRows
from ..interface import Numbers, namespace, side_by_side
from ..joint_reactions import Reactions
from ..kinematics.frame_answers import frame_index, vectors_beside
from ..kinematics.joint_wrenches import WORLD, JointsAsked
from ..rule.joint_tree import JointTree
from .induced_accelerations import DrivenRobot, constraints_of
from .source_forces import AppliedLoads, loads_of

OWN, OF_WORLD = "joint", "world"
"""Words for the axes of the joints, and for those of the world."""


class Borne(NamedTuple):
    """Arguments of `Dynamics.reactions`."""

    q: object
    qd: object
    qdd: object
    axes: object
    point: object
    joints: object
    loads: object
    passive: bool
    constraints: object


class BorneMotion(NamedTuple):
    """Motion that has been read, and what is asked of it."""

    backend: ArrayBackend
    asked: JointsAsked
    point: Numbers | None
    q: Numbers
    qd: Numbers
    qdd: Numbers


def reactions(robot: DrivenRobot, given: Borne) -> Reactions[Any]:
    """Return the answer of `Dynamics.reactions`."""
    tree = rigid_tree(robot)
    asked = JointsAsked(joint_numbers(tree, given.joints), axes_frame(robot.backend, given.axes))
    loads, points = loads_of(robot.backend, given.loads), vectors_beside({"point": given.point})
    named = {"q": given.q, "qd": given.qd, "qdd": given.qdd}
    backend, (q, qd, qdd, *vectors) = robot.door.read(named, beside={**loads.beside, **points})
    constraints = constraints_of(robot, given.constraints)
    point = vectors.pop() if points else None
    at = BorneMotion(backend, asked, point, q, qd, qdd)
    if constraints is not None:
        return _tied(at, constraints, loads, vectors, given.passive)
    c2, c1, g = backend.link_wrenches(q, qd)
    moved = [c2 * qdd[..., None, :, None], c1 * qd[..., None, :, None], g]
    return Reactions(*map(side_by_side, _of_tree(at, moved, loads, vectors)))


def rigid_tree(robot: DrivenRobot) -> JointTree:
    """Return the tree of a robot whose links all are rigid bodies of its file; raise ValueError otherwise."""
    tree = robot.backend.tree
    if tree is None:
        raise ValueError(
            f"the links of {robot.name} are energies, which do not say what their joints carry across the "
            "axes; reactions are there for rigid links"
        )
    if not robot.backend.regresses:
        raise ValueError(
            f"{robot.name} on {robot.backend.name} has no reactions, which come from the rule for rigid "
            "links and not from energies; load numpy, torch or native"
        )
    return tree


def joint_numbers(tree: JointTree, given: object) -> tuple[int, ...]:
    """Return the joints of the tree that are given by name or number, all for None."""
    names = [joint.name for joint in tree.joints]
    if given is None:
        return tuple(range(len(names)))
    several = [given] if isinstance(given, str) or not isinstance(given, list | tuple) else given
    found = [
        position_of(one, names, "tree_joint", "joints" if several is not given else f"joints[{at}]")
        for at, one in enumerate(several)
    ]
    if not found:
        raise ValueError(f"joints is empty; name some of {listed(names)}, or leave it out for all")
    return tuple(found)


def axes_frame(backend: ArrayBackend, given: object) -> int | None:
    """Return the frame whose axes are given, WORLD for the world's, None for the joints' own."""
    if given == OWN:
        return None
    if given == OF_WORLD:
        return WORLD
    names = backend.frames.names
    if isinstance(given, str) and given not in names:
        known = choice(given, (OWN, OF_WORLD, *names), "kinematics.frames")
        raise ValueError(f"axes is {short(given)}; choose joint, world, or the name of a frame: {known}")
    try:
        return frame_index(given, names)
    except (TypeError, ValueError) as error:
        raise type(error)(f"axes: {error}") from None


def _none(at: BorneMotion, tail: tuple[int, ...]) -> Numbers:
    """Return zeros (..., joints, *tail, 6)."""
    shape = (len(at.asked.joints), *tail, 6)
    zeros: Numbers = at.backend.zeros(at.q, int(np.prod(shape))).reshape(*at.q.shape[:-1], *shape)
    return zeros


def _of_loads(at: BorneMotion, loads: AppliedLoads, vectors: Sequence[Numbers]) -> Numbers:
    """Return what each load asks of the joints in the tree, (..., joints, L, 6)."""
    every = [one for load in loads.each for one in load]
    if not every:
        return _none(at, (len(loads.each),))
    named = dict(zip(loads.beside, vectors, strict=True))
    found = at.backend.wrenches.of_loads(at.asked, at.q, at.point, every, named)
    ends = np.cumsum([len(load) for load in loads.each]).tolist()
    parts = [found[..., end - len(load) : end, :].sum(-2) for load, end in zip(loads.each, ends, strict=True)]
    return namespace(found).stack(parts, -2)


def _tied(
    at: BorneMotion,
    constraints: Constraints[Any],
    loads: AppliedLoads,
    vectors: Sequence[Numbers],
    passive: bool,
) -> Reactions[Any]:
    """Return the shares under constraints, by the motion of the independent joints."""
    place = constraints.ties.place(at.backend, at.q)
    qd = place.velocity(place.own(at.qd))
    qdd = place.velocity(place.own(at.qdd)) + place.bias(qd)
    at = at._replace(qd=qd, qdd=qdd)
    tree = _of_tree(at, _of_links(at, place), loads, vectors)
    torques = _torques(at, place, loads, vectors, passive)
    forces = tie_forces(place.found, namespace(at.q).concat(torques, -1))
    rows = constraints.ties.rows(at.backend)
    assert isinstance(rows, TieRows)  # links are rigid
    unit = rows.on_joints(at.asked, at.q, at.point)
    # (..., joints, 6, X), then X before the six
    passed = (unit.mT @ forces[..., None, : unit.shape[-2], :]).mT
    shares, start = [], 0
    for own, torque in zip(tree, torques, strict=True):
        end = start + torque.shape[-1]
        shares.append(side_by_side(own + passed[..., start:end, :].reshape(*own.shape)))
        start = end
    return Reactions(*shares)


def _of_tree(
    at: BorneMotion, moved: Sequence[Numbers], loads: AppliedLoads, vectors: Sequence[Numbers]
) -> list[Numbers]:
    """Return the shares of the tree, from wrenches of links (..., N, X, 6), of weights the last."""
    acceleration, velocity, gravity = at.backend.wrenches.at_joints(at.asked, at.q, at.point, moved)
    passive = _none(at, (len(PASSIVE_KINDS), at.q.shape[-1]))
    return [acceleration, velocity, gravity[..., 0, :], _of_loads(at, loads, vectors), passive]


def _of_links(at: BorneMotion, place: ClosedPlace) -> list[Numbers]:
    """Return the wrenches of links by the motion of the independent joints, (..., N, X, 6).

    With qd = G yd and qdd = G ydd + dG/dt yd: c2 G ydd and (c2 dG/dt + c1 G) yd.
    """
    c2, c1, g = at.backend.link_wrenches(at.q, at.qd)
    mapped, rate = (a[..., None, :, :].mT for a in (place.found.map, place.map_rate(at.qd)))
    ydd, yd = (place.own(a)[..., None, :, None] for a in (at.qdd, at.qd))
    return [mapped @ c2 * ydd, (rate @ c2 + mapped @ c1) * yd, g]


def _torques(
    at: BorneMotion, place: ClosedPlace, loads: AppliedLoads, vectors: Sequence[Numbers], passive: bool
) -> list[Numbers]:
    """Return the torques (..., n, X) that joints need in the tree by the causes of each share."""
    backend, q, qd = at.backend, at.q, at.qd
    c2, c1, g = backend.answers.coefficients(q, qd)
    mapped, rate = (a[..., None, :, :] for a in (place.found.map, place.map_rate(qd)))
    ydd, yd = (place.own(a)[..., None, None, :] for a in (at.qdd, qd))
    motion = [c2 @ mapped * ydd, (c2 @ rate + c1 @ mapped) * yd]
    pulls = loads.torques(backend, q, vectors)
    identity = backend.constant(np.eye(q.shape[-1]), q)
    own = backend.answers.passive_torque(q, qd, at.qdd) if passive else [0.0 * q] * len(PASSIVE_KINDS)
    xp = namespace(q)
    return [
        *(a.reshape(*q.shape, a.shape[-2] * a.shape[-1]) for a in motion),
        g,
        xp.stack(pulls, -1) if pulls else q[..., None][..., :0],
        xp.concat([identity * torque[..., None, :] for torque in own], -1),
    ]
