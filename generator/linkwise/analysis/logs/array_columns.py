"""Columns of a file of named arrays: the time, and joints in arrays of their own or side by side.

Names are paths, `arm/q`. The name of an array says which quantity it holds; an array of any other name is a
column by its own name.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from linkwise_runtime.file_joints import FileJoint, why_wider

from linkwise.errors import LinkwiseError
from linkwise.escape import listed

NAMES = ("joint_names", "joints", "names", "name", "columns")
"""Names of an array of texts, or of an attribute, that names joints."""
UNITS = dict.fromkeys(("deg", "degs", "degree", "degrees", "°"), True)
UNITS |= dict.fromkeys(("rad", "rads", "radian", "radians"), False)
"""Units of angles in attributes, True for degrees."""
MOST_COLUMNS, MOST_NAMES = 10_000, 10_000
"""Most numbers of a sample in an array, and most texts in an array that names joints."""
NUMBERS = "fiub"
"""NumPy's kinds of numeric types."""
WORDS = {
    "": "q qpos position positions pos angle angles joint_position joint_positions joint_pos joint_angle"
    " joint_angles joint_state joint_states joints",
    "/velocity": "qd dq qdot qvel velocity velocities vel joint_velocity joint_velocities joint_vel",
    "/acceleration": "qdd ddq qddot qacc acceleration accelerations joint_acceleration joint_accelerations",
    "/effort": "tau torque torques effort efforts joint_torque joint_torques joint_effort joint_efforts",
}
"""Names of arrays, the likeliest first, by the ending of their columns after the joint's name."""
ENDING_OF = {word: ending for ending, words in WORDS.items() for word in words.split()}
RANK = {word: rank for rank, word in enumerate(ENDING_OF)}


@dataclass(frozen=True)
class StoredArray:
    """An array in a file: its shape, whether it holds numbers, and the texts of one that names joints.

    bytes: its size in memory
    """

    shape: tuple[int, ...]
    bytes: int = 0
    is_numeric: bool = True
    texts: tuple[str, ...] = ()
    unit: str = ""
    """Unit given by an attribute of the array."""

    @property
    def told(self) -> str:
        """Description of the array in words."""
        return f"{self.shape}" if self.is_numeric or self.texts else f"{self.shape} without numbers"


@dataclass(frozen=True)
class Place:
    """Place of a column: its array, and its index in each sample."""

    array: str
    at: int


@dataclass(frozen=True)
class ArrayColumns:
    """The columns of arrays that share a clock: the array `time`, and the arrays in the folder `group`.

    joints: joints of the robot, in whose order the columns of an array are if nothing names them
    """

    found: Mapping[str, StoredArray]
    time: str
    group: str
    joints: Sequence[str]
    others: frozenset[str]
    """Folders with clocks of their own."""
    file_joints: Sequence[FileJoint] = ()
    """Joints of the robot's file; a simulator's positions have more numbers for some of them."""

    @cached_property
    def samples(self) -> int:
        """Number of samples."""
        return max(self.found[self.time].shape)

    @cached_property
    def places(self) -> dict[str, Place]:
        """Places of the columns by name; raises LinkwiseError for positions whose joints are not known."""
        places: dict[str, Place] = {}
        for array in sorted(self._beside(), key=lambda array: RANK.get(word_of(array), len(RANK))):
            width = width_of(self.found[array].shape, self.samples)
            if width > MOST_COLUMNS and word_of(array) not in ENDING_OF:
                continue  # images, for example
            if width > MOST_COLUMNS:
                raise LinkwiseError(
                    f"array {array!r} has {width:,} numbers a sample, which no robot has; leave it out"
                )
            name = array.removeprefix(f"{self.group}/")
            raw = [name] if width == 1 else [f"{name}[{at}]" for at in range(width)]
            columns = self._columns(array, name, width) or raw
            columns = raw if places.keys() & set(columns) else columns
            for at, column in enumerate(columns):
                if column in places:
                    other = places[column].array
                    if other == array:
                        raise LinkwiseError(
                            f"{column!r} names two columns of {array!r}; name each joint once"
                        )
                    raise LinkwiseError(f"{other!r} and {array!r} are both of {column!r}; rename one")
                places[column] = Place(array, at)
        return places

    @cached_property
    def unnamed(self) -> tuple[str, ...]:
        """Arrays of positions of several joints whose columns nothing names."""
        return tuple(
            array
            for array in self._beside()
            if ENDING_OF.get(word_of(array)) == "" and not self._names(array)
            if width_of(self.found[array].shape, self.samples) == len(self.joints) > 1
        )

    def check(self) -> None:
        """Raise LinkwiseError if all positions are in arrays whose type or shape cannot hold them."""
        columns = {column for column in self.places if column in self.joints}
        for array, found in self.found.items():
            is_flat = found.is_numeric and len(found.shape) in (1, 2)
            is_of_positions = ENDING_OF.get(word_of(array)) == "" and self.group in folders_of(array)
            if is_of_positions and not (columns or is_flat or found.texts):
                raise LinkwiseError(
                    f"array {array!r} is {found.told}; positions are numbers, (samples, joints) or (samples,)"
                )

    @cached_property
    def degrees(self) -> bool | None:
        """True if attributes say that positions are in degrees, False for rad; None where they do not say.

        Raises LinkwiseError if some are in degrees and others in rad.
        """
        arrays = dict.fromkeys(place.array for column, place in self.places.items() if column in self.joints)
        told = {array: UNITS.get(self.found[array].unit.lower()) for array in arrays}
        known = {array: unit for array, unit in told.items() if unit is not None}
        if len(set(known.values())) > 1:
            there = listed(map(repr, known))
            raise LinkwiseError(f"arrays {there} are in rad and in degrees; bring them to one")
        return next(iter(known.values()), None)

    def _beside(self) -> Iterator[str]:
        """Yield the arrays of numbers on this clock, without the time.

        Raises LinkwiseError for positions of another number of samples.
        """
        for array, found in self.found.items():
            folders = set(folders_of(array))
            if array == self.time or self.group not in folders or folders & self.others:
                continue
            if not found.is_numeric or len(found.shape) not in (1, 2):
                continue
            if width_of(found.shape, self.samples):
                yield array
            elif ENDING_OF.get(word_of(array)) == "":
                raise LinkwiseError(
                    f"array {array!r} is {found.shape} and {self.time!r} has {self.samples} samples; cut one"
                )

    def _columns(self, array: str, name: str, width: int) -> list[str] | None:
        """Return the names of an array's columns, by the name of the array; None if that says nothing."""
        if width == 1 and name in self.joints:
            return [name]
        ending = ENDING_OF.get(word_of(array))
        above, _, below = name.partition("/")
        if ending is None:
            is_of_joint = width == 1 and below and above.lower() in ENDING_OF
            return [f"{below}{ENDING_OF[above.lower()]}"] if is_of_joint else None
        names = self._names(array)
        if len(names) == width:
            return [f"{joint}{ending}" for joint in names]
        if width == 1 and "/" in name:
            return [f"{name.rpartition('/')[0]}{ending}"]
        if not names and len(self.joints) == width:
            return [f"{joint}{ending}" for joint in self.joints]
        if ending == "" and (names or self.joints):
            there = f"{len(names)} names" if names else f"the robot has {len(self.joints)} joints"
            why = why_wider(self.file_joints, width, len(self.joints))
            if why and not names:
                raise LinkwiseError(
                    f"array {array!r} is {self.found[array].shape}, and {there}: {why}; say whose it is,"
                    " --qpos mujoco or --qpos pinocchio, or make q of it by robot.from_qpos of the package"
                )
            raise LinkwiseError(
                f"array {array!r} is {self.found[array].shape}, and {there}; name its columns in an array"
                f" {NAMES[0]!r} of {width} texts"
            )
        return None

    def _names(self, array: str) -> tuple[str, ...]:
        return names_beside(self.found, array)


def names_beside(found: Mapping[str, StoredArray], array: str) -> tuple[str, ...]:
    """Return the joint names that stand nearest to an array, at it or above; empty if there are none."""
    for folder in (array, *folders_of(array)):
        for word in NAMES:
            has = found.get(f"{folder}/{word}".lstrip("/"))
            if has is not None and has.texts:
                return has.texts
    return ()


def array_columns(
    found: Mapping[str, StoredArray],
    time: str | None,
    group: str | None,
    joints: Sequence[str],
    file_joints: Sequence[FileJoint] = (),
) -> ArrayColumns:
    """Find the clock, and return the columns that share it.

    It is the only array called `time` or `t`, or as given, in the group or nearest above it. Raises
    LinkwiseError where there is none, or several.
    """
    clocks = _clocks(found, time)
    where = listed(f"/{folder}" for folder in sorted(clocks))
    if not clocks:
        told = listed(f"{array!r} {has.told}" for array, has in found.items()) or "it"
        raise LinkwiseError(
            f"no array of times{'' if time is None else f' {time!r}'} in {told}; call it 'time', in s, or"
            " name it with --time"
        )
    if group is None and len(clocks) > 1:
        raise LinkwiseError(f"times in several groups, {where}; choose one with --topic")
    folder = next(iter(clocks)) if group is None else group.strip("/")
    above = [at for at in (folder, *folders_of(folder)) if at in clocks]
    if not above or not any(folder in folders_of(array) for array in found):
        raise LinkwiseError(f"--topic {group}: no such group with times; they are in {where}")
    others = frozenset(clocks).difference([folder, *folders_of(folder)])
    return ArrayColumns(found, clocks[above[0]], folder, joints, others, file_joints)


def _clocks(found: Mapping[str, StoredArray], time: str | None) -> dict[str, str]:
    """Return the arrays of times, by the folder whose arrays they belong to."""
    clocks: dict[str, str] = {}
    depth = 0 if time is None else time.strip("/").count("/")
    for array, has in found.items():
        is_called = (
            word_of(array) in ("time", "t") if time is None else f"/{array}".endswith(f"/{time.strip('/')}")
        )
        is_vector = sum(size != 1 for size in has.shape) <= 1 and 0 not in has.shape and len(has.shape) > 0
        if is_called and is_vector and has.is_numeric:
            clocks.setdefault(folders_of(array)[depth], array)
    return clocks


def folders_of(array: str) -> list[str]:
    """Return the folders that contain an array or a folder, innermost first, the file's root, "", last."""
    parts = array.split("/")[:-1]
    return ["/".join(parts[:count]) for count in range(len(parts), -1, -1)]


def word_of(array: str) -> str:
    """Return the name of an array without its folders, in lower case."""
    return array.rpartition("/")[2].lower()


def names_joints(array: str, shape: tuple[int, ...]) -> bool:
    """Return whether an array of this name and shape, if it holds texts, names joints."""
    is_list = len(shape) > 0 and sum(size != 1 for size in shape) <= 1
    return word_of(array) in NAMES and is_list and math.prod(shape) <= MOST_NAMES


def width_of(shape: tuple[int, ...], samples: int) -> int:
    """Return how many numbers a sample has, the samples along either axis; 0 if neither has `samples`."""
    if len(shape) == 1:
        return int(shape[0] == samples)
    return shape[1] if shape[0] == samples else shape[0] if shape[1] == samples else 0
