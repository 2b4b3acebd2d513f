"""Answer of `Dynamics.reactions`: the wrenches that joints carry, by cause."""

from typing import Generic, NamedTuple

from .interface import Array


class Reactions(NamedTuple, Generic[Array]):
    """Wrenches that joints carry, by cause: their sum is what the side of the ground exerts through a joint.

    The last axis has moments about x, y and z in N m, then forces along x, y and z in N. The first axis f
    after the samples is that of the joints of the tree that were asked for.

    Index k is the coordinate whose motion is the cause: of all n, or where ties are kept of the m independent
    ones, whose motion others follow. Shares are then of all that the joint carries, forces of ties included.
    """

    acceleration: Array
    """Shares of accelerations (..., F, N, n, 6): through link j, by the acceleration of k."""
    velocity: Array
    """Shares of velocities (..., F, N, n, 6): through link j, by the velocity of k (closing convention)."""
    gravity: Array
    """Shares of gravity (..., F, N, 6): by the weight of link j."""
    loads: Array
    """Shares of loads (..., F, L, 6): what each load asks of the joint."""
    passive: Array
    """Shares of spring, damping, friction and armature of coordinate i (..., F, 4, n, 6).

    They act within their joint, and in a tree change no wrench: zeros. Those of coordinates that follow
    others by ties change the forces of the ties, and so what all joints around carry.
    """

    @property
    def total(self) -> Array:
        """Sum of all shares: the wrench of each joint, (..., F, 6)."""
        by_link_and_cause = self.acceleration + self.velocity
        two = by_link_and_cause.sum((-3, -2)) + self.passive.sum((-3, -2))
        total: Array = two + self.gravity.sum(-2) + self.loads.sum(-2)
        return total
