"""Columns of joints that follow others by the robot's file, or are held: left out, but checked."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from linkwise_runtime.chosen_names import end_of_path
from linkwise_runtime.rule.joint_tree import TreeCurve
from numpy.polynomial import polynomial

from linkwise.analysis.column_matching import SPEED
from linkwise.package.load import Array
from linkwise.package.manifest import Manifest

CLOSE = {"rad": 0.01, "m": 0.001}
"""Largest difference between a column and the motion of its joint: logs are rounded, joints have play."""


@dataclass(frozen=True)
class FollowingJoint:
    """A joint of the file that is no joint of the robot, but follows one by a curve.

    A joint without a leader is held.
    """

    name: str
    unit: Literal["rad", "m"]
    is_always_in_radians: bool
    leader: str | None
    curve: TreeCurve

    @classmethod
    def of(cls, manifest: Manifest) -> tuple["FollowingJoint", ...]:
        """Return all joints that a package knows to follow or to be held."""
        return tuple(
            cls(
                one.name,
                one.unit,
                one.name in manifest.in_radians,
                None if one.joint is None else manifest.joints[one.joint].name,
                one.curve,
            )
            for one in manifest.followers
        )

    def at(self, leader: Array) -> Array:
        """Return the joint's position (S,), in its unit, at positions (S,) of its leader."""
        starts = np.array(self.curve.starts)
        piece = np.searchsorted(starts[1:], leader, side="right")
        found = np.zeros_like(leader)
        for number, powers in enumerate(self.curve.pieces):
            inside = piece == number
            found[inside] = polynomial.polyval(leader[inside] - starts[number], powers)
        return found


class FollowerColumns:
    """Columns of following and held joints among a log's free ones, and their distance from these joints.

    columns: all names of the log's columns; free: those that no joint has
    joints: those that are read, in their order; radians: factor that brings the log's angles to radians
    """

    def __init__(
        self,
        columns: Sequence[str],
        free: Sequence[str],
        followers: Sequence[FollowingJoint],
        joints: Sequence[str],
        radians: float,
    ) -> None:
        by_name = {one.name: one for one in followers if one.leader is None or one.leader in joints}
        positions = [name for name in free if not name.endswith(SPEED)]
        self._names = [name for name in positions if end_of_path(name) in by_name]
        self._followers = [by_name[end_of_path(name)] for name in self._names]
        self._leaders = [0 if one.leader is None else joints.index(one.leader) for one in self._followers]
        turned = [one.unit == "rad" and not one.is_always_in_radians for one in self._followers]
        self._factors = np.where(turned, radians, 1.0)
        self._largest = [0.0] * len(self._names)
        self.numbers = tuple(columns.index(name) for name in self._names)

    def look(self, q: Array, own: Array) -> None:
        """Note the distances in a block; NaN counts as no value.

        q: positions of the joints (S, joints) in rad or m; own: the columns (S, columns) as in the log
        """
        for at, (follower, leader) in enumerate(zip(self._followers, self._leaders, strict=True)):
            apart = np.abs(own[:, at] * self._factors[at] - follower.at(q[:, leader]))
            self._largest[at] = float(np.fmax.reduce(apart, initial=self._largest[at]))

    def warnings(self) -> Iterator[str]:
        """Yield a warning for each column that is far from its joint."""
        for name, one, largest in zip(self._names, self._followers, self._largest, strict=True):
            if largest > CLOSE[one.unit]:
                held = f"where the robot holds {one.name!r}"
                following = f"what {one.name!r} does by following {one.leader!r}"
                yield (
                    f"column {name!r} is left out, and is up to {largest:.3g} {one.unit} from"
                    f" {held if one.leader is None else following}"
                )
