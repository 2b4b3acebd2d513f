"""Arithmetic operations of loops: those that rule.h, shares.h and gradient.h write down.

Additions, subtractions and multiplications for each sample, fused ones counted as two. What depends on the
robot alone, such as half the trace of an inertia, is not counted, nor are sines and cosines. A test counts
them in the C of one sample.
"""

from linkwise.emit.c.robot_tables import columns, curve_tables, place_matters
from linkwise.robot.robot import Joint
from linkwise.symbolic.system import RigidSystem

FRAME, TURN, PLACE, SLIDE = 141, 1, 18, 6
"""Operations of a joint's frame and axis; of its angle; of its place, and of a slide there, where places
matter."""
SUM = 12
"""Operations of a column that is the sum of two."""
LINK = 216
"""Operations of a link's inertia and motion."""
COLUMN = 87
"""Operations of a coordinate's motion of a link, and of the wrenches of its c2 and c1."""
ALONG = 11
"""Operations of a wrench along a motion: c2, c1 and tau."""
WEIGHT = 5
"""Operations of a force along a motion: g."""
MOVES = 15
"""Operations of a joint's motion of a link."""
SECOND_CHANGE = 69
"""Operations of the second change of a joint's axis."""
GRADIENT = 111
"""Operations of the wrenches of a joint's c0."""
BEND = 78
"""Operations of the change of a joint's axis by its own coordinate, for each where one follows a curve."""
SHIFT, POWER = 1, 8
"""Operations of a curve at a coordinate: of its offset in the piece, and of each power with its
derivatives."""


def link_costs(system: RigidSystem) -> list[int]:
    """Return the operations of each link's decomposition by itself."""
    frames, sums = _frames(system), columns(system).sums
    costs = []
    for j, link in enumerate(system.links):
        chain = set(link.chain)
        own = sum(last in chain for _, last in sums)
        costs.append(sum(frames[f] for f in chain) + SUM * own + _link(system, j))
    return costs


def decomposition_cost(system: RigidSystem) -> int:
    """Return the operations of the decomposition of all links."""
    links = range(len(system.links))
    return _motion(system) + sum(_link(system, j) for j in links)


def torque_cost(system: RigidSystem) -> int:
    """Return the operations of the torques alone."""
    lengths = [len(system.path(j)) for j in range(len(system.links))]
    return _motion(system) + sum(LINK + d * (MOVES + ALONG) for d in lengths)


def gradient_cost(system: RigidSystem) -> int:
    """Return the operations of the position gradient."""
    chains = [len(link.chain) for link in system.links]
    second = (SECOND_CHANGE + 6 * system.curved) * len(system.robot.links)
    step = MOVES + ALONG + 1
    own = [LINK + d * (GRADIENT + step * system.curved) + d * d * step for d in chains]
    return _motion(system) + second + sum(own)


def _motion(system: RigidSystem) -> int:
    return sum(_frames(system)) + SUM * len(columns(system).sums)


def _frames(system: RigidSystem) -> list[int]:
    """Return the operations of each frame."""
    joints, curves = [link.joint for link in system.robot.links], curve_tables(system)
    costs = [
        FRAME + _by_kind(joint, matters) for joint, matters in zip(joints, place_matters(system), strict=True)
    ]
    if curves:
        bent = SHIFT + POWER * curves.powers
        costs = [BEND + cost + bent * bool(j.curve) for cost, j in zip(costs, joints, strict=True)]
    return costs


def _by_kind(joint: Joint, matters: bool) -> int:
    if joint.kind == "revolute":
        return TURN + PLACE * matters
    return (PLACE + SLIDE) * matters


def _link(system: RigidSystem, link: int) -> int:
    d = len(system.path(link))
    return LINK + d * (COLUMN + WEIGHT + ALONG) + ALONG * (d * (d + 1) // 2 + d * d)
