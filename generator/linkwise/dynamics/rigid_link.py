"""The rigid-link rule: every coefficient of a rigid link, without differentiating anything.

All vectors are in one common frame with origin o, and S_k = (z_k, s_k) is the axis of coordinate k
(`link_motion`). A link with mass m, first moment h, inertia I about o and second moment E = ½ tr(I) − I,
moving with the twist (ω, v), has

    P = m v + ω × h        B = −[ω]× E − v hᵀ + (h·v) 1

B is linear and B ω = ω × I ω + h × (ω × v), Newton and Euler's moment by velocities; of all such maps it is
the one for which c1 is ½ ∂τ/∂q̇ (S. Echeandia, P. Wensing, Numerical Methods to Compute the Coriolis Matrix
and Christoffel Symbols for Rigid-Body Systems, J. Comput. Nonlinear Dynam. 16(9), 2021). For each coordinate
k one wrench (N, f) gives a column of coefficients, c_ijk = z_i · N + s_i · f:

    c2_k:  N = h × s_k + I z_k                f = m s_k + z_k × h
    c1_k:  N = h × ṡ_k + I ż_k + B z_k        f = m ṡ_k + ż_k × h + z_k × P
    τ:     N and f likewise with the acceleration and twist of the link, minus gravity (g: gravity alone);
           where the coefficients are computed too, their sum is often cheaper (`torque_sums`)

The position gradient follows from how a link's wrench F turns with joint k:
    c0_ijk = S_i · (I S̈_k + 2 B Ṡ_k) + [k at or after i] S_i · (S_k ×* F)

The common frame is free, and two choices pay. With o where axes of the path meet, their s vanish. With o in
the link's centre of mass, moving along with it, h, v and P vanish; lengths in units of 1/√m make m one too,
where it is a number. The cheaper one is found by counting (`frame_search`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from linkwise.dynamics.coefficients import LinkForms
from linkwise.dynamics.link_motion import LinkMotion, Origin, Screw, link_motion
from linkwise.dynamics.screws import Orientation, Spatial, force_cross, pair_product, spatial_add
from linkwise.dynamics.torque_sums import TorqueSums
from linkwise.expression import vector as vec
from linkwise.expression.expression_graph import Graph, Matrix, Node, Vector
from linkwise.symbolic.system import RigidLink

ROUNDING = 1e-14


def rigid_forms(
    turn: Orientation, link: RigidLink, chain: Sequence[int], origin: Origin, gradient: bool = True
) -> LinkForms:
    """Return the closed forms of the link at the end of `chain`, the indices of its path in `turn`'s tree.

    Without `gradient` the position gradient is left out.
    """
    g = turn.g
    motion = link_motion(turn, link, chain, origin)
    moments = _moments(turn, link, chain[-1], motion)
    weight, wrench = _weight(g, moments, motion), moments.wrench(g, motion)
    path = tuple(sorted({screw.coordinate for screw in motion.screws}))
    pairs = [(i, k) for i in path for k in path]
    c2 = {pair: g.zero for pair in pairs if pair[0] <= pair[1]}
    c1, c0 = dict.fromkeys(pairs, g.zero), dict.fromkeys(pairs, g.zero)
    gravity, torque = dict.fromkeys(path, g.zero), dict.fromkeys(path, g.zero)
    for screw in motion.screws:
        i = screw.coordinate
        gravity[i] = g.add(gravity[i], pair_product(g, screw.s, weight))
        torque[i] = g.add(torque[i], pair_product(g, screw.s, wrench))
    sums = TorqueSums(g, turn.x, gravity)
    ordered = sorted(enumerate(motion.screws), key=lambda numbered: numbered[1].coordinate)
    for k, columns in groupby(ordered, key=lambda numbered: numbered[1].coordinate):
        for at, screw in columns:
            inertial, coriolis = moments.inertial(g, screw), moments.coriolis(g, screw)
            after, before = moments.turned(g, screw, wrench) if gradient else (None, None)
            for number, other in enumerate(motion.screws):
                i = other.coordinate
                if i <= k:
                    c2[i, k] = g.add(c2[i, k], pair_product(g, other.s, inertial))
                c1[i, k] = g.add(c1[i, k], pair_product(g, other.s, coriolis))
                row = before if number <= at else after
                if row is not None:
                    c0[i, k] = g.add(c0[i, k], pair_product(g, other.s, row))
        sums.add(k, c2, c1)
    return LinkForms(path, c2, c1, gravity, torque, sums.if_cheaper(torque, c2, c1), c0)


@dataclass(frozen=True)
class _Moments:
    """Moments of a link about o: m, h, I, P and B."""

    m: Node
    h: Vector
    inertia: Matrix
    momentum: Vector
    b: Matrix

    def accelerated(self, g: Graph, a: Spatial) -> Spatial:
        """Return N = h × s + I z, f = m s + z × h, for an acceleration (z, s)."""
        z, s = a
        moment = vec.add(g, vec.cross(g, self.h, s), vec.apply(g, self.inertia, z))
        return moment, vec.add(g, vec.scale(g, self.m, s), vec.cross(g, z, self.h))

    def by_velocity(self, g: Graph, z: Vector) -> Spatial:
        """Return N = B z, f = z × P."""
        return vec.apply(g, self.b, z), vec.cross(g, z, self.momentum)

    def wrench(self, g: Graph, motion: LinkMotion) -> Spatial:
        """Return the wrench of τ, by the link's acceleration and twist."""
        return spatial_add(g, self.accelerated(g, motion.acceleration), self.by_velocity(g, motion.twist[0]))

    def inertial(self, g: Graph, screw: Screw) -> Spatial:
        """Return the wrench of c2 for the screw's coordinate."""
        return _named(g, screw, "c2", self.accelerated(g, screw.s))

    def coriolis(self, g: Graph, screw: Screw) -> Spatial:
        """Return the wrench of c1 for the screw's coordinate."""
        turning = self.by_velocity(g, screw.s[0])
        return _named(g, screw, "c1", spatial_add(g, self.accelerated(g, screw.sd), turning))

    def turned(self, g: Graph, screw: Screw, wrench: Spatial) -> tuple[Spatial, Spatial]:
        """Return the change of the wrench with the screw's coordinate, as two wrenches.

        The first is for joints behind the screw's, the second for it and those before.
        """
        turning = self.by_velocity(g, screw.sd[0])
        after = spatial_add(g, self.accelerated(g, screw.sdd), spatial_add(g, turning, turning))
        return after, spatial_add(g, after, force_cross(g, screw.s, wrench))


def _moments(turn: Orientation, link: RigidLink, frame: int, motion: LinkMotion) -> _Moments:
    """Return h, I, P and B in the common frame, from the inertia J about the centre of mass c."""
    g, (omega, v), com = turn.g, motion.twist, motion.com
    # h = m c
    h = vec.scale(g, motion.m, com)
    # E about c: ½ tr(J) − J, turned into the common axes; about o: E + m c cᵀ.
    j = tuple(tuple(turn.lower(entry) for entry in row) for row in link.inertia)
    half = g.mul(g.const(0.5), g.sum(j[i][i] for i in range(3)))
    about_com = vec.symmetric(lambda i, k: g.sub(half, j[i][i]) if i == k else g.neg(j[i][k]))
    turned = _without_rounding(g, vec.rotated(g, turn.rotations[frame], about_com))
    e = vec.symmetric(lambda i, k: g.add(turned[i][k], g.mul(h[i], com[k])))
    # I = tr(E) − E, with tr(E) = ½ tr(J) + m c·c, the same in any axes.
    trace = g.add(half, vec.dot(g, h, com))
    inertia = vec.symmetric(lambda i, k: g.sub(trace, e[i][i]) if i == k else g.neg(e[i][k]))
    # P = m v + ω × h
    momentum = vec.add(g, vec.scale(g, motion.m, v), vec.cross(g, omega, h))
    # B = −[ω]× E − v hᵀ + (h·v) 1; E is symmetric, so column k of −[ω]× E is E_k × ω.
    hv = vec.dot(g, h, v)
    crossed = [vec.cross(g, column, omega) for column in e]

    def row(i: int) -> Vector:
        entries = (g.add(crossed[k][i], g.sub(hv if i == k else g.zero, g.mul(v[i], h[k]))) for k in range(3))
        x, y, z = entries
        return x, y, z

    return _Moments(motion.m, h, inertia, momentum, (row(0), row(1), row(2)))


def _weight(g: Graph, moments: _Moments, motion: LinkMotion) -> Spatial:
    """Return gravity's wrench: f = −m a_g, N = c × f."""
    force = vec.minus(g, vec.scale(g, moments.m, motion.gravity))
    return vec.cross(g, motion.com, force), force


def _without_rounding(g: Graph, m: Matrix) -> Matrix:
    """Return the matrix without numbers that are only rounding.

    Turns by right angles leave such numbers in products of inertia.
    """
    values = [abs(v) for row in m for e in row if (v := g.value(e)) is not None]
    least = ROUNDING * max(values, default=0.0)

    def kept(i: int, k: int) -> Node:
        value = g.value(m[i][k])
        return g.zero if value is not None and abs(value) <= least else m[i][k]

    return vec.symmetric(kept)


def _named(g: Graph, screw: Screw, coefficient: str, wrench: Spatial) -> Spatial:
    """Return the wrench, named n3_c2 (moment) and f3_c2 (force) where the coefficients are c2 of joint 3."""
    n, f = wrench
    return (
        vec.named(g, f"n{screw.label}_{coefficient}", n),
        vec.named(g, f"f{screw.label}_{coefficient}", f),
    )
