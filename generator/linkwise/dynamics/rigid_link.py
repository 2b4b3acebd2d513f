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
    τ:     N and f likewise with the link's twist, and its acceleration minus gravity (g: gravity alone);
           where the coefficients are computed too, their sum is often cheaper (`torque_sums`)

The position gradient follows from how a link's wrench F turns with joint k:
    c0_ijk = S_i · (I S̈_k + 2 B Ṡ_k) + [k at or after i] S_i · (S_k ×* F)

The common frame is free, and two choices pay. With o where axes of the path meet, their s vanish. With o in
the link's centre of mass, moving along with it, h, v and P vanish; lengths in units of 1/√m make m one too,
where it is a number. The cheaper one is found by counting (`frame_search`).
"""

from dataclasses import dataclass
from itertools import groupby

from linkwise.dynamics.joint_chain import JointChain
from linkwise.dynamics.link_forms import LinkForms, nodes
from linkwise.dynamics.link_motion import LinkMotion, Origin, Screw, link_motion
from linkwise.dynamics.spatial_vectors import ForceVector, MotionVector
from linkwise.dynamics.torque_sums import TorqueSums
from linkwise.expression.expression import Expression
from linkwise.expression.vector import Matrix, Vector
from linkwise.symbolic.system import RigidLink

ROUNDING = 1e-14


def rigid_forms(
    chain: JointChain, link: RigidLink, origin: Origin, frame: tuple[str, ...] = (), gradient: bool = True
) -> LinkForms:
    """Return the closed forms of the link at the end of `chain`.

    frame: the common frame in words; without `gradient` the position gradient is left out
    """
    motion = link_motion(chain, link, origin)
    moments = _moments(chain, link, motion)
    weight, wrench = _weight(moments, motion), moments.wrench(motion)
    path = tuple(sorted({screw.coordinate for screw in motion.screws}))
    pairs = [(i, k) for i in path for k in path]
    c2 = {pair: chain.zero for pair in pairs if pair[0] <= pair[1]}
    c1, c0 = dict.fromkeys(pairs, chain.zero), dict.fromkeys(pairs, chain.zero)
    gravity, torque = dict.fromkeys(path, chain.zero), dict.fromkeys(path, chain.zero)
    for screw in motion.screws:
        gravity[screw.coordinate] += screw.s.dot(weight)
        torque[screw.coordinate] += screw.s.dot(wrench)
    sums = TorqueSums(chain.inputs, gravity)
    ordered = sorted(enumerate(motion.screws), key=lambda numbered: numbered[1].coordinate)
    for k, columns in groupby(ordered, key=lambda numbered: numbered[1].coordinate):
        for at, screw in columns:
            inertial, coriolis = moments.inertial(screw), moments.coriolis(screw)
            after, before = moments.change_with(screw, wrench) if gradient else (None, None)
            for number, other in enumerate(motion.screws):
                i = other.coordinate
                if i <= k:
                    c2[i, k] += other.s.dot(inertial)
                c1[i, k] += other.s.dot(coriolis)
                change = before if number <= at else after
                if change is not None:
                    c0[i, k] += other.s.dot(change)
        sums.add(k, c2, c1)
    return LinkForms(
        chain.graph,
        chain.inputs,
        path,
        frame,
        acceleration=nodes(c2),
        velocity=nodes(c1),
        gravity=nodes(gravity),
        torque=nodes(torque),
        decomposed_torque=nodes(sums.if_cheaper(torque, c2, c1)),
        position_gradient=nodes(c0),
    )


@dataclass(frozen=True)
class _Moments:
    """Moments of a link about o: m, h, I, P and B."""

    m: Expression
    h: Vector
    inertia: Matrix
    momentum: Vector
    b: Matrix

    def inertial_wrench(self, a: MotionVector) -> ForceVector:
        """Return N = h × s + I z, f = m s + z × h, for an acceleration (z, s)."""
        z, s = a.angular, a.linear
        return ForceVector(self.h.cross(s) + self.inertia @ z, self.m * s + z.cross(self.h))

    def velocity_wrench(self, z: Vector) -> ForceVector:
        """Return N = B z, f = z × P."""
        return ForceVector(self.b @ z, z.cross(self.momentum))

    def wrench(self, motion: LinkMotion) -> ForceVector:
        """Return the wrench of τ, by the link's acceleration and twist."""
        return self.inertial_wrench(motion.acceleration) + self.velocity_wrench(motion.twist.angular)

    def inertial(self, screw: Screw) -> ForceVector:
        """Return the wrench of c2 for the screw's coordinate, named n3_c2 and f3_c2 for that of joint 3."""
        return self.inertial_wrench(screw.s).named(f"{screw.label}_c2")

    def coriolis(self, screw: Screw) -> ForceVector:
        """Return the wrench of c1 for the screw's coordinate, named n3_c1 and f3_c1 for that of joint 3."""
        turning = self.velocity_wrench(screw.s.angular)
        return (self.inertial_wrench(screw.sd) + turning).named(f"{screw.label}_c1")

    def change_with(self, screw: Screw, wrench: ForceVector) -> tuple[ForceVector, ForceVector]:
        """Return the change of the wrench with the screw's coordinate, as two wrenches.

        The first is for joints behind the screw's, the second for it and those before.
        """
        turning = self.velocity_wrench(screw.sd.angular)
        after = self.inertial_wrench(screw.sdd) + (turning + turning)
        return after, after + screw.s.cross_force(wrench)


def _moments(chain: JointChain, link: RigidLink, motion: LinkMotion) -> _Moments:
    """Return h, I, P and B in the common frame, from the inertia J about the centre of mass c."""
    omega, v, com = motion.twist.angular, motion.twist.linear, motion.com
    # h = m c
    h = motion.m * com
    # E about c: ½ tr(J) − J, turned into the common axes; about o: E + m c cᵀ.
    j = [chain.vector(row) for row in link.inertia]
    half = 0.5 * (j[0][0] + j[1][1] + j[2][2])
    about_com = Matrix.symmetric(lambda i, k: half - j[i][i] if i == k else -j[i][k])
    turned = _without_rounding(about_com.rotated(chain.rotation[chain.frames[-1]]))
    e = Matrix.symmetric(lambda i, k: turned[i][k] + h[i] * com[k])
    # I = tr(E) − E, with tr(E) = ½ tr(J) + m c·c, the same in any axes.
    trace = half + h.dot(com)
    inertia = Matrix.symmetric(lambda i, k: trace - e[i][i] if i == k else -e[i][k])
    # P = m v + ω × h
    momentum = motion.m * v + omega.cross(h)
    # B = −[ω]× E − v hᵀ + (h·v) 1; E is symmetric, so column k of −[ω]× E is E_k × ω.
    hv = h.dot(v)
    crossed = [column.cross(omega) for column in e]
    b = Matrix.of(lambda i, k: crossed[k][i] + ((hv if i == k else chain.zero) - v[i] * h[k]))
    return _Moments(motion.m, h, inertia, momentum, b)


def _weight(moments: _Moments, motion: LinkMotion) -> ForceVector:
    """Return gravity's wrench: f = −m a_g, N = c × f."""
    force = -(moments.m * motion.gravity)
    return ForceVector(motion.com.cross(force), force)


def _without_rounding(m: Matrix) -> Matrix:
    """Return the matrix without numbers that are only rounding.

    Turns by right angles leave such numbers in products of inertia.
    """
    entries = [row[k] for row in m for k in range(3)]
    least = ROUNDING * max((abs(e.value) for e in entries if e.value is not None), default=0.0)

    def kept(i: int, k: int) -> Expression:
        value = m[i][k].value
        return m[i][k].number(0.0) if value is not None and abs(value) <= least else m[i][k]

    return Matrix.symmetric(kept)
