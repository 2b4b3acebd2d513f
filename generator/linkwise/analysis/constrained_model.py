"""A model of tied joints, expressed in the independent ones: torques of the dependent joints are zero.

tau^_aj = sum_i G_ia tau_ij = sum_b c2^_ajb ydd_b + sum_b c1^_ajb yd_b + g^_aj
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.analysis.term_rows import TermArrays, mirrored
from linkwise.arrays import Array, Index


@dataclass(frozen=True)
class Following:
    """The independent joints, and for each joint the independent joints that move it."""

    independent: tuple[int, ...]
    movers: tuple[frozenset[int], ...]
    """Independent joints that move each joint; an independent joint moves itself."""


@dataclass(frozen=True)
class ConstrainedModel:
    """A model with tied joints, with the calls that an analysis makes.

    Motion (S, n) is that of all joints, in which ties close.
    """

    open: Dynamics
    """Model of the tree without ties."""
    constraints: Any
    """The package's `Constraints`."""
    following: Following
    layout: TermArrays

    @classmethod
    def of(cls, model: Dynamics, rows: Sequence[frozenset[int]]) -> "ConstrainedModel":
        """Return the model with the ties of its own description; rows: coordinates that each relates."""
        constraints = model.constraints
        independent = tuple(list(model.joint_names).index(name) for name in constraints.independent)
        following = Following(independent, movers(rows, len(model.joint_names), independent))
        return cls(model, constraints, following, _layout(model.layout, following))

    def __getattr__(self, name: str) -> Any:
        """Return what ties do not change: names, and attributes of the open tree."""
        return getattr(self.open, name)

    def at(self, **values: Any) -> "ConstrainedModel":
        """Return the model at a time, or with inputs, as `Dynamics.at` does."""
        open_one = self.open.at(**values)
        return replace(self, open=open_one, constraints=open_one.constraints)

    @property
    def kinematics(self) -> "ConstrainedKinematics":
        """Kinematics of the open tree, in which the independent joints carry the loads."""
        return ConstrainedKinematics(self.open.kinematics, self._projected)

    def consistent(self, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array, Array]:
        """Return q, qd, qdd (S, n) in which ties close, from the motion of the independent joints.

        q of the dependent joints is an initial guess.
        """
        own = list(self.following.independent)
        q = _array(self.constraints.closed(q))
        qd = _array(self.constraints.velocity(q, qd[..., own]))
        return q, qd, _array(self.constraints.acceleration(q, qd, qdd[..., own]))

    def packed(self, q: Array, qd: Array, qdd: Array) -> TermArrays:
        """Return all coefficients and tau^_aj, packed in the order of `layout`."""
        cubes = (_array(a) for a in self.constraints.coefficients(q, qd))
        torque = _array(self.constraints.partial_torque(q, qd, qdd))
        acceleration, velocity, gravity = cubes
        place = np.zeros(len(self.open.joint_names), dtype=np.intp)
        place[list(self.following.independent)] = np.arange(len(self.following.independent))

        def taken(cube: Array, rows: Index) -> Array:
            i, j, *k = rows.T
            found: Array = cube[(..., place[i], j, *(place[other] for other in k))]
            return found

        return TermArrays(
            taken(acceleration, self.layout.acceleration),
            taken(velocity, self.layout.velocity),
            taken(gravity, self.layout.gravity),
            taken(torque, self.layout.torque),
        )

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return tau^_a summed over all links, (S, n)."""
        return self._spread(_array(self.constraints.inverse_dynamics(q, qd, qdd)))

    def propagation(self, q: Array, qd: Array, qdd: Array, convention: str = "closing") -> TermArrays:
        """Return the parts of tau^_aj by q̈_k and by q̇_k, (S, n, N, n) each, and g^_aj, (S, n, N).

        In the gradient convention, of rigid links, the parts by velocity are twice those of the closing one.
        """
        acceleration, velocity, gravity = map(_array, self.constraints.propagation(q, qd, qdd))
        share = 2.0 if convention == "gradient" else 1.0
        cubes = (self._spread(self._spread(a, 1), -1) for a in (acceleration, share * velocity))
        return TermArrays(next(cubes), next(cubes), self._spread(gravity, 1), torque=None)

    def passive_torque(self, q: Array, qd: Array, qdd: Array) -> tuple[Array, ...]:
        """Return the passive torques of all joints, projected on the independent ones, (S, n) each.

        They are those of springs, losses and armatures.
        """
        return tuple(self._projected(q, _array(a)) for a in self.open.passive_torque(q, qd, qdd))

    def named_shares(self, q: Array, qd: Array) -> Array:
        """Return the shares with names of tau^_aj, (S, n, N, count)."""
        own = _array(self.open.named_shares(q, qd))
        projected = _array(self.constraints.projected(q, own.reshape(*own.shape[:2], -1), by_link=True))
        return self._spread(projected.reshape(*projected.shape[:2], *own.shape[2:]), 1)

    def regressor(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the regressor Y^ of tau^_aj = Y^_aj pi_j, (S, n, N, 10), zero for dependent joints."""
        own = _array(self.open.regressor(q, qd, qdd))
        flat = own.reshape(*own.shape[:2], -1)
        projected = _array(self.constraints.projected(q, flat, by_link=True))
        return self._spread(projected.reshape(*projected.shape[:2], *own.shape[2:]), 1)

    def velocity_map(self, q: Array) -> Array:
        """Return G with its columns in the places of the independent joints, (S, n, n)."""
        return self._spread(_array(self.constraints.velocity_map(q)))

    def forces(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the constraint forces due to each link, (S, C, N)."""
        return _array(self.constraints.forces(q, qd, qdd))

    def forces_of(self, q: Array, torque: Array) -> Array:
        """Return the constraint forces due to torques (S, n, X) on all joints, (S, C, X)."""
        return _array(self.constraints.forces_of(q, torque, by_link=True))

    def _projected(self, q: Array, torque: Array) -> Array:
        """Return G^T torque in the places of the independent joints, (S, n)."""
        return self._spread(_array(self.constraints.projected(q, torque)))

    def _spread(self, values: Array, axis: int = -1) -> Array:
        """Return values of independent joints on an axis of all joints, zero for the dependent ones."""
        shape = list(values.shape)
        shape[axis] = len(self.open.joint_names)
        out = np.zeros(shape)
        np.moveaxis(out, axis, 0)[list(self.following.independent)] = np.moveaxis(values, axis, 0)
        return out


class ConstrainedKinematics:
    """The kinematics of a tree whose joints are tied."""

    def __init__(self, own: Any, projected: Callable[[Array, Array], Array]) -> None:
        self._own, self._projected = own, projected

    def __getattr__(self, name: str) -> Any:
        return getattr(self._own, name)

    def load_torque(self, q: Array, *load: Any, **options: Any) -> Array:
        """Return the torques of the independent joints that carry a load, (S, n)."""
        return self._projected(q, _array(self._own.load_torque(q, *load, **options)))


def tied_in_tree(tree: JointTree) -> list[frozenset[int]]:
    """Return the coordinates that each tie and each coupling of a tree relates."""
    paths: list[frozenset[int]] = []
    for joint in tree.joints:
        before = frozenset[int]() if joint.parent is None else paths[joint.parent]
        paths.append(before | {joint.coordinate})

    def path(frame: int) -> frozenset[int]:
        carrier = tree.frames[frame].joint
        return frozenset() if carrier is None else paths[carrier]

    rows = [path(tie.first) ^ path(tie.second) for tie in tree.ties]
    return rows + [frozenset(k for k, _ in coupling.terms) for coupling in tree.couplings]


def movers(rows: Sequence[frozenset[int]], n: int, independent: Sequence[int]) -> tuple[frozenset[int], ...]:
    """Return, for each joint, the independent joints that may move it.

    rows: coordinates that each row of the constraints relates. Dependent joints in one row, or in rows that
    share a dependent joint, form a group that all independent joints of its rows may move.
    """
    own = frozenset(independent)
    groups: list[frozenset[int]] = []
    for row in rows:
        joined = [group for group in groups if group & row - own]
        groups = [group for group in groups if group not in joined] + [row.union(*joined)]
    found = {k: group & own for group in groups for k in group - own}
    return tuple(frozenset({k}) if k in own else found.get(k, frozenset()) for k in range(n))


def _layout(own: Any, following: Following) -> TermArrays:
    """Return the rows of the values that are not zero for all motion.

    c2^ comes from c2; c1^ comes from c1, and from c2 where k is dependent, since its part of G changes.
    """
    movers, independent = following.movers, set(following.independent)

    def moved(rows: Index) -> set[tuple[int, ...]]:
        return {
            (mover, j, *more)
            for i, j, *k in rows.tolist()
            for mover, *more in product(movers[i], *(movers[e] for e in k))
        }

    inertia = _rows({row[:3] for row in mirrored(own)}, 3)
    changing = inertia[[k not in independent for k in inertia[:, 2]]]
    acceleration = _rows({row for row in moved(inertia) if row[0] <= row[2]}, 3)
    velocity = _rows(moved(own.velocity) | moved(changing), 3)
    return TermArrays(acceleration, velocity, _rows(moved(own.gravity), 2), _rows(moved(own.torque), 2))


def _rows(found: set[tuple[int, ...]], width: int) -> Index:
    return np.array(sorted(found), dtype=np.intp).reshape(-1, width)


def _array(values: Any) -> Array:
    return np.asarray(values)
