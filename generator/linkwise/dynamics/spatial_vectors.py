"""Spatial vectors about one origin: motions (ω, v) and forces (N, f), as R. Featherstone has them.

R. Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 2.
"""

from dataclasses import dataclass

from linkwise.expression.expression import Expression
from linkwise.expression.vector import Vector


@dataclass(frozen=True, slots=True)
class ForceVector:
    """A wrench (N, f): a moment about the origin, and a force."""

    moment: Vector
    force: Vector

    def __add__(self, other: "ForceVector") -> "ForceVector":
        return ForceVector(self.moment + other.moment, self.force + other.force)

    def named(self, label: str) -> "ForceVector":
        """Suggest n and f with the label as variables of emitted code, and return the wrench."""
        self.moment.named(f"n{label}")
        self.force.named(f"f{label}")
        return self


@dataclass(frozen=True, slots=True)
class MotionVector:
    """A twist (ω, v), an acceleration (α, a), or a joint's axis (z, s): its turning, and what moves at o."""

    angular: Vector
    linear: Vector

    def dot(self, wrench: ForceVector) -> Expression:
        """Return z · N + s · f."""
        return self.angular.dot(wrench.moment) + self.linear.dot(wrench.force)

    def cross_linear(self, other: "MotionVector") -> Vector:
        """Return the linear part of (ω, v) × (z, s) = (ω × z, ω × s + v × z)."""
        return self.angular.cross(other.linear) + self.linear.cross(other.angular)

    def cross_force(self, wrench: ForceVector) -> ForceVector:
        """Return (z, s) ×* (N, f) = (z × N + s × f, z × f)."""
        z, s, n, f = self.angular, self.linear, wrench.moment, wrench.force
        return ForceVector(z.cross(n) + s.cross(f), z.cross(f))
