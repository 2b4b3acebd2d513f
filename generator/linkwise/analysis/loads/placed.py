"""A load on a robot: its samples at the motion's instants and in the world, and its joint torques.

A load that is given entirely in the world is kept as its wrench about the world's origin, because a force
plate measures that. The wrench is filtered and interpolated, so that a centre of pressure which jumps while
nothing presses does no harm. For other loads, force, moment and point are interpolated separately.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree, TreeFrame

from linkwise.analysis.loads import FORCE, MOMENT, POINT, WORLD
from linkwise.analysis.named_bodies import body_frame
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError

Pose = Callable[[TreeFrame, Array], Array]
"""Function that returns the homogeneous matrices (S, 4, 4) of a frame at q (S, n)."""


class Wrench(NamedTuple):
    """Force, moment about `place`, and that place, in the world: (S, 3) each, in N, N·m, m."""

    force: Array
    moment: Array
    place: Array


class LoadShift(NamedTuple):
    """Change of a load in the axes in which it is given, (3,) each: in N, of its free moment in N·m, in m."""

    force: Array = np.zeros(3)
    moment: Array = np.zeros(3)
    point: Array = np.zeros(3)


NO_SHIFT = LoadShift()


@dataclass(frozen=True)
class LoadFrame:
    """Frame on which a load acts, and the frames in which its numbers are given, None for the world."""

    frame: TreeFrame
    axes: TreeFrame | None
    point_in: TreeFrame | None
    joints: tuple[int, ...]
    """Index of the coordinates that move the body."""

    @property
    def in_world(self) -> bool:
        """True if all is given in the world, so that the moments of a table are about its origin."""
        return self.axes is None and self.point_in is None


@dataclass(frozen=True, eq=False)
class PlacedWrench:
    """A force and a moment on one body, over time."""

    acts_on: LoadFrame
    table: Array
    """Rows of time, force, moment, point (S, 10); moments are about the origin if all is in the world."""
    shift: LoadShift = NO_SHIFT
    """Addition to every row, as errors are."""

    def wrench(self, time: Array, q: Array, pose: Pose) -> Wrench:
        """Return the wrench that acts at instants (S,) with the robot at q (S, n)."""
        rows, load_frame = rows_at(self.table, time), self.acts_on
        force, moment, point = rows[:, FORCE], rows[:, MOMENT], rows[:, POINT]
        if load_frame.in_world:
            moment = moment - np.cross(point, force)
        force, moment, point = (a + b for a, b in zip((force, moment, point), self.shift, strict=True))
        if load_frame.in_world:
            return Wrench(force, moment, point)
        if load_frame.axes is not None:
            turn = pose(load_frame.axes, q)[:, :3, :3]
            force, moment = (np.einsum("sab,sb->sa", turn, a) for a in (force, moment))
        if load_frame.point_in is not None:
            at = pose(load_frame.point_in, q)
            point = np.einsum("sab,sb->sa", at[:, :3, :3], point) + at[:, :3, 3]
        return Wrench(force, moment, point)

    def torque(self, model: Dynamics, time: Array, q: Array) -> Array:
        """Return the joint torques (S, n) that the wrench requires, in N·m or N."""
        force, moment, place = self.wrench(time, q, model_pose(model))
        found: Any = model.kinematics.load_torque(q, self.acts_on.frame.name, force, moment, at=place)
        return np.asarray(found)


@dataclass(frozen=True, eq=False)
class PlacedLoad:
    """A load that a robot carries: a wrench from outside, or what a muscle does to the bodies it spans."""

    name: str
    wrenches: tuple[PlacedWrench, ...]
    source: str
    """Name of the file that it is from, "" for none."""
    cutoff: float | None = None
    """Cutoff in Hz of the low-pass filter that was applied, None for none."""
    warnings: tuple[str, ...] = ()
    """Warnings about the file; each names it."""
    kind: Literal["load", "muscle", "actuator"] = "load"
    efforts: Array | None = None
    """Rows of time, then of generalized forces on the coordinates (S, 1 + n), in N·m or N;
    None for none."""
    is_inside: bool = False
    """True if the wrenches are in balance, so that coordinates that move all bodies alike bear nothing."""
    unfiltered: "PlacedLoad | None" = None
    """The load before its low-pass filter; None where none was applied."""

    @property
    def as_measured(self) -> "PlacedLoad":
        """Load by which a threshold tells when it acts: a filter spreads steep edges, and rings there."""
        return self if self.unfiltered is None else self.unfiltered

    @cached_property
    def joints(self) -> tuple[int, ...]:
        """Index of the coordinates on which the load may act."""
        moved = [frozenset(one.acts_on.joints) for one in self.wrenches]
        found = frozenset[int]().union(*moved)
        if self.is_inside and moved:
            found -= moved[0].intersection(*moved)
        given = [] if self.efforts is None else np.flatnonzero(self.efforts[:, 1:].any(axis=0)).tolist()
        return tuple(sorted(found.union(given)))

    @property
    def is_muscle(self) -> bool:
        """True for what acts between the bodies of the robot: muscles, and actuators of their file."""
        return self.kind != "load"

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies on which it acts."""
        return tuple(one.acts_on.frame.name for one in self.wrenches)

    @property
    def label(self) -> str:
        """Name in figures, where a load on the foot differs from the foot's own share."""
        return f"{self.kind} {self.name}"

    def torque(self, model: Dynamics, time: Array, q: Array) -> Array:
        """Return the joint torques τ_ie (S, n) that the load requires, in N·m or N."""
        found = sum((one.torque(model, time, q) for one in self.wrenches), np.zeros_like(q))
        if self.efforts is None:
            return found
        return found - self.effort(time)

    def effort(self, time: Array) -> Array:
        """Return the generalized forces (S, n) on the coordinates at instants (S,)."""
        assert self.efforts is not None
        return rows_at(self.efforts, time)[:, 1:]

    def off_by(self, shift: LoadShift) -> "PlacedLoad":
        """Return the load with its wrench off by a shift."""
        return replace(self, wrenches=tuple(replace(one, shift=shift) for one in self.wrenches))

    def record(self) -> dict[str, Any]:
        """Return the load as plain data, to record in the outputs."""
        where: dict[str, Any] = (
            {"kind": self.kind, "bodies": list(self.bodies)} if self.is_muscle else {"body": self.bodies[0]}
        )
        return {"name": self.name, **where, "file": self.source, "cutoff": self.cutoff}


def rows_at(table: Array, time: Array) -> Array:
    """Return rows (S, columns) of a table at instants (S,), linear between those of its column 0."""
    own = table[:, 0]
    low = max(0, int(np.searchsorted(own, time[0], side="right")) - 1)
    some = table[low : int(np.searchsorted(own, time[-1])) + 1]
    if len(table) == 1 or not len(some):
        some = table[-1:]
    return np.stack([np.interp(time, some[:, 0], column) for column in some.T], axis=1)


def model_pose(model: Dynamics) -> Pose:
    """Return the function for the poses of a model's frames."""
    return lambda frame, q: np.asarray(model.kinematics.pose(q, frame.name))


def load_frame_of(load: str, body: str, axes: str, point_in: str | None, robot: OpenedRobot) -> LoadFrame:
    """Return where a load acts: its frame, and the frames of its numbers.

    Raises LinkwiseError for bodies that do not exist, for one on the ground, and for links that are energies.
    """
    tree = robot.package.manifest.tree
    if tree is None:
        raise LinkwiseError(
            f"load {load!r} on {body!r}: the links of {robot.name} are energies, which do not say where"
            " anything is; loads are for rigid links"
        )
    what = f"load {load!r}"
    frame = body_frame(f"{what} on", body, robot)
    if frame.joint is None:
        raise LinkwiseError(f"{what} on {body!r}: that stands on the ground, so that no joint bears it")
    seen = frame if point_in is None else _seen_in(what, point_in, robot, tree)
    return LoadFrame(frame, _seen_in(what, axes, robot, tree), seen, moving_joints(tree, frame.joint))


def _seen_in(what: str, name: str, robot: OpenedRobot, tree: JointTree) -> TreeFrame | None:
    """Return the frame of a name, None for the world, which OpenSim calls ground."""
    own = next((frame for frame in tree.frames if frame.name == name), None)
    if name in (WORLD, "ground") and (own is None or own.joint is None):
        return None
    return own or body_frame(f"{what}, given in the axes of", name, robot)


def moving_joints(tree: JointTree, joint: int | None) -> tuple[int, ...]:
    """Return the coordinates that move what a joint of the tree moves, ascending; none for the ground."""
    return tuple(sorted({tree.joints[f].coordinate for f in tree.chain(joint)}))
