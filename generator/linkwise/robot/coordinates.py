"""Assignment of coordinates to joints: joints that move, that stand still, and that follow another.

The number of coordinates is limited, and that of constraints on them, wherever a robot is described.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.curve import Curve
from linkwise.robot.description import Connection, Mimic
from linkwise.robot.joint_types import Axis
from linkwise.robot.notes import UNCOUPLED, Note
from linkwise.robot.robot import Coordinate, unusable

MOST_JOINTS = 1000
"""Most joints: an arm of N has some N³/3 coefficients of each order; 1000 are far beyond what is feasible."""
FOR_EACH = 10
"""Most constraints for each joint that moves: one that holds nothing that others leave free is redundant."""


@dataclass(frozen=True)
class AxisRule:
    """Rule by which an axis moves: ratio · q + offset of a coordinate q, or a curve of it.

    Without a coordinate the axis stands at the offset.
    """

    coordinate: int | None
    ratio: float = 1.0
    offset: float = 0.0
    curve: Curve | None = None


@dataclass(frozen=True)
class Movement:
    """Coordinates of a robot; `motion` is the rule by which each axis moves with them, by the axis's name."""

    coordinates: tuple[Coordinate, ...]
    motion: dict[str, AxisRule]
    notes: tuple[Note, ...]


def movement(
    axes: tuple[Axis, ...], connections: tuple[Connection, ...], lock: dict[str, float], free_mimic: bool
) -> Movement:
    """Return the Movement: each axis has a coordinate of its own unless it is locked or follows another.

    Raises LinkwiseError for two axes of one name, a lock of an unknown joint, and a mimic that cannot be.
    """
    curved = _Curved(connections, lock)
    _check_axes(axes, [*(axis.name for axis in axes if axis.follows is None), *curved.units], lock)
    mimics, freed = _mimics(connections, {axis.name for axis in axes}, lock, free_mimic)
    motion: dict[str, AxisRule] = {}
    moving: list[Coordinate] = []
    for axis in axes:
        if axis.follows is not None:
            motion[axis.name] = curved.rule(axis.name, *axis.follows, moving)
        elif axis.name in lock:
            motion[axis.name] = AxisRule(None, 0.0, lock[axis.name])
        elif axis.name not in mimics:
            motion[axis.name] = AxisRule(len(moving))
            moving.append(Coordinate(axis.name, axis.unit))
    for name, mimic in mimics.items():
        master = motion[mimic.master]
        motion[name] = AxisRule(
            master.coordinate, mimic.ratio * master.ratio, mimic.offset + mimic.ratio * master.offset
        )
    notes = [
        *(Note("locked", a.name, f"at {lock[a.name]:g} {a.unit}") for a in axes if a.name in lock),
        *(Note("locked", c, f"at {lock[c]:g} {unit}") for c, unit in curved.units.items() if c in lock),
        *(Note("mimic", name, _rule(mimic)) for name, mimic in mimics.items()),
        *(
            Note("ignored", c.name, "the mimic of a fixed joint")
            for c in connections
            if c.mimic and c.type == "fixed"
        ),
    ]
    return Movement(tuple(moving), motion, (*notes, *freed))


class _Curved:
    """Coordinates that axes follow by curves; those of one joint are added together, in the file's order."""

    def __init__(self, connections: Iterable[Connection], lock: dict[str, float]) -> None:
        self._lock = lock
        self._joints = {c.name: joint.coordinates for joint in connections for c in joint.coordinates}
        self._places: dict[str, int] = {}
        self.units = {c.name: c.unit for joint in self._joints.values() for c in joint}

    def rule(self, axis: str, name: str, curve: Curve, moving: list[Coordinate]) -> AxisRule:
        """Return the rule of an axis that follows `name`; append the coordinates that it needs to `moving`.

        Raises LinkwiseError for a coordinate whose joint is not there.
        """
        if name and name not in self._joints:
            raise LinkwiseError(
                f"joint {axis!r} follows {name!r}, which --root or --tip cuts away; keep both or neither"
            )
        for c in self._joints.get(name, ()):
            if c.name not in self._lock and c.name not in self._places:
                self._places[c.name] = len(moving)
                moving.append(Coordinate(c.name, c.unit, c.coupled))
        if name not in self._places:
            return AxisRule(None, 0.0, curve(self._lock.get(name, 0.0)))
        if curve.line:
            return AxisRule(self._places[name], curve.line[1], curve.line[0])
        return AxisRule(self._places[name], curve=curve)


def _rule(mimic: Mimic) -> str:
    ratio = {1.0: "", -1.0: "-"}.get(mimic.ratio, f"{mimic.ratio:g} ")
    offset = f" {'-' if mimic.offset < 0 else '+'} {abs(mimic.offset):g}" if mimic.offset else ""
    return f"= {ratio}{mimic.master}{offset}"


def _check_axes(axes: tuple[Axis, ...], coordinates: list[str], lock: dict[str, float]) -> None:
    counts = Counter(axis.name for axis in axes)
    for name, count in (counts | Counter(coordinates)).items():
        if count > 1:
            raise LinkwiseError(
                f"{count} joints are named {name!r}, one of them made from a joint's type; rename it"
            )
    for name in lock:
        if name not in coordinates:
            near = listed(nearest_first(name, coordinates))
            raise LinkwiseError(f"--lock {name!r} is not a moving joint; the joints are {near}")
        if fault := unusable(lock[name]):
            raise LinkwiseError(f"--lock {name!r} has {fault} for a value; give rad or m")


def _mimics(
    connections: tuple[Connection, ...], axes: set[str], lock: dict[str, float], free: bool
) -> tuple[dict[str, Mimic], list[Note]]:
    """Return the joints that follow another, by name, and notes on those let free.

    Raises LinkwiseError for a joint of several axes, a master that is a mimic too and, unless `free`, a
    master that is not there.
    """
    mimics: dict[str, Mimic] = {}
    for c in connections:
        if c.mimic is None or c.name in lock or c.type == "fixed":
            continue
        if c.name not in axes:
            raise LinkwiseError(
                f"joint {c.name!r} is {c.type} and mimics {c.mimic.master!r}; only a joint of one axis can"
            )
        mimics[c.name] = c.mimic
    masterless = {name: mimic.master for name, mimic in mimics.items() if mimic.master not in axes}
    if masterless and not free:
        _refuse(masterless)
    mimics = {name: mimic for name, mimic in mimics.items() if name not in masterless}
    _check_masters(mimics)
    return mimics, [
        Note("freed", name, f"mimics {master!r}, which is not a moving joint here", UNCOUPLED)
        for name, master in masterless.items()
    ]


def _check_masters(mimics: dict[str, Mimic]) -> None:
    for name, mimic in mimics.items():
        if mimic.master in mimics:
            raise LinkwiseError(
                f"joint {name!r} mimics {mimic.master!r}, which is "
                f"{'itself' if mimic.master == name else 'a mimic too'}; name the joint that moves, or hold "
                f"it with --lock {name}=0"
            )


def _refuse(masterless: dict[str, str]) -> None:
    name, master = next(iter(masterless.items()))
    others = f" ({len(masterless)} joints do so)" if len(masterless) > 1 else ""
    raise LinkwiseError(
        f"joint {name!r} mimics {master!r}, which is not a moving joint here{others}; hold it with "
        f"--lock {name}=0, or let such joints move by themselves with --free-mimic"
    )


def check_joints(count: int, remedy: str) -> None:
    """Raise LinkwiseError where more joints move than linkwise accepts; `remedy` in words."""
    if count > MOST_JOINTS:
        raise LinkwiseError(
            f"{count:,} joints move, and {MOST_JOINTS:,} are the most, as the number of coefficients grows"
            f" with N³; {remedy}"
        )


def check_constraint_count(constraints: int, joints: int) -> None:
    """Raise LinkwiseError for far more constraints than joints that they could hold.

    To find where constraints close, and which follow from others, takes time that grows at least with the
    square of their number.
    """
    most = min(FOR_EACH * joints, MOST_JOINTS)
    if constraints > most:
        raise LinkwiseError(
            f"joints that move are {joints:,}, and constraints {constraints:,}, of which {most:,} are the"
            " most, as each is to hold what others leave free; remove those that follow from others"
        )
