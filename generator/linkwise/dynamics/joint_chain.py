"""The joints between the ground and a link, in common axes: what does not depend on the frame's origin."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.dynamics.link_forms import Inputs
from linkwise.expression.expression import Expression
from linkwise.expression.from_sympy import Lowering
from linkwise.expression.vector import Matrix, Vector, sum_of
from linkwise.robot.robot import Joint, Rotation, Scalar


@dataclass(frozen=True)
class CommonAxes:
    """The axes that vectors are written in: those of a frame of the chain.

    Frame 0 is the base, frame f the one that the chain's joint f moves; `before` means just before the turn
    of its joint, which does not change the joint's own axis.
    """

    frame: int
    before: bool = False


class JointChain:
    """Rotations, joint axes and angular motion of a chain of joints, in common axes.

    Everything is keyed by frame: 0 is the base, f is behind the chain's joint f, counted from 1, and f − 1
    before it. `label` is the number of the joint's coordinate, from 1; `rotation` goes from the frame's axes
    to the common ones; z is the axis times the joint's ratio (0 for a prismatic one), zd = ω × z and
    zdd = α × z + ω × zd with the angular velocity ω and acceleration α before the joint; `slide` is the
    direction of a prismatic joint. `omega` and `alpha` are those of the frame itself.
    """

    def __init__(
        self,
        lower: Lowering,
        joints: Sequence[Joint],
        gravity: Sequence[Scalar],
        axes: CommonAxes,
        x: Inputs,
    ) -> None:
        self.graph, self.inputs, self._lower = lower.graph, x, lower
        self.joints = dict(enumerate(joints, 1))
        self.frames = range(1, len(joints) + 1)
        self.label = dict(enumerate(_labels(joints), 1))
        self._fixed = {f: self._constant(joint.rotation) for f, joint in self.joints.items()}
        self._turn = {f: self._turned(f, joint) for f, joint in self.joints.items()}
        self.rotation = self._orient(axes)
        self.gravity = (self.rotation[0] @ self.vector(gravity)).named("ag")
        none = Vector.zero(self.graph)
        self.omega: dict[int, Vector] = {0: none}
        self.alpha: dict[int, Vector] = {0: none}
        self.z: dict[int, Vector] = {}
        self.zd: dict[int, Vector] = {}
        self.zdd: dict[int, Vector] = {}
        self.slide: dict[int, Vector] = {}
        for f in self.frames:
            self._advance(f)

    @property
    def zero(self) -> Expression:
        """The number 0."""
        return Expression(self.graph, self.graph.zero)

    @property
    def one(self) -> Expression:
        """The number 1."""
        return Expression(self.graph, self.graph.one)

    def scalar(self, value: Scalar) -> Expression:
        """Return a number, or an expression of run-time parameters."""
        return Expression(self.graph, self._lower(value))

    def vector(self, values: Sequence[Scalar]) -> Vector:
        """Return a vector of numbers, or of expressions of run-time parameters."""
        x, y, z = (self._lower(value) for value in values)
        return Vector(self.graph, x, y, z)

    def _constant(self, rotation: Rotation) -> Matrix:
        number = self.graph.const
        a, b, c = (Vector(self.graph, number(r[0]), number(r[1]), number(r[2])) for r in rotation)
        return Matrix(a, b, c)

    def _turned(self, f: int, joint: Joint) -> Matrix:
        """Return Rz(ratio · q) of a revolute joint, the identity of a prismatic one."""
        g = self.graph
        if joint.kind == "prismatic":
            return Matrix.identity(g)
        angle = joint.ratio * self.q(f)
        s = angle.call("sin").named(f"sin{self.label[f]}").node
        c = angle.call("cos").named(f"cos{self.label[f]}").node
        return Matrix(
            Vector(g, c, g.neg(s), g.zero), Vector(g, s, c, g.zero), Vector(g, g.zero, g.zero, g.one)
        )

    def _orient(self, axes: CommonAxes) -> dict[int, Matrix]:
        """Return the rotation of every frame, walking the chain away from the common one both ways."""
        start, identity = axes.frame, Matrix.identity(self.graph)
        rotation = {start: self._turn[start] if axes.before else identity}
        for f in range(start, 0, -1):
            unturned = identity if f == start and axes.before else rotation[f] @ self._turn[f].T
            rotation[f - 1] = unturned @ self._fixed[f].T
        for f in self.frames[start:]:
            rotation[f] = rotation[f - 1] @ self._fixed[f] @ self._turn[f]
        for f in self.frames:
            x, y, z = rotation[f].T
            for name, column in (("z", z), ("x", x), ("y", y)):
                column.named(f"{name}{self.label[f]}")
        return rotation

    def _advance(self, f: int) -> None:
        """Set the axis of joint f, and the angular motion behind it."""
        joint, label, none = self.joints[f], self.label[f], Vector.zero(self.graph)
        direction = joint.ratio * self.rotation[f].T[2]
        revolute = joint.kind == "revolute"
        z = direction.named(f"z{label}") if revolute else none
        omega, alpha = self.omega[f - 1], self.alpha[f - 1]
        zd = omega.cross(z).named(f"zd{label}")
        qd, qdd = self.qd(f), self.qdd(f)
        self.z[f], self.zd[f] = z, zd
        self.zdd[f] = alpha.cross(z) + omega.cross(zd)
        self.slide[f] = none if revolute else direction
        self.omega[f] = (omega + qd * z).named(f"w{label}")
        self.alpha[f] = sum_of(alpha, qdd * z, qd * zd).named(f"wd{label}")

    def label_before(self, f: int) -> str:
        """Return the label of the joint before joint f; 0 for the base."""
        return self.label.get(f - 1, "0")

    def q(self, f: int) -> Expression:
        """Return q of joint f's coordinate."""
        return self.inputs.q[self.joints[f].coordinate]

    def qd(self, f: int) -> Expression:
        """Return q̇ of joint f's coordinate."""
        return self.inputs.qd[self.joints[f].coordinate]

    def qdd(self, f: int) -> Expression:
        """Return q̈ of joint f's coordinate."""
        return self.inputs.qdd[self.joints[f].coordinate]

    def offset(self, f: int) -> Vector:
        """Return the vector from the origin of frame f − 1 to that of frame f, in the axes of frame f − 1."""
        joint = self.joints[f]
        translation = self.vector(joint.translation)
        if joint.kind == "revolute":
            return translation
        return translation + (joint.ratio * self.q(f)) * self._fixed[f].T[2]


def _labels(joints: Sequence[Joint]) -> list[str]:
    """Return the number of each joint's coordinate, from 1; several joints of one are 3, 3b, 3c, …"""
    labels: list[str] = []
    seen: Counter[int] = Counter()
    for joint in joints:
        k = joint.coordinate
        seen[k] += 1
        labels.append(f"{k + 1}" + ("" if seen[k] == 1 else _letter(seen[k])))
    return labels


def _letter(number: int) -> str:
    """Return the letters of a number: 2 → b, 3 → c, …, 27 → aa."""
    head, last = divmod(number - 1, 26)
    return (_letter(head) if head else "") + chr(ord("a") + last)
