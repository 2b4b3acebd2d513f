"""Power by source: the rate of each link's energy, and the flow through each joint.

With E_j = K_j + P_j of link j, and R_j the power that a link which was written by hand gets otherwise than
from joints,

    dE_j/dt = qd^T M_j qdd + qd^T C_j qd + g_j^T qd + R_j

Source x has the acceleration qdd_x of `induced_accelerations`, and gives link j

    qd^T M_j qdd_x      and of its own     qd^T c1_js qd_s      if x is velocity forces on link j, by s
                                           g_j^T qd + R_j       if x is the weight of link j

so that a row sums to dE_j/dt. Armature a_i of joint i, which is in no link, has a row a_i qd_i qdd_x,i. A
column then sums to the power F_x^T qd of its source, with what velocity forces and weight took from link j
itself given back to it: these hand power on, from link to link or from potential to kinetic energy, and their
columns sum to zero, or to R_j. Constraints A qd = 0 add A^T lambda_x to F_x, which does no work in all.

The flow through joint i is the power of its whole wrench by source x on the twist of its successor. With B_i
all that is behind joint i,

    sum_(j in B_i) dE_jx/dt  -  what x gives B_i other than through joint i

where the latter is that of actuators, springs and losses at joints in B_i, and of loads on links in B_i. On
the twist of the predecessor it is less by what x gives joint i itself, tau_i qd_i, and more by what its
armature takes.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..chosen_names import short
from ..interface import Numbers, namespace
from ..quantities import InducedAccelerations
from ..rule.joint_tree import JointTree
from ..structure import Structure
from .induced_accelerations import Driven, DrivenRobot, DrivenSources, driven_sources

SIDES = ("successor", "predecessor")
"""Bodies of a joint on whose twist its wrench can be measured."""
Mask = NDArray[np.bool_]


def induced_power(robot: DrivenRobot, asked: Driven) -> InducedAccelerations[Any]:
    """Return the answer of `Dynamics.induced_power`."""
    at = driven_sources(robot, asked)
    columns, by_velocity = _rates(at, asked.passive)
    return InducedAccelerations(*[*at.forces.split(columns), by_velocity, 0.0 * by_velocity])


def induced_flow(robot: DrivenRobot, asked: Driven, side: object) -> InducedAccelerations[Any]:
    """Return the answer of `Dynamics.induced_flow`."""
    if side not in SIDES:
        raise ValueError(f"side is {short(side)}; give {' or '.join(SIDES)}")
    structure, tree = robot.backend.structure, robot.backend.tree
    if tree is None:
        raise ValueError(
            f"{structure.name} is given by energies, which do not say what hangs on which joint; "
            "induced_flow is there for rigid links, and induced_power for these"
        )
    at = driven_sources(robot, asked)
    inside = joints_behind(tree, structure.n)
    if side == "predecessor":
        inside = inside | np.eye(structure.n, dtype=bool)
    holders = np.concatenate([links_behind(structure), inside[:, _armatures(structure, asked.passive)]], 1)
    whole = at.backend.constant(holders.astype(float), at.q)
    columns, by_velocity = (whole @ rates for rates in _rates(at, asked.passive))
    columns = columns - _given(at, tree, inside)
    return InducedAccelerations(*[*at.forces.split(columns), by_velocity, 0.0 * by_velocity])


def joints_behind(tree: JointTree, n: int) -> Mask:
    """Return which coordinates k are behind a coordinate i, (n, n), i before k: itself is not.

    k is where each of its joints is carried by one of i.
    """
    carried = [{tree.joints[at].coordinate for at in tree.chain(joint.parent)} for joint in tree.joints]
    own = [[c for c, j in zip(carried, tree.joints, strict=True) if j.coordinate == k] for k in range(n)]
    return np.array([[i != k and all(i in c for c in own[k]) for k in range(n)] for i in range(n)], bool)


def fed_by_couplings(tree: JointTree, n: int) -> list[int]:
    """Return the coordinates whose flow contains what couplings feed in behind them.

    A coordinate that moves several joints couples these; it feeds in where some of them, and not all, are
    behind the first joint of a coordinate, with a link between. A joint that never moves, as that of a
    payload, is coupled to none.
    """
    carried, of = {link.joint for link in tree.links}, [joint.coordinate for joint in tree.joints]
    moving = [joint.ratio != 0.0 or joint.curve is not None for joint in tree.joints]
    found = []
    for i in range(n):
        chains = [tree.chain(f) for f in range(len(of))]
        first = of.index(i)
        between = [chain[chain.index(first) : -1] if first in chain else () for chain in chains]
        behind = [bool(carried & {*some}) for some in between]
        moved = [(k, there) for k, there, moves in zip(of, behind, moving, strict=True) if moves]
        parts = ({there for k, there in moved if k == own} for own in range(n))
        found += [i] if any(len(part) == 2 for part in parts) else []
    return found


def links_behind(structure: Structure) -> Mask:
    """Return which links are behind a coordinate, (n, N)."""
    return np.array([[i in path for path in structure.paths] for i in range(structure.n)], bool)


def _armatures(structure: Structure, passive: bool) -> list[int]:
    """Return the joints whose armature counts."""
    return list(structure.armature_joints) if passive else []


def _rates(at: DrivenSources, passive: bool) -> tuple[Numbers, Numbers]:
    """Return rates of energy of links, then armatures, (..., R, X): by columns of forces, by constraints."""
    structure, forces, qd = at.backend.structure, at.forces, at.qd
    n, links, turning = structure.n, structure.N, _armatures(structure, passive)
    momenta = (qd[..., :, None, None] * forces.by_link).sum(-3)
    if turning:
        armature = np.diag(structure.passive_sums.armature)[turning]
        own = at.backend.constant(armature, qd) * qd[..., None, :]
        momenta = namespace(qd).concat([momenta, own], -2)
    weight = n + links * n
    by_weight = np.zeros((links + len(turning), forces.columns.shape[-1]))
    by_weight[:links, weight : weight + links] = np.eye(links)
    given_back = by_weight.copy()
    given_back[:links, n:weight] = np.repeat(np.eye(links), n, axis=1)
    power = qd[..., None, :] @ forces.columns
    rates = momenta @ at.response.accelerations(forces.columns) - at.backend.constant(given_back, qd) * power
    if structure.shares:
        beside = at.backend.power_beside(at.q, qd)
        rates = rates + at.backend.constant(by_weight, qd) * beside[..., :, None]
    return rates, momenta @ at.response.of_velocities()


def _given(at: DrivenSources, tree: JointTree, inside: Mask) -> Numbers:
    """Return the power that sources give to what is behind joints without these, (..., n, X)."""
    structure, qd = at.backend.structure, at.qd
    n, tails = structure.n, at.forces.tails
    between = np.zeros((n, tails[1][0] * n + tails[2][0]))
    driven = at.backend.constant(np.concatenate([inside, between, *[inside] * 3], 1, dtype=float), qd)
    power = qd[..., None, :] @ at.forces.columns[..., : driven.shape[-1]]
    parts = [driven * power]
    for load, pulls in zip(at.loads.each, at.pulls, strict=True):
        frames = [_frame_behind(tree, one.frame, n) for one in load]
        parts.append(_of_load(at, frames, pulls))
    return namespace(qd).concat(parts, -1)


def _frame_behind(tree: JointTree, frame: int, n: int) -> list[float]:
    moved_by = {tree.joints[at].coordinate for at in tree.chain(tree.frames[frame].joint)}
    return [float(i in moved_by) for i in range(n)]


def _of_load(at: DrivenSources, frames: Sequence[list[float]], pulls: Sequence[Numbers]) -> Numbers:
    """Return the power of one load on what is behind joints, (..., n, 1)."""
    total = 0.0 * at.qd
    for behind, pull in zip(frames, pulls, strict=True):
        total = total - at.backend.constant(behind, at.qd) * (pull * at.qd).sum(-1)[..., None]
    return total[..., None]
