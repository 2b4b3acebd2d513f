"""How large the numbers are that a partial torque is summed from: what its rounding is measured by.

The Newton–Euler recursion with lengths for vectors: sums add magnitudes, products multiply them, so that
nothing cancels. A torque that is 0 by geometry has no size of its own; of its operands, which have this one,
rounding leaves some 1e-16.
"""

from dataclasses import dataclass

import numpy as np

from linkwise.package.load import Array
from linkwise.package.manifest import BodyEntry, Manifest, RigidTree


@dataclass(frozen=True)
class _Sizes:
    """Of a frame: distance from the base, speed of its origin, |ω|, |α|, and |acceleration − gravity|."""

    reach: float = 0.0
    v: float = 0.0
    omega: float = 0.0
    alpha: float = 0.0
    a: float = 0.0


class Magnitudes:
    """Upper bounds for one motion of a manifest's rigid bodies; each of q, qd, qdd holds (n,) magnitudes."""

    def __init__(self, manifest: Manifest, tree: RigidTree) -> None:
        self.bodies = tree.bodies
        self.gravity = float(np.linalg.norm(tree.gravity))
        self.n = len(manifest.joints)
        index = {body.link: b for b, body in enumerate(self.bodies)}
        self.links = [index[link.name] for link in manifest.links]

    def partial_torque(self, q: Array, qd: Array, qdd: Array, gravity: bool = True) -> Array:
        """Bounds of |τ_ij|, shape (n, N)."""
        frames = self._frames(q, qd, qdd, self.gravity if gravity else 0.0)
        tau = np.zeros((self.n, len(self.links)))
        for j, at in enumerate(self.links):
            body, frame, lever = self.bodies[at], frames[at], _length(self.bodies[at].com)
            turning = frame.alpha + frame.omega**2
            force = body.mass * (frame.a + turning * lever)
            moment = float(np.linalg.norm(body.inertia)) * turning
            back: int | None = at
            while back is not None:
                upper = self.bodies[back]
                about = moment + (frame.reach + lever + frames[back].reach) * force
                tau[upper.coordinate, j] += abs(upper.ratio) * (about if upper.kind == "revolute" else force)
                back = upper.parent
        return tau

    def lagrangian(self, q: Array, qd: Array) -> Array:
        """Bounds of kinetic + |potential| energy of each link, shape (N,)."""
        frames = self._frames(q, qd, 0.0 * qd, 0.0)
        sizes = []
        for at in self.links:
            body, frame, lever = self.bodies[at], frames[at], _length(self.bodies[at].com)
            speed = frame.v + frame.omega * lever
            spin = float(np.linalg.norm(body.inertia)) * frame.omega**2
            sizes.append(
                0.5 * (body.mass * speed**2 + spin) + body.mass * self.gravity * (frame.reach + lever)
            )
        return np.array(sizes)

    def _frames(self, q: Array, qd: Array, qdd: Array, gravity: float) -> list[_Sizes]:
        frames: list[_Sizes] = []
        for body in self.bodies:
            up = _Sizes(a=gravity) if body.parent is None else frames[body.parent]
            turn, rate, change = (abs(body.ratio * float(x[body.coordinate])) for x in (q, qd, qdd))
            frames.append(_carried(body, up, turn, rate, change))
        return frames


def _carried(body: BodyEntry, up: _Sizes, turn: float, rate: float, change: float) -> _Sizes:
    sliding = body.kind == "prismatic"
    arm = _length(body.translation) + (turn if sliding else 0.0)
    v = up.v + up.omega * arm
    a = up.a + (up.alpha + up.omega**2) * arm
    if sliding:
        return _Sizes(up.reach + arm, v + rate, up.omega, up.alpha, a + 2 * up.omega * rate + change)
    return _Sizes(up.reach + arm, v, up.omega + rate, up.alpha + change + up.omega * rate, a)


def _length(vector: tuple[float, float, float]) -> float:
    return float(np.linalg.norm(vector))
