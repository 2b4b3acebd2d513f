"""Motion of one link's path about a common origin o: the part that depends on o, and not on the axes alone.

Coordinate k's axis is S_k = (z_k, s_k) with s_k = (p_k − o) × z_k, p_k a point on the axis (prismatic: z = 0,
s the direction). With the twist V_k = (ω, v) and the acceleration A_k, gravity included, before joint k:
    Ṡ_k = V_k × S_k        S̈_k = A_k × S_k + V_k × Ṡ_k
(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 2).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.dynamics.joint_chain import JointChain
from linkwise.dynamics.spatial_vectors import MotionVector
from linkwise.expression.expression import Expression
from linkwise.expression.vector import Vector, sum_of
from linkwise.symbolic.system import RigidLink


@dataclass(frozen=True)
class Origin:
    """Origin o of the common frame: that of a frame of the chain, at rest; None: the centre of mass, moving.

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
    s: MotionVector
    sd: MotionVector
    sdd: MotionVector


@dataclass(frozen=True)
class LinkMotion:
    """Motion of one link in the common frame.

    m: its mass; com: its centre of mass from o; gravity: the gravity vector
    twist (ω, v) and acceleration (α, a − gravity) of the link; screws: those of its path, root first
    """

    m: Expression
    com: Vector
    gravity: Vector
    twist: MotionVector
    acceleration: MotionVector
    screws: tuple[Screw, ...]


def link_motion(chain: JointChain, link: RigidLink, origin: Origin) -> LinkMotion:
    """Return the motion of the link at the end of `chain`.

    Where o is its centre of mass, lengths are in units of 1/√m, in which m is 1.
    """
    zero, end = Vector.zero(chain.graph), chain.frames[-1]
    mass = chain.scalar(link.mass)
    # √m of a run-time parameter would have no gradient at 0, and a negative mass has none at all.
    scaled = origin.frame is None and mass.value is not None and mass.value >= 0.0
    unit = mass.call("sqrt") if scaled else chain.one
    gravity = unit * chain.gravity
    com = chain.rotation[end] @ (unit * chain.vector(link.com))
    path = _Path(chain, unit)
    if origin.frame is None:
        places = path.places(end, -com)
        com = zero
    else:
        places = path.places(origin.frame, zero)
        com = places[end] + com
    axes = [path.axis(f, places[f]) for f in chain.frames]
    if origin.by_points:
        twists, rates = path.motion_of_points(axes, places)
    else:
        twists = path.twists_from_the_link(axes) if origin.frame is None else path.twists_from_the_base(axes)
        rates = [twist.cross_linear(axis) for twist, axis in zip(twists, axes, strict=False)]
    screws, a = path.screws(axes, rates, twists, gravity)
    acceleration = MotionVector(chain.alpha[end], a)
    return LinkMotion(chain.one if scaled else mass, com, gravity, twists[-1], acceleration, tuple(screws))


@dataclass(frozen=True)
class _Path:
    """A chain of joints in common axes; lengths times `unit`."""

    chain: JointChain
    unit: Expression

    def step(self, f: int) -> Vector:
        """Return the vector from the origin of frame f − 1 to that of frame f."""
        return self.chain.rotation[f - 1] @ (self.unit * self.chain.offset(f))

    def places(self, start: int, at: Vector) -> dict[int, Vector]:
        """Return the origins of all frames.

        They are found from that of frame `start`, up to the base and out again.
        """
        places = {start: at}
        for f in range(start, 0, -1):
            places[f - 1] = places[f] - self.step(f)
        for f in self.chain.frames[start:]:
            places[f] = places[f - 1] + self.step(f)
        return places

    def axis(self, f: int, place: Vector) -> MotionVector:
        """Return S = (z, s) of joint f."""
        chain, z = self.chain, self.chain.z[f]
        s = place.cross(z) if chain.joints[f].kind == "revolute" else self.unit * chain.slide[f]
        return MotionVector(z, s.named(f"s{chain.label[f]}"))

    def twists_from_the_base(self, axes: Sequence[MotionVector]) -> list[MotionVector]:
        """Return the twist before each joint, then the link's, about an o at rest: v = 0 at the base."""
        chain = self.chain
        v = [Vector.zero(chain.graph)]
        for f, axis in zip(chain.frames, axes, strict=True):
            v.append((v[-1] + chain.qd(f) * axis.linear).named(f"v{chain.label[f]}"))
        return self._with_omega(v)

    def twists_from_the_link(self, axes: Sequence[MotionVector]) -> list[MotionVector]:
        """Return the twist before each joint, then the link's, about an o that moves with the link.

        v = 0 at the link.
        """
        chain = self.chain
        v = [Vector.zero(chain.graph)]
        for f, axis in zip(reversed(chain.frames), reversed(axes), strict=True):
            v.insert(0, (v[0] - chain.qd(f) * axis.linear).named(f"v{chain.label_before(f)}"))
        return self._with_omega(v)

    def _with_omega(self, v: Sequence[Vector]) -> list[MotionVector]:
        return [MotionVector(self.chain.omega[f], linear) for f, linear in enumerate(v)]

    def motion_of_points(
        self, axes: Sequence[MotionVector], places: dict[int, Vector]
    ) -> tuple[list[MotionVector], list[Vector]]:
        """Return the twist before each joint, then the link's, and each ṡ, by velocities u relative to o.

        With r the place of a frame and o moving: ṙ = u, u = ω × r for the link's own, u_parent = u − ω × step
        − slide q̇, and s = r × z gives ṡ = u × z + r × ż. The parent's v at o is u − ω × r.
        """
        chain, end = self.chain, self.chain.frames[-1]
        u = chain.omega[end].cross(places[end])
        twists = [MotionVector(chain.omega[end], Vector.zero(chain.graph))]
        rates: list[Vector] = []
        for f, axis in zip(reversed(chain.frames), reversed(axes), strict=True):
            omega, z, s = chain.omega[f - 1], axis.angular, axis.linear
            if chain.joints[f].kind == "revolute":
                rate = u.cross(z) + places[f].cross(chain.zd[f])
                u = u - omega.cross(self.step(f))
            else:
                rate = omega.cross(s)
                slid = chain.qd(f) * s
                u = u - omega.cross(self.step(f)) - slid
            rates.insert(0, rate)
            u.named(f"u{chain.label_before(f)}")
            twists.insert(0, MotionVector(omega, u - omega.cross(places[f - 1])))
        return twists, rates

    def screws(
        self,
        axes: Sequence[MotionVector],
        rates: Sequence[Vector],
        twists: Sequence[MotionVector],
        gravity: Vector,
    ) -> tuple[list[Screw], Vector]:
        """Return S, Ṡ, S̈ of the path's joints, and the link's acceleration.

        The acceleration starts from −gravity, with a ← a + q̇ ṡ + q̈ s.
        """
        chain = self.chain
        a = -gravity
        screws = []
        for f, s, rate, twist in zip(chain.frames, axes, rates, twists, strict=False):
            label = chain.label[f]
            sd = MotionVector(chain.zd[f], rate.named(f"sd{label}"))
            push = MotionVector(chain.alpha[f - 1], a).cross_linear(s)
            sdd = MotionVector(chain.zdd[f], push + twist.cross_linear(sd))
            screws.append(Screw(chain.joints[f].coordinate, label, s, sd, sdd))
            a = sum_of(a, chain.qd(f) * sd.linear, chain.qdd(f) * s.linear)
        return screws, a
