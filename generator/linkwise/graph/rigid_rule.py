"""The rigid-link rule: every coefficient of a rigid link, without differentiating anything.

All vectors are in one common frame, about one common origin o. Coordinate k's axis is S_k = (z_k, s_k) with
s_k = (p_k − o) × z_k, p_k a point on the axis (prismatic: z = 0, s the direction). V = (ω, v) is the twist
accumulated along the path, Ṡ_k = V × S_k. A link with mass m, first moment h, inertia I about o and second
moment E = ½ tr(I) − I has P = m v + ω × h and B = −[ω]× E − v hᵀ + (h·v) 1, and the wrenches (N, f)

    c2_k:  N = h × s_k + I z_k                f = m s_k + z_k × h
    c1_k:  N = h × ṡ_k + I ż_k + B z_k        f = m ṡ_k + ż_k × h + z_k × P
    τ:     the same two with the acceleration and twist of the link, minus gravity (g: gravity alone)
    c_ijk = z_i · N + s_i · f.

The position gradient follows from how a link's wrench F turns with joint k (A_k, V_k: acceleration, gravity
included, and twist before joint k):
    c0_ijk = S_i · (I S̈_k + 2 B Ṡ_k) + [k at or after i] S_i · (S_k ×* F),   S̈_k = A_k × S_k + V_k × Ṡ_k.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.graph import vector as vec
from linkwise.graph.expression import Graph, Matrix, Node, Vector
from linkwise.graph.forms import Inputs, LinkForms
from linkwise.graph.lower import Lowering
from linkwise.model.robot import Joint, Scalar
from linkwise.symbolic.system import RigidBody

Spatial = tuple[Vector, Vector]


@dataclass(frozen=True)
class CommonFrame:
    """Where the vectors live: the axes of frame `axes` and the origin of frame `origin`.

    Frame −1 is the base, frame f the one of the f-th link of the tree; `before` means just before the turn of its
    joint, which the joint's axis does not feel.
    """

    axes: int
    before: bool
    origin: int


@dataclass(frozen=True)
class _Screw:
    """One joint: its coordinate, S, Ṡ and S̈."""

    coordinate: int
    s: Spatial
    sd: Spatial
    sdd: Spatial


class Kinematics:
    """Axes, twists and frames of a tree of joints in a common frame, shared by all its links.

    `tree` lists (parent, joint), parents first; parent −1 is the base.
    """

    def __init__(
        self,
        lower: Lowering,
        tree: Sequence[tuple[int, Joint]],
        gravity: Sequence[Scalar],
        frame: CommonFrame,
        x: Inputs,
    ) -> None:
        self.g, self.lower, self.x, self.tree = lower.graph, lower, x, tree
        self._fixed = [self._matrix(joint) for _, joint in tree]
        self._turns = [self._turn(joint) for _, joint in tree]
        self.rotations = self._orient(frame)
        self.positions = self._locate(frame.origin)
        gx, gy, gz = (lower(a) for a in gravity)
        self.gravity = named(self.g, "a", vec.apply(self.g, self.rotations[-1], (gx, gy, gz)))
        self.screws: list[_Screw] = []
        none = (self.g.zero, self.g.zero, self.g.zero)
        self.twists: dict[int, Spatial] = {-1: (none, none)}
        self.accelerations: dict[int, Spatial] = {-1: (none, vec.sub(self.g, none, self.gravity))}
        for f in range(len(tree)):
            self._advance(f)

    def _matrix(self, joint: Joint) -> Matrix:
        a, b, c = ((self.g.const(r[0]), self.g.const(r[1]), self.g.const(r[2])) for r in joint.rotation)
        return a, b, c

    def _turn(self, joint: Joint) -> Matrix:
        """Rz(ratio · q) of a revolute joint, the identity of a prismatic one."""
        g = self.g
        if joint.kind == "prismatic":
            return identity(g)
        angle = g.mul(g.const(joint.ratio), self.x.q[joint.coordinate])
        s, c = g.call("sin", angle), g.call("cos", angle)
        return ((c, g.neg(s), g.zero), (s, c, g.zero), (g.zero, g.zero, g.one))

    def _orient(self, frame: CommonFrame) -> dict[int, Matrix]:
        """Orientation of every frame in the common one, walking the tree away from it both ways."""
        g, at = self.g, frame.axes
        rotations = {at: self._turns[at] if frame.before else identity(g)}
        while at >= 0:
            parent = self.tree[at][0]
            back = identity(g) if frame.before and at == frame.axes else rotations[at]
            if not (frame.before and at == frame.axes):
                back = vec.product(g, back, vec.transpose(self._turns[at]))
            rotations[parent] = vec.product(g, back, vec.transpose(self._fixed[at]))
            at = parent
        for f, (parent, _) in enumerate(self.tree):
            if f not in rotations:
                fixed = vec.product(g, rotations[parent], self._fixed[f])
                rotations[f] = vec.product(g, fixed, self._turns[f])
        return rotations

    def _locate(self, origin: int) -> dict[int, Vector]:
        """Origin of every frame, from the common origin."""
        g, at = self.g, origin
        steps = [vec.apply(g, self.rotations[parent], self._offset(joint)) for parent, joint in self.tree]
        positions: dict[int, Vector] = {at: (g.zero, g.zero, g.zero)}
        while at >= 0:
            parent = self.tree[at][0]
            positions[parent] = vec.sub(g, positions[at], steps[at])
            at = parent
        for f, (parent, _) in enumerate(self.tree):
            if f not in positions:
                positions[f] = vec.add(g, positions[parent], steps[f])
        return positions

    def _offset(self, joint: Joint) -> Vector:
        """From the parent frame's origin to the link's, in the parent's frame."""
        g = self.g
        x, y, z = (self.lower(p) for p in joint.translation)
        if joint.kind == "revolute":
            return x, y, z
        slide = g.mul(g.const(joint.ratio), self.x.q[joint.coordinate])
        axis = vec.transpose(self._matrix(joint))[2]
        return vec.add(g, (x, y, z), vec.scale(g, slide, axis))

    def _advance(self, f: int) -> None:
        """S, Ṡ, S̈ of joint f, and the twist and acceleration behind it."""
        g, (parent, joint), label = self.g, self.tree[f], f + 1
        z = vec.transpose(self.rotations[f])[2]
        none = (g.zero, g.zero, g.zero)
        if joint.kind == "revolute":
            s: Spatial = (z, vec.cross(g, self.positions[f], z))
        else:
            s = (none, z)
        s = spatial_scale(g, g.const(joint.ratio), s)
        s = named(g, f"z{label}", s[0]), named(g, f"s{label}", s[1])
        twist, acceleration = self.twists[parent], self.accelerations[parent]
        sd = motion_cross(g, twist, s)
        sd = named(g, f"zd{label}", sd[0]), named(g, f"sd{label}", sd[1])
        sdd = spatial_add(g, motion_cross(g, acceleration, s), motion_cross(g, twist, sd))
        self.screws.append(_Screw(joint.coordinate, s, sd, sdd))
        qd, qdd = self.x.qd[joint.coordinate], self.x.qdd[joint.coordinate]
        w, v = spatial_add(g, twist, spatial_scale(g, qd, s))
        self.twists[f] = named(g, f"w{label}", w), named(g, f"v{label}", v)
        self.accelerations[f] = spatial_add(
            g, acceleration, spatial_scale(g, qd, sd), spatial_scale(g, qdd, s)
        )


def rigid_forms(kin: Kinematics, body: RigidBody, chain: Sequence[int]) -> LinkForms:
    """Closed forms of the link at the end of `chain`, the indices of its path in the tree of `kin`."""
    g, end = kin.g, chain[-1]
    screws = [kin.screws[f] for f in chain]
    path = tuple(sorted({screw.coordinate for screw in screws}))
    link = _Inertia(kin, body, end)
    weight = link.weight()
    wrench = spatial_add(g, link.accelerated(kin.accelerations[end]), link.coriolis(kin.twists[end]))
    pairs = [(i, k) for i in path for k in path]
    c2 = {pair: g.zero for pair in pairs if pair[0] <= pair[1]}
    c1, c0 = dict.fromkeys(pairs, g.zero), dict.fromkeys(pairs, g.zero)
    gravity, torque = dict.fromkeys(path, g.zero), dict.fromkeys(path, g.zero)
    for at, screw in enumerate(screws):
        k = screw.coordinate
        gravity[k] = g.add(gravity[k], pair_product(g, screw.s, weight))
        torque[k] = g.add(torque[k], pair_product(g, screw.s, wrench))
        inertial = link.accelerated(screw.s)
        inertial = named(g, f"n2_{k + 1}", inertial[0]), named(g, f"f2_{k + 1}", inertial[1])
        coriolis = spatial_add(g, link.accelerated(screw.sd), link.coriolis(screw.s))
        coriolis = named(g, f"n1_{k + 1}", coriolis[0]), named(g, f"f1_{k + 1}", coriolis[1])
        twice = link.coriolis(screw.sd)
        after = spatial_add(g, link.accelerated(screw.sdd), twice, twice)
        before = spatial_add(g, after, force_cross(g, screw.s, wrench))
        for number, other in enumerate(screws):
            i = other.coordinate
            if i <= k:
                c2[i, k] = g.add(c2[i, k], pair_product(g, other.s, inertial))
            c1[i, k] = g.add(c1[i, k], pair_product(g, other.s, coriolis))
            row = before if number <= at else after
            c0[i, k] = g.add(c0[i, k], pair_product(g, other.s, row))
    return LinkForms(path, c2, c1, gravity, torque, c0)


class _Inertia:
    """Mass, first and second moment of a link in the common frame, and the wrenches they give."""

    def __init__(self, kin: Kinematics, body: RigidBody, end: int) -> None:
        g = self.g = kin.g
        rotation, position = kin.rotations[end], kin.positions[end]
        self.m = kin.lower(body.mass)
        x, y, z = (kin.lower(c) for c in body.com)
        com = vec.add(g, position, vec.apply(g, rotation, (x, y, z)))
        self.h = vec.scale(g, self.m, com)
        a, b, c = (tuple(kin.lower(entry) for entry in row) for row in body.inertia)
        # E about o: the rotated second moment about the centre of mass, ½ tr(I) − I, plus m c cᵀ.
        half_trace = g.mul(g.const(0.5), g.add(g.add(a[0], b[1]), c[2]))
        rows = tuple(
            tuple(g.sub(half_trace, e) if i == k else g.neg(e) for k, e in enumerate(row))
            for i, row in enumerate((a, b, c))
        )
        central = rotated_symmetric(g, rotation, rows)  # type: ignore[arg-type]
        self.second = symmetric(lambda i, k: g.add(central[i][k], g.mul(self.h[i], com[k])))
        # tr(E) = ½ tr(I about the centre of mass) + m c·c, the same in any axes.
        trace = g.add(half_trace, vec.dot(g, self.h, com))
        self.inertia = symmetric(
            lambda i, k: g.sub(trace, self.second[i][k]) if i == k else g.neg(self.second[i][k])
        )
        self.gravity = kin.gravity
        w, v = kin.twists[end]
        self.momentum = vec.add(g, vec.scale(g, self.m, v), vec.cross(g, w, self.h))
        hv = vec.dot(g, self.h, v)
        spun = vec.transpose(tuple(vec.cross(g, w, column) for column in self.second))  # type: ignore[arg-type]
        self.b = tuple(
            tuple(
                g.sub(
                    g.sub(hv, g.mul(v[i], self.h[k])) if i == k else g.neg(g.mul(v[i], self.h[k])),
                    spun[i][k],
                )
                for k in range(3)
            )
            for i in range(3)
        )

    def accelerated(self, a: Spatial) -> Spatial:
        """N = h × s + I z, f = m s + z × h."""
        g, (z, s) = self.g, a
        return (
            vec.add(g, vec.cross(g, self.h, s), vec.apply(g, self.inertia, z)),
            vec.add(g, vec.scale(g, self.m, s), vec.cross(g, z, self.h)),
        )

    def coriolis(self, a: Spatial) -> Spatial:
        """N = B z, f = z × P."""
        z, _ = a
        return vec.apply(self.g, self.b, z), vec.cross(self.g, z, self.momentum)  # type: ignore[arg-type]

    def weight(self) -> Spatial:
        """N = −h × a_g, f = −m a_g."""
        g, none = self.g, (self.g.zero,) * 3
        return (
            vec.cross(g, self.gravity, self.h),
            vec.sub(g, none, vec.scale(g, self.m, self.gravity)),
        )


def named(g: Graph, name: str, a: Vector) -> Vector:
    """Suggest name_x, name_y, name_z for the components of `a`."""
    for axis, node in zip("xyz", a, strict=True):
        g.name(node, f"{name}_{axis}")
    return a


def identity(g: Graph) -> Matrix:
    """Return the unit matrix."""
    return ((g.one, g.zero, g.zero), (g.zero, g.one, g.zero), (g.zero, g.zero, g.one))


def symmetric(entry) -> Matrix:  # type: ignore[no-untyped-def]
    """Return the matrix with entry(i, k), i ≤ k, on both sides of its diagonal."""
    e = {(i, k): entry(i, k) for i in range(3) for k in range(i, 3)}
    a, b, c = (tuple(e[min(i, k), max(i, k)] for k in range(3)) for i in range(3))
    return a, b, c  # type: ignore[return-value]


def rotated_symmetric(g: Graph, rotation: Matrix, m: Matrix) -> Matrix:
    """Return rotation · m · rotationᵀ of a symmetric m."""
    half = vec.product(g, rotation, m)
    return symmetric(lambda i, k: vec.dot(g, half[i], rotation[k]))


def motion_cross(g: Graph, a: Spatial, b: Spatial) -> Spatial:
    """(ω, v) × (z, s) = (ω × z, ω × s + v × z)."""
    return vec.cross(g, a[0], b[0]), vec.add(g, vec.cross(g, a[0], b[1]), vec.cross(g, a[1], b[0]))


def force_cross(g: Graph, a: Spatial, f: Spatial) -> Spatial:
    """(z, s) ×* (N, f) = (z × N + s × f, z × f)."""
    return vec.add(g, vec.cross(g, a[0], f[0]), vec.cross(g, a[1], f[1])), vec.cross(g, a[0], f[1])


def spatial_add(g: Graph, *terms: Spatial) -> Spatial:
    """Sum of spatial vectors."""
    return vec.add(g, *(t[0] for t in terms)), vec.add(g, *(t[1] for t in terms))


def spatial_scale(g: Graph, factor: Node, a: Spatial) -> Spatial:
    """factor · a."""
    return vec.scale(g, factor, a[0]), vec.scale(g, factor, a[1])


def pair_product(g: Graph, s: Spatial, f: Spatial) -> Node:
    """z · N + s · f."""
    return g.add(vec.dot(g, s[0], f[0]), vec.dot(g, s[1], f[1]))
