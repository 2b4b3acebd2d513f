"""Screws: motions (ω, v) and forces (N, f) about one origin, and the directions of a tree of joints."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.dynamics.coefficients import Inputs
from linkwise.expression import vector as vec
from linkwise.expression.expression_graph import Graph, Matrix, Node, Vector
from linkwise.expression.from_sympy import Lowering
from linkwise.robot.robot import Joint, Rotation, Scalar

Spatial = tuple[Vector, Vector]


def motion_cross(g: Graph, a: Spatial, b: Spatial) -> Vector:
    """Return the linear part of (ω, v) × (z, s) = (ω × z, ω × s + v × z)."""
    return vec.add(g, vec.cross(g, a[0], b[1]), vec.cross(g, a[1], b[0]))


def force_cross(g: Graph, a: Spatial, f: Spatial) -> Spatial:
    """Return (z, s) ×* (N, f) = (z × N + s × f, z × f)."""
    return vec.add(g, vec.cross(g, a[0], f[0]), vec.cross(g, a[1], f[1])), vec.cross(g, a[0], f[1])


def spatial_add(g: Graph, a: Spatial, b: Spatial) -> Spatial:
    """Return a + b."""
    return vec.add(g, a[0], b[0]), vec.add(g, a[1], b[1])


def pair_product(g: Graph, s: Spatial, f: Spatial) -> Node:
    """Return z · N + s · f."""
    return g.add(vec.dot(g, s[0], f[0]), vec.dot(g, s[1], f[1]))


@dataclass(frozen=True)
class CommonAxes:
    """The axes that vectors are written in: those of a frame of the tree.

    Frame −1 is the base, frame f the one of the f-th link; `before` means just before the turn of its joint,
    which does not change the joint's own axis.
    """

    frame: int
    before: bool = False


class Orientation:
    """Rotations, joint axes and angular motion in common axes, shared by every link of a kernel.

    `tree` lists (parent, joint), parents first; parent −1 is the base. Dictionaries are keyed by frame, lists
    by joint: labels the number of its coordinate, from 1, z the axis times the joint's ratio (0 for a
    prismatic one), zd = ω × z and zdd = α × z + ω × zd with the angular velocity ω and acceleration α before
    the joint, slide the direction of a prismatic joint.
    """

    def __init__(
        self,
        lower: Lowering,
        tree: Sequence[tuple[int, Joint]],
        gravity: Sequence[Scalar],
        axes: CommonAxes,
        x: Inputs,
    ) -> None:
        self.g, self.lower, self.x, self.tree = lower.graph, lower, x, tree
        self.labels = _labels(tree)
        self._fixed = [self._constant(joint.rotation) for _, joint in tree]
        self._turns = [self._turn(f, joint) for f, (_, joint) in enumerate(tree)]
        self.rotations = self._orient(axes)
        gx, gy, gz = (lower(a) for a in gravity)
        self.gravity = vec.named(self.g, "ag", vec.apply(self.g, self.rotations[-1], (gx, gy, gz)))
        none = vec.zero(self.g)
        self.omega: dict[int, Vector] = {-1: none}
        self.alpha: dict[int, Vector] = {-1: none}
        self.z: list[Vector] = []
        self.zd: list[Vector] = []
        self.zdd: list[Vector] = []
        self.slide: list[Vector] = []
        for f in range(len(tree)):
            self._advance(f)

    def _constant(self, rotation: Rotation) -> Matrix:
        a, b, c = ((self.g.const(r[0]), self.g.const(r[1]), self.g.const(r[2])) for r in rotation)
        return a, b, c

    def _turn(self, f: int, joint: Joint) -> Matrix:
        """Return Rz(ratio · q) of a revolute joint, the identity of a prismatic one."""
        g = self.g
        if joint.kind == "prismatic":
            return vec.identity(g)
        angle = g.mul(g.const(joint.ratio), self.x.q[joint.coordinate])
        s = g.name(g.call("sin", angle), f"sin{self.labels[f]}")
        c = g.name(g.call("cos", angle), f"cos{self.labels[f]}")
        return ((c, g.neg(s), g.zero), (s, c, g.zero), (g.zero, g.zero, g.one))

    def _orient(self, axes: CommonAxes) -> dict[int, Matrix]:
        """Return the orientation of every frame, walking the tree away from the common one both ways."""
        g, at = self.g, axes.frame
        rotations = {at: self._turns[at] if axes.before else vec.identity(g)}
        unturned = vec.identity(g) if axes.before else None
        while at >= 0:
            parent = self.tree[at][0]
            if unturned is None:
                unturned = vec.product(g, rotations[at], vec.transpose(self._turns[at]))
            rotations[parent] = vec.product(g, unturned, vec.transpose(self._fixed[at]))
            at, unturned = parent, None
        for f, (parent, _) in enumerate(self.tree):
            if f not in rotations:
                fixed = vec.product(g, rotations[parent], self._fixed[f])
                rotations[f] = vec.product(g, fixed, self._turns[f])
        for f, label in enumerate(self.labels):
            for name, column in zip("zxy", (2, 0, 1), strict=True):
                vec.named(g, f"{name}{label}", vec.transpose(rotations[f])[column])
        return rotations

    def _advance(self, f: int) -> None:
        g, (parent, joint), label = self.g, self.tree[f], self.labels[f]
        none = vec.zero(g)
        direction = vec.scale(g, g.const(joint.ratio), vec.transpose(self.rotations[f])[2])
        revolute = joint.kind == "revolute"
        z = vec.named(g, f"z{label}", direction) if revolute else none
        omega, alpha = self.omega[parent], self.alpha[parent]
        zd = vec.named(g, f"zd{label}", vec.cross(g, omega, z))
        qd, qdd = self.x.qd[joint.coordinate], self.x.qdd[joint.coordinate]
        self.z.append(z)
        self.zd.append(zd)
        self.zdd.append(vec.add(g, vec.cross(g, alpha, z), vec.cross(g, omega, zd)))
        self.slide.append(none if revolute else direction)
        self.omega[f] = vec.named(g, f"w{label}", vec.add(g, omega, vec.scale(g, qd, z)))
        rate = vec.add(g, alpha, vec.scale(g, qdd, z), vec.scale(g, qd, zd))
        self.alpha[f] = vec.named(g, f"wd{label}", rate)

    def label_before(self, f: int) -> str:
        """Return the label of the joint that carries joint f; 0 for the base."""
        parent = self.tree[f][0]
        return self.labels[parent] if parent >= 0 else "0"

    def rate(self, f: int) -> Node:
        """Return q̇ of joint f's coordinate."""
        return self.x.qd[self.tree[f][1].coordinate]

    def offset(self, f: int) -> Vector:
        """Return the vector from the parent frame's origin to frame f's, in the parent's axes."""
        g, joint = self.g, self.tree[f][1]
        x, y, z = (self.lower(p) for p in joint.translation)
        if joint.kind == "revolute":
            return x, y, z
        slide = g.mul(g.const(joint.ratio), self.x.q[joint.coordinate])
        return vec.add(g, (x, y, z), vec.scale(g, slide, vec.transpose(self._fixed[f])[2]))


def _labels(tree: Sequence[tuple[int, Joint]]) -> list[str]:
    """Return the number of each joint's coordinate, from 1; several joints of one are 3, 3b, 3c, …"""
    labels: list[str] = []
    seen: Counter[int] = Counter()
    for _, joint in tree:
        k = joint.coordinate
        seen[k] += 1
        labels.append(f"{k + 1}" + ("" if seen[k] == 1 else _letter(seen[k])))
    return labels


def _letter(number: int) -> str:
    """Return the letters of a number: 2 → b, 3 → c, …, 27 → aa."""
    head, last = divmod(number - 1, 26)
    return (_letter(head) if head else "") + chr(ord("a") + last)
