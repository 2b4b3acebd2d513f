"""Motion of one link's path about a common origin o: the part that depends on o, and not on the axes alone.

Coordinate k's axis is S_k = (z_k, s_k) with s_k = (p_k − o) × z_k, p_k a point on the axis (prismatic: z = 0,
s the direction). With the twist V_k = (ω, v) and the acceleration A_k, gravity included, before joint k:
    Ṡ_k = V_k × S_k        S̈_k = A_k × S_k + V_k × Ṡ_k
(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 2).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.dynamics.screws import Orientation, Spatial, motion_cross
from linkwise.expression import vector as vec
from linkwise.expression.expression_graph import Node, Vector
from linkwise.symbolic.system import RigidLink


@dataclass(frozen=True)
class Origin:
    """Origin o of the common frame: that of a frame of the tree, at rest; None: the centre of mass, moving.

    `by_points` finds each ṡ of a moving o from the velocity of a point on the axis relative to it: cheaper
    where axes keep their direction.
    """

    frame: int | None = None
    by_points: bool = False


@dataclass(frozen=True)
class Screw:
    """One joint of the path: its coordinate and label, S, Ṡ and S̈."""

    coordinate: int
    label: str
    s: Spatial
    sd: Spatial
    sdd: Spatial


@dataclass(frozen=True)
class LinkMotion:
    """Motion of one link in the common frame.

    m: its mass; com: its centre of mass from o; gravity: the gravity vector
    twist (ω, v) and acceleration (α, a − gravity) of the link; screws: those of its path, root first
    With `scaled`, lengths are in units of 1/√m, in which m is 1.
    """

    m: Node
    com: Vector
    gravity: Vector
    twist: Spatial
    acceleration: Spatial
    screws: tuple[Screw, ...]
    scaled: bool


def link_motion(turn: Orientation, link: RigidLink, chain: Sequence[int], origin: Origin) -> LinkMotion:
    """Return the motion of the link at the end of `chain`, the indices of its path in the tree of `turn`."""
    g, end = turn.g, chain[-1]
    mass = turn.lower(link.mass)
    # √m of a run-time parameter would have no gradient at 0, and a negative mass has none at all.
    value = g.value(mass)
    scaled = origin.frame is None and value is not None and value >= 0.0
    unit = g.call("sqrt", mass) if scaled else g.one
    gravity = vec.scale(g, unit, turn.gravity)
    x, y, z = (turn.lower(c) for c in link.com)
    com = vec.apply(g, turn.rotations[end], vec.scale(g, unit, (x, y, z)))
    path = _Path(turn, chain, unit)
    if origin.frame is None:
        places = path.places(end, vec.minus(g, com))
        com = vec.zero(g)
    else:
        places = path.places(origin.frame, vec.zero(g))
        com = vec.add(g, places[end], com)
    axes = [path.axis(f, places[f]) for f in chain]
    if origin.by_points:
        twists, rates = path.motion_of_points(axes, places)
    else:
        twists = path.twists_from_the_link(axes) if origin.frame is None else path.twists_from_the_base(axes)
        rates = [motion_cross(g, twist, axis) for twist, axis in zip(twists, axes, strict=False)]
    screws, a = path.screws(axes, rates, twists, gravity)
    return LinkMotion(
        g.one if scaled else mass, com, gravity, twists[-1], (turn.alpha[end], a), tuple(screws), scaled
    )


@dataclass(frozen=True)
class _Path:
    """The joints `chain` of a tree in common axes; lengths times `unit`."""

    turn: Orientation
    chain: Sequence[int]
    unit: Node

    def step(self, f: int) -> Vector:
        """Return the vector from the origin of the parent's frame to that of frame f."""
        g, turn = self.turn.g, self.turn
        return vec.apply(g, turn.rotations[turn.tree[f][0]], vec.scale(g, self.unit, turn.offset(f)))

    def places(self, start: int, at: Vector) -> dict[int, Vector]:
        """Return the origins of the frames of the chain.

        They are found from that of frame `start`, up to the base and out again.
        """
        g, tree = self.turn.g, self.turn.tree
        places, f = {start: at}, start
        while f >= 0:
            places[tree[f][0]] = vec.sub(g, places[f], self.step(f))
            f = tree[f][0]
        for f in self.chain:
            if f not in places:
                places[f] = vec.add(g, places[tree[f][0]], self.step(f))
        return places

    def axis(self, f: int, place: Vector) -> Spatial:
        """Return S = (z, s) of joint f."""
        g, turn = self.turn.g, self.turn
        if turn.tree[f][1].kind == "revolute":
            s = vec.cross(g, place, turn.z[f])
        else:
            s = vec.scale(g, self.unit, turn.slide[f])
        return turn.z[f], vec.named(g, f"s{turn.labels[f]}", s)

    def twists_from_the_base(self, axes: Sequence[Spatial]) -> list[Spatial]:
        """Return the twist before each joint, then the link's, about an o at rest: v = 0 at the base."""
        g, turn = self.turn.g, self.turn
        v = [vec.zero(g)]
        for f, (_, s) in zip(self.chain, axes, strict=True):
            move = vec.scale(g, turn.rate(f), s)
            v.append(vec.named(g, f"v{turn.labels[f]}", vec.add(g, v[-1], move)))
        return self._with_omega(v)

    def twists_from_the_link(self, axes: Sequence[Spatial]) -> list[Spatial]:
        """Return the twist before each joint, then the link's, about an o that moves with the link.

        v = 0 at the link.
        """
        g, turn = self.turn.g, self.turn
        v = [vec.zero(g)]
        for f, (_, s) in zip(reversed(self.chain), reversed(axes), strict=True):
            move = vec.scale(g, turn.rate(f), s)
            v.insert(0, vec.named(g, f"v{turn.label_before(f)}", vec.sub(g, v[0], move)))
        return self._with_omega(v)

    def _with_omega(self, v: Sequence[Vector]) -> list[Spatial]:
        turn = self.turn
        omegas = [turn.omega[turn.tree[f][0]] for f in self.chain] + [turn.omega[self.chain[-1]]]
        return list(zip(omegas, v, strict=True))

    def motion_of_points(
        self, axes: Sequence[Spatial], places: dict[int, Vector]
    ) -> tuple[list[Spatial], list[Vector]]:
        """Return the twist before each joint, then the link's, and each ṡ, by velocities u relative to o.

        With r the place of a frame and o moving: ṙ = u, u = ω × r for the link's own, u_parent = u − ω × step
        − slide q̇, and s = r × z gives ṡ = u × z + r × ż. The parent's v at o is u − ω × r.
        """
        g, turn, end = self.turn.g, self.turn, self.chain[-1]
        u = vec.cross(g, turn.omega[end], places[end])
        twists: list[Spatial] = [(turn.omega[end], vec.zero(g))]
        rates: list[Vector] = []
        for f, (z, s) in zip(reversed(self.chain), reversed(axes), strict=True):
            parent, joint = turn.tree[f]
            omega = turn.omega[parent]
            if joint.kind == "revolute":
                rate = vec.add(g, vec.cross(g, u, z), vec.cross(g, places[f], turn.zd[f]))
                u = vec.sub(g, u, vec.cross(g, omega, self.step(f)))
            else:
                rate = vec.cross(g, omega, s)
                slid = vec.scale(g, turn.rate(f), s)
                u = vec.sub(g, vec.sub(g, u, vec.cross(g, omega, self.step(f))), slid)
            rates.insert(0, rate)
            u = vec.named(g, f"u{turn.label_before(f)}", u)
            twists.insert(0, (omega, vec.sub(g, u, vec.cross(g, omega, places[parent]))))
        return twists, rates

    def screws(
        self, axes: Sequence[Spatial], rates: Sequence[Vector], twists: Sequence[Spatial], gravity: Vector
    ) -> tuple[list[Screw], Vector]:
        """Return S, Ṡ, S̈ of the path's joints, and the link's acceleration.

        The acceleration starts from −gravity, with a ← a + q̇ ṡ + q̈ s.
        """
        g, turn = self.turn.g, self.turn
        a = vec.minus(g, gravity)
        screws = []
        for f, axis, rate, twist in zip(self.chain, axes, rates, twists, strict=False):
            parent, joint = turn.tree[f]
            sd = turn.zd[f], vec.named(g, f"sd{turn.labels[f]}", rate)
            push = motion_cross(g, (turn.alpha[parent], a), axis)
            sdd = turn.zdd[f], vec.add(g, push, motion_cross(g, twist, sd))
            screws.append(Screw(joint.coordinate, turn.labels[f], axis, sd, sdd))
            qdd = turn.x.qdd[joint.coordinate]
            a = vec.add(g, a, vec.scale(g, turn.rate(f), sd[1]), vec.scale(g, qdd, axis[1]))
        return screws, a
