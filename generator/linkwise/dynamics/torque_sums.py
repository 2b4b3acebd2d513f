"""Torques from their own coefficients: τ_ij = g_ij + Σ_k (c2_ijk q̈_k + c1_ijk q̇_k).

A decomposition has the coefficients at hand. On short paths τ costs less as this sum, two products for each
(i, k); on long ones by the link's wrench, which is computed once. The sum is taken column by column: after
joint k there is one value of τ for each joint i, however many coefficients there are.
"""

from collections.abc import Mapping

from linkwise.dynamics.link_forms import Inputs
from linkwise.expression.count import count_operations
from linkwise.expression.expression import Expression

Pairs = Mapping[tuple[int, int], Expression]


class TorqueSums:
    """Growing sums: `tau`[i] is the torque on joint i of gravity and of the columns added so far.

    gravity: g_ij, by joint, coordinates ascending
    """

    def __init__(self, x: Inputs, gravity: Mapping[int, Expression]) -> None:
        self.x, self._gravity = x, gravity
        self.tau = dict(gravity)
        self._steps = [(g, f"g_{i + 1}") for i, g in gravity.items()]

    def add(self, k: int, c2: Pairs, c1: Pairs) -> None:
        """Add column k; its c2 (i, k) for i ≤ k and c1 (i, k) must be complete, and columns come in order."""
        x = self.x
        for i in self.tau:
            if i <= k:
                self.tau[i] += c2[i, k] * x.qdd[k]
            if i < k:  # by symmetry: c2 (k, i)
                self.tau[k] += c2[i, k] * x.qdd[i]
            self.tau[i] += c1[i, k] * x.qd[k]
        self._steps += [(tau, f"tau{i + 1}_{k + 1}") for i, tau in self.tau.items()]

    def if_cheaper(self, torque: dict[int, Expression], c2: Pairs, c1: Pairs) -> dict[int, Expression]:
        """Return the sums if they cost less than `torque` beside the coefficients, else `torque`."""
        known = [*c2.values(), *c1.values(), *self._gravity.values()]
        graph = known[0].graph
        summed, other = (
            count_operations(graph, [value.node for value in (*known, *t.values())]).arithmetic
            for t in (self.tau, torque)
        )
        if summed >= other:
            return torque
        self._name(c2, c1)
        return self.tau

    def _name(self, c2: Pairs, c1: Pairs) -> None:
        """Suggest names for the coefficients and for each joint's sums except the last: c1_3_4, tau3_4."""
        for prefix, pairs in (("c2", c2), ("c1", c1)):
            for (i, k), value in pairs.items():
                value.named(f"{prefix}_{i + 1}_{k + 1}")
        whole = set(self.tau.values())
        for value, name in self._steps:
            if value not in whole:
                value.named(name)
