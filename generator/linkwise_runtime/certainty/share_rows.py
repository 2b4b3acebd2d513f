"""Rows by which the links' inertial parameters give shares: of torques, of coefficients, of what joints bear.

Every share through link j is linear in pi_j, so that its row is what ten unit bodies make of it, one for each
parameter: one way for open trees and for joints that are tied. A body has no first moment without mass:

    row of m c_a = share of (m = 1, c = e_a, I = 0) - share of (m = 1, c = 0, I = 0)

with the inertia I about the origin, which makes that about the centre negative.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np

from ..arrays.backend import ArrayBackend
from ..chosen_names import listed, position_of
from ..constraints.independent_joints import loose_base
from ..constraints.robot_constraints import Constraints
from ..interface import Numbers, array_of
from ..quantities import PARAMETERS
from ..rule.joint_tree import Bodies, JointTree
from ..rule.regressors import inertial_parameters
from ..rule.tree_arrays import formula_sources, given_numbers, own_numbers
from .pseudo_inertia import MOMENTS, Floats
from .random_motions import Motion, random_closed_motion, random_motion

ROWS = 4
"""Rows of random motion for each column."""
ShareArrays = Mapping[str, Floats]
"""Rows by kind: torque and gravity (S, m, N, 10), acceleration and velocity (S, m, N, m, 10), reactions
(S, F, N, 6, 10), for m joints with a torque of their own and F joints of the tree."""


class RigidRobot(Protocol):
    """Attributes of a robot of rigid links that its rows need."""

    name: str
    joint_names: tuple[str, ...]
    link_names: tuple[str, ...]
    backend: ArrayBackend

    @property
    def tree_joint_names(self) -> tuple[str, ...]:
        """Names of the tree's joints."""

    @property
    def constraints(self) -> Constraints[Any]:
        """Constraints of the robot's file."""

    def coefficients(self, q: Any, qd: Any) -> tuple[Any, Any, Any]:
        """Return c2, c1 and g by link."""

    def partial_torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Return tau_ij."""

    def reactions(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Return the wrenches that joints carry, by cause."""


OnNumpy = Callable[[Bodies[Floats] | None], RigidRobot]
"""Function that returns the robot on NumPy by the rule for rigid links, with bodies in place of its own."""


@dataclass(frozen=True, eq=False)
class LinearRobot:
    """A robot whose shares are rows of the parameters of its links."""

    robot: RigidRobot
    units: RigidRobot
    """Robot whose links carry the unit bodies, one for each of ten samples."""
    tree: JointTree
    parameters: Floats
    """Parameters pi of its links, (N, 10)."""

    @classmethod
    def of(cls, robot: RigidRobot, on_numpy: OnNumpy) -> "LinearRobot":
        """Return the robot's rows; raise ValueError for links given by energies, and for many robots."""
        tree = _rigid_tree(robot)
        own = inertial_parameters(_own_bodies(robot.backend, tree))
        return cls(on_numpy(None), on_numpy(_unit_bodies(len(tree.links))), tree, own)

    @property
    def is_tied(self) -> bool:
        """True if the robot's file ties joints: shares are then those of the independent ones."""
        return self.robot.backend.ties_joints

    @property
    def own(self) -> list[int]:
        """Coordinates with a torque of their own: all, or the independent ones where joints are tied."""
        if self.is_tied:
            return list(self.robot.constraints.ties.chosen.independent)
        return list(range(len(self.robot.joint_names)))

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the m joints with a torque of their own."""
        return tuple(self.robot.joint_names[k] for k in self.own)

    def measured(self, given: object) -> list[int]:
        """Return the places, among `joints`, of those whose torques are measured; all that something drives.

        Raises ValueError for a joint that is not there or follows others, and where none is left.
        """
        if given is None:
            floating = set(loose_base(self.tree))
            found = [at for at, k in enumerate(self.own) if k not in floating]
            if not found:
                raise ValueError(f"nothing drives a joint of {self.robot.name}; name those with `measured`")
            return found
        several = [given] if isinstance(given, str) or not isinstance(given, list | tuple) else list(given)
        places = [position_of(one, self.robot.joint_names, "joint", "measured") for one in several]
        if not places:
            raise ValueError(f"measured is empty; name some of {listed(self.joints)}")
        follows = [self.robot.joint_names[k] for k in places if k not in self.own]
        if follows:
            raise ValueError(
                f"measured names {listed(follows)}, which follows others by ties: its torque counts in that "
                f"of the independent joints; choose among {listed(self.joints)}"
            )
        return sorted({self.own.index(k) for k in places})

    def random_motion(self, torques: int) -> Motion:
        """Return random motions (S, n) of enough samples for so many torques each, in which ties close."""
        samples = -(-ROWS * self.parameters.size // torques) + ROWS
        if not self.is_tied:
            return random_motion(len(self.robot.joint_names), samples)
        ties = self.robot.constraints
        return random_closed_motion(ties, ties.closed_position.reshape(1, -1), samples)

    def torque_rows(self, motion: Sequence[Floats]) -> Floats:
        """Return rows of the torques through all links, (S, m, N, 10), for q, qd, qdd (S, n)."""
        robot = self.units.constraints if self.is_tied else self.units
        return self._rows(robot.partial_torque(*_ten_times(motion)))

    def share_rows(self, motion: Sequence[Floats], reactions: bool = True) -> ShareArrays:
        """Return rows of all shares for q, qd, qdd (S, n); reactions: whether those of joints are there."""
        q, qd, qdd = _ten_times(motion)
        robot = self.units.constraints if self.is_tied else self.units
        names = ("acceleration", "velocity", "gravity")
        found = dict(zip(names, map(self._rows, robot.coefficients(q, qd)), strict=True))
        found["torque"] = self._rows(robot.partial_torque(q, qd, qdd))
        if reactions:
            borne = self.units.reactions(q, qd, qdd)
            moved = (borne.acceleration + borne.velocity).sum(-2)
            found["reactions"] = self._rows(moved + borne.gravity)
        return found

    def _rows(self, answers: Floats) -> Floats:
        """Return rows (S, ..., 10) of the answers (10, S, ...) for the unit bodies."""
        rows = np.moveaxis(np.asarray(answers, dtype=float), 0, -1).copy()
        rows[..., 1:4] -= rows[..., :1]
        return rows


def _rigid_tree(robot: RigidRobot) -> JointTree:
    """Return the tree of one robot of rigid links; raise ValueError for any other."""
    backend = robot.backend
    if backend.tree is None or not backend.regresses:
        what = f"the links of {robot.name}" + (f" on {backend.name}" if backend.tree is not None else "")
        raise ValueError(
            f"{what} are energies, which have no ten inertial parameters that torques could determine; "
            "rigid links on numpy, torch or native have"
        )
    if backend.samples:
        raise ValueError(
            f"{robot.name} was loaded with samples of parameters or bodies, which are many robots; load it "
            "with one number for each"
        )
    return backend.tree


def _own_bodies(backend: ArrayBackend, tree: JointTree) -> Bodies[Floats]:
    """Return the bodies that the links carry, for the run-time parameters that were given."""
    if backend.bodies is not None:
        return Bodies(*(array_of(a).astype(float) for a in backend.bodies))
    values = {name: np.asarray(array_of(cast(Numbers, value))) for name, value in backend.parameters.items()}
    sources = own_numbers(tree), cast(Numbers, formula_sources(tree))
    found = given_numbers(cast(Any, np), tree, sources, cast(Mapping[str, Numbers], values), None, ())
    masses, centres, inertias = (np.asarray(a)[..., 0] for a in found.bodies)
    return Bodies(masses, centres.T, np.moveaxis(inertias, -1, 0))


def _unit_bodies(links: int) -> Bodies[Floats]:
    """Return bodies (10, 1, links) of one parameter each, those of first moments with a mass of 1 too."""
    masses, centres, inertias = np.zeros(PARAMETERS), np.zeros((PARAMETERS, 3)), np.zeros((PARAMETERS, 3, 3))
    masses[:4] = 1.0
    centres[1:4] = np.eye(3)
    inertias[1:4] = np.eye(3)[:, :, None] * np.eye(3)[:, None] - np.eye(3)
    for at, (a, b) in enumerate(MOMENTS, 4):
        inertias[at, a, b] = inertias[at, b, a] = 1.0
    found = (np.repeat(a[:, None, None], links, 2) for a in (masses, centres, inertias))
    return Bodies(*found)


def _ten_times(motion: Sequence[Floats]) -> list[Floats]:
    """Return q, qd and qdd (10, S, n), the same for every unit body."""
    return [np.broadcast_to(a, (PARAMETERS, *a.shape)).copy() for a in motion]
