"""The rigid-link rule: every coefficient of a rigid link, without differentiating anything.

All vectors are in one common frame with origin o. Coordinate k's axis is S_k = (z_k, s_k) with
s_k = (p_k − o) × z_k, p_k a point on the axis (prismatic: z = 0, s the direction); V_k = (ω, v) is the twist
before joint k, Ṡ_k = V_k × S_k. A link with mass m, first moment h, inertia I about o and second moment
E = ½ tr(I) − I has P = m v + ω × h and B = −[ω]× E − v hᵀ + (h·v) 1, and the wrenches (N, f)

    c2_k:  N = h × s_k + I z_k                f = m s_k + z_k × h
    c1_k:  N = h × ṡ_k + I ż_k + B z_k        f = m ṡ_k + ż_k × h + z_k × P
    τ:     the same two with the acceleration and twist of the link, minus gravity (g: gravity alone)
    c_ijk = z_i · N + s_i · f.

The position gradient follows from how a link's wrench F turns with joint k (A_k: acceleration, gravity
included, before joint k):
    c0_ijk = S_i · (I S̈_k + 2 B Ṡ_k) + [k at or after i] S_i · (S_k ×* F),   S̈_k = A_k × S_k + V_k × Ṡ_k.

The common frame is free, and two choices pay. With o where axes of the path meet, their s vanish. With o in
the link's centre of mass, moving along with it, h, v and P vanish; lengths in units of 1/√m make m one too,
where it is a number. Which is cheaper is found by counting.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.dynamics.coefficients import LinkForms
from linkwise.dynamics.screws import (
    Orientation,
    Spatial,
    force_cross,
    motion_cross,
    pair_product,
    spatial_add,
)
from linkwise.expression import vector as vec
from linkwise.expression.graph import Matrix, Node, Vector
from linkwise.symbolic.system import RigidBody

ROUNDING = 1e-14


@dataclass(frozen=True)
class Origin:
    """The common frame's origin o: a frame of the tree, at rest, or with None the centre of mass, moving.

    `by_points` finds each ṡ of a moving o from the velocity of a point on the axis relative to it: cheaper
    where axes keep their direction.
    """

    frame: int | None = None
    by_points: bool = False


@dataclass(frozen=True)
class _Screw:
    """One joint of the path: its coordinate, S, Ṡ and S̈."""

    coordinate: int
    s: Spatial
    sd: Spatial
    sdd: Spatial


def rigid_forms(
    turn: Orientation, body: RigidBody, chain: Sequence[int], origin: Origin, gradient: bool = True
) -> LinkForms:
    """Closed forms of the link at the end of `chain`, the indices of its path in the tree of `turn`.

    Without `gradient` the position gradient is left out.
    """
    g = turn.g
    link = _Link(turn, body, chain, origin)
    path = tuple(sorted({screw.coordinate for screw in link.screws}))
    pairs = [(i, k) for i in path for k in path]
    c2 = {pair: g.zero for pair in pairs if pair[0] <= pair[1]}
    c1, c0 = dict.fromkeys(pairs, g.zero), dict.fromkeys(pairs, g.zero)
    gravity, torque = dict.fromkeys(path, g.zero), dict.fromkeys(path, g.zero)
    for at, screw in enumerate(link.screws):
        k = screw.coordinate
        gravity[k] = g.add(gravity[k], pair_product(g, screw.s, link.weight))
        torque[k] = g.add(torque[k], pair_product(g, screw.s, link.wrench))
        inertial, coriolis = link.inertial(screw), link.coriolis(screw)
        after, before = link.turned(screw) if gradient else (None, None)
        for number, other in enumerate(link.screws):
            i = other.coordinate
            if i <= k:
                c2[i, k] = g.add(c2[i, k], pair_product(g, other.s, inertial))
            c1[i, k] = g.add(c1[i, k], pair_product(g, other.s, coriolis))
            row = before if number <= at else after
            if row is not None:
                c0[i, k] = g.add(c0[i, k], pair_product(g, other.s, row))
    return LinkForms(path, c2, c1, gravity, torque, c0)


class _Link:
    """A link's screws and wrenches about one origin."""

    def __init__(self, turn: Orientation, body: RigidBody, chain: Sequence[int], origin: Origin) -> None:
        g = self.g = turn.g
        self.turn, self.chain, self.central = turn, chain, origin.frame is None
        mass = turn.lower(body.mass)
        # √m of a run-time parameter would have no gradient at 0, and a negative mass has none at all.
        value = g.value(mass)
        scaled = self.central and value is not None and value >= 0.0
        self.length = g.call("sqrt", mass) if scaled else g.one
        self.m = g.one if scaled else mass
        gravity = vec.scale(g, self.length, turn.gravity)
        com = vec.apply(g, turn.rotations[chain[-1]], self._scaled(tuple(turn.lower(c) for c in body.com)))
        self._steps: dict[int, Vector] = {}
        if origin.frame is None:
            places = self._places(chain[-1], vec.sub(g, vec.zero(g), com))
            self.com = vec.zero(g)
        else:
            places = self._places(origin.frame, vec.zero(g))
            self.com = vec.add(g, places[chain[-1]], com)
        self.h = vec.scale(g, self.m, self.com)
        axes = [self._axis(f, places[f]) for f in chain]
        if origin.by_points:
            twists, rates = self._point_motion(axes, places)
        else:
            twists = self._twists(axes)
            rates = [motion_cross(g, twist, axis)[1] for twist, axis in zip(twists, axes, strict=False)]
        self.omega, self.v = twists[-1]
        self._moments(body)
        self.screws = self._screws(axes, rates, twists, gravity)
        force = vec.sub(g, vec.zero(g), vec.scale(g, self.m, gravity))
        self.weight: Spatial = (vec.cross(g, self.com, force), force)
        inertial = self.accelerated((turn.alpha[chain[-1]], self.acceleration))
        self.wrench: Spatial = spatial_add(g, inertial, self._bent(self.omega))

    def _scaled(self, a: Sequence[Node]) -> Vector:
        x, y, z = a
        return vec.scale(self.g, self.length, (x, y, z))

    def _places(self, start: int, at: Vector) -> dict[int, Vector]:
        """Origins of the frames of the chain, from the one of frame `start`, up to the base and out again."""
        g, turn = self.g, self.turn
        places = {start: at}
        f = start
        while f >= 0:
            parent = turn.tree[f][0]
            places[parent] = vec.sub(g, places[f], self._step(f))
            f = parent
        for f in self.chain:
            if f not in places:
                places[f] = vec.add(g, places[turn.tree[f][0]], self._step(f))
        return places

    def _step(self, f: int) -> Vector:
        """From the origin of the parent's frame to that of frame f."""
        if f not in self._steps:
            rotation = self.turn.rotations[self.turn.tree[f][0]]
            self._steps[f] = vec.apply(self.g, rotation, self._scaled(self.turn.offset(f)))
        return self._steps[f]

    def _axis(self, f: int, place: Vector) -> Spatial:
        g, turn = self.g, self.turn
        if turn.tree[f][1].kind == "revolute":
            s = vec.cross(g, place, turn.z[f])
        else:
            s = vec.scale(g, self.length, turn.slide[f])
        return turn.z[f], vec.named(g, f"s{f + 1}", s)

    def _twists(self, axes: list[Spatial]) -> list[Spatial]:
        """Twist before each joint, then the link's; v is zero at the base, or the link if o moves."""
        g, turn = self.g, self.turn
        omegas = [turn.omega[turn.tree[f][0]] for f in self.chain] + [turn.omega[self.chain[-1]]]
        rates = [turn.x.qd[turn.tree[f][1].coordinate] for f in self.chain]
        moves = [vec.scale(g, rate, s) for rate, (_, s) in zip(rates, axes, strict=True)]
        v = [vec.zero(g)]
        for f, move in zip(self.chain, moves, strict=True):
            if not self.central:
                v.append(vec.named(g, f"v{f + 1}", vec.add(g, v[-1], move)))
        for f, move in zip(reversed(self.chain), reversed(moves), strict=True):
            if self.central:
                v.insert(0, vec.named(g, f"v{f}", vec.sub(g, v[0], move)))
        return list(zip(omegas, v, strict=True))

    def _point_motion(
        self, axes: list[Spatial], places: dict[int, Vector]
    ) -> tuple[list[Spatial], list[Vector]]:
        """Twist before each joint, then the link's, and each ṡ, from velocities u relative to the moving o.

        With r the place of a frame: ṙ = u, u = ω × r for the link's own, u_parent = u − ω × step − slide q̇,
        and s = r × z gives ṡ = u × z + r × ż. The parent's v at o is u − ω × r.
        """
        g, turn = self.g, self.turn
        u = vec.cross(g, turn.omega[self.chain[-1]], places[self.chain[-1]])
        twists: list[Spatial] = [(turn.omega[self.chain[-1]], vec.zero(g))]
        rates: list[Vector] = []
        for f, (z, s) in zip(reversed(self.chain), reversed(axes), strict=True):
            parent, joint = turn.tree[f]
            omega = turn.omega[parent]
            if joint.kind == "revolute":
                rate = vec.add(g, vec.cross(g, u, z), vec.cross(g, places[f], turn.zd[f]))
                u = vec.sub(g, u, vec.cross(g, omega, self._step(f)))
            else:
                rate = vec.cross(g, omega, s)
                slid = vec.scale(g, turn.x.qd[joint.coordinate], s)
                u = vec.sub(g, vec.sub(g, u, vec.cross(g, omega, self._step(f))), slid)
            rates.insert(0, rate)
            u = vec.named(g, f"u{f}", u)
            twists.insert(0, (omega, vec.sub(g, u, vec.cross(g, omega, places[parent]))))
        return twists, rates

    def _moments(self, body: RigidBody) -> None:
        """I, P and B in the common frame."""
        g, lower, w, v = self.g, self.turn.lower, self.omega, self.v
        rows = tuple(tuple(lower(entry) for entry in row) for row in body.inertia)
        half = g.mul(g.const(0.5), g.sum(rows[i][i] for i in range(3)))
        flipped = vec.symmetric(lambda i, k: g.sub(half, rows[i][i]) if i == k else g.neg(rows[i][k]))
        central = self._clean(vec.rotated(g, self.turn.rotations[self.chain[-1]], flipped))
        second = vec.symmetric(lambda i, k: g.add(central[i][k], g.mul(self.h[i], self.com[k])))
        # tr(E) = ½ tr(I about the centre of mass) + m c·c, the same in any axes; I = tr(E) − E.
        trace = g.add(half, vec.dot(g, self.h, self.com))
        self.inertia = vec.symmetric(
            lambda i, k: g.sub(trace, second[i][i]) if i == k else g.neg(second[i][k])
        )
        self.momentum = vec.add(g, vec.scale(g, self.m, v), vec.cross(g, w, self.h))
        hv = vec.dot(g, self.h, v)
        spun = [vec.cross(g, column, w) for column in second]
        a, b, c = (
            tuple(
                g.add(spun[k][i], g.sub(hv if i == k else g.zero, g.mul(v[i], self.h[k]))) for k in range(3)
            )
            for i in range(3)
        )
        self.b: Matrix = (a, b, c)  # type: ignore[assignment]

    def _clean(self, m: Matrix) -> Matrix:
        """Drop numbers that are nothing but rounding: in principal axes the products of inertia are zero."""
        g = self.g
        values = [abs(v) for row in m for e in row if (v := g.value(e)) is not None]
        least = ROUNDING * max(values, default=0.0)

        def kept(i: int, k: int) -> Node:
            value = g.value(m[i][k])
            return g.zero if value is not None and abs(value) <= least else m[i][k]

        return vec.symmetric(kept)

    def _screws(
        self, axes: list[Spatial], rates: list[Vector], twists: list[Spatial], gravity: Vector
    ) -> list[_Screw]:
        """S, Ṡ, S̈ of the path's joints, and the acceleration reached at the link."""
        g, turn = self.g, self.turn
        a = vec.sub(g, vec.zero(g), gravity)
        screws = []
        for f, axis, rate, twist in zip(self.chain, axes, rates, twists, strict=False):
            parent, joint = turn.tree[f]
            sd = turn.zd[f], vec.named(g, f"sd{f + 1}", rate)
            push = motion_cross(g, (turn.alpha[parent], a), axis)[1]
            sdd = turn.zdd[f], vec.add(g, push, motion_cross(g, twist, sd)[1])
            screws.append(_Screw(joint.coordinate, axis, sd, sdd))
            qd, qdd = turn.x.qd[joint.coordinate], turn.x.qdd[joint.coordinate]
            a = vec.add(g, a, vec.scale(g, qd, sd[1]), vec.scale(g, qdd, axis[1]))
        self.acceleration = a
        return screws

    def accelerated(self, a: Spatial) -> Spatial:
        """N = h × s + I z, f = m s + z × h."""
        g, (z, s) = self.g, a
        return (
            vec.add(g, vec.cross(g, self.h, s), vec.apply(g, self.inertia, z)),
            vec.add(g, vec.scale(g, self.m, s), vec.cross(g, z, self.h)),
        )

    def _bent(self, z: Vector) -> Spatial:
        """N = B z, f = z × P."""
        return vec.apply(self.g, self.b, z), vec.cross(self.g, z, self.momentum)

    def inertial(self, screw: _Screw) -> Spatial:
        """Wrench of c2 for the screw's coordinate."""
        return self._named("2", screw, self.accelerated(screw.s))

    def coriolis(self, screw: _Screw) -> Spatial:
        """Wrench of c1 for the screw's coordinate."""
        return self._named(
            "1", screw, spatial_add(self.g, self.accelerated(screw.sd), self._bent(screw.s[0]))
        )

    def _named(self, order: str, screw: _Screw, wrench: Spatial) -> Spatial:
        label = f"{order}_{screw.coordinate + 1}"
        return vec.named(self.g, f"n{label}", wrench[0]), vec.named(self.g, f"f{label}", wrench[1])

    def turned(self, screw: _Screw) -> tuple[Spatial, Spatial]:
        """Change of the wrench with the screw's coordinate, for joints behind it, and for it and before."""
        g = self.g
        bent = self._bent(screw.sd[0])
        after = spatial_add(g, self.accelerated(screw.sdd), spatial_add(g, bent, bent))
        return after, spatial_add(g, after, force_cross(g, screw.s, self.wrench))
