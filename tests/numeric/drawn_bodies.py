"""Bodies drawn at random, the torques that Pinocchio has for them, and the deviations of these."""

from typing import Any

import numpy as np
import pinocchio as pin
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

from numeric.pinocchio_model import PinocchioModel

DRAWS = 20_000


class Oracle:
    """Pinocchio's torques of bodies that are drawn, link by link."""

    def __init__(self, robot: Any, tree: Any) -> None:
        """Set up the oracle of a `PinocchioModel`, or of a model of the joints themselves."""
        if isinstance(robot, PinocchioModel):
            self.model, self.n, self.state, self.tie = robot.model, robot.n, robot._state, robot.tie
        else:
            self.model, self.n, self.tie = robot, robot.nv, np.eye(robot.nv)
            self.state = lambda *motion: motion
        self.data = self.model.createData()
        self.bodies = [self.model.getJointId(tree.joints[link.joint].name) for link in tree.links]

    def rows(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Y (n, N, 10) in the frames of Pinocchio's joints."""
        full = pin.computeJointTorqueRegressor(self.model, self.data, *self.state(q, qd, qdd))
        return (self.tie.T @ full).reshape(self.n, -1, 10)[:, [at - 1 for at in self.bodies]]

    def shares(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, Any, Any]:
        """Y of c2_ijk qdd_k and c1_ijk qd_k (n, N, n, 10) and of g_ij (n, N, 10), by differences."""
        rest, units = np.zeros(self.n), np.eye(self.n)
        weight, speed = self.rows(q, rest, rest), self.rows(q, qd, rest)
        c2 = np.stack([self.rows(q, rest, e) - weight for e in units], 2)
        # 1/2 dh/dqd_k = 1/2 (h(qd + e_k) - h(qd) - h(e_k)) of an h that is quadratic
        faster = [self.rows(q, qd + e, rest) - self.rows(q, e, rest) for e in units]
        c1 = np.stack([0.5 * (f - speed + weight) for f in faster], 2)
        return c2 * qdd[:, None], c1 * qd[:, None], weight

    def drawn(self, given: UncertainBodies, seed: int) -> Any:
        """Parameters of all links, (draws, N, 10), by the law that docs/method.md states."""
        draw, count = np.random.default_rng(seed), len(self.bodies)
        together = np.eye(count) if given.correlation is None else np.array(given.correlation)
        own = draw.multivariate_normal(np.zeros(count), together, DRAWS) * given.masses
        whole = 1.0 + given.body_mass * draw.normal(size=(DRAWS, 1)) * given.segments
        every = []
        for j, at in enumerate(self.bodies):
            inertia = self.model.inertias[at]
            m = np.full(DRAWS, inertia.mass)
            c = inertia.lever + given.centres[j] * draw.normal(size=(DRAWS, 3))
            moments = inertia.inertia
            plain = np.abs(moments - np.diag(np.diag(moments))).max() < 1e-9 * np.abs(moments).max()
            principal, axes = (np.diag(moments), np.eye(3)) if plain else np.linalg.eigh(moments)
            longer = 1.0 + given.radii[j] * draw.normal(size=(DRAWS, 3))
            i = np.einsum("dx,ax,bx->dab", longer**2 * principal, axes, axes)
            i += inertia.mass * (c**2).sum(1)[:, None, None] * np.eye(3)
            i -= inertia.mass * c[:, :, None] * c[:, None]
            entries = [i[:, a, b] for a, b in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
            heavier = (whole * (1.0 + own))[:, j, None]
            every.append(heavier * np.stack([m, *(m * x for x in c.T), *entries], 1))
        return np.stack(every, 1)


def agree(found: Any, drawn: Any) -> None:
    """Hold deviations to those of draws: within 5 % for 95 % of entries, within 20 % where they count."""
    found, drawn = np.ravel(found), np.ravel(drawn)
    there = drawn > 1e-10 * drawn.max()  # off the path, and where only rounding is
    assert found[~there].max(initial=0.0) <= 1e-10 * drawn.max()
    apart = np.abs(found[there] / drawn[there] - 1.0)
    assert np.quantile(apart, 0.95) <= 0.05
    assert apart[drawn[there] > 1e-3 * drawn.max()].max() <= 0.20
