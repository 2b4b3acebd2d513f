"""ROS bags with joint states: folders of rosbag2, their .mcap and .db3 files, and .bag files of ROS 1.

Messages carry joints in any order, and not each of them all joints.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.logs.bag_files import opened_bag
from linkwise.analysis.logs.checks import named_once
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.extras import extra

STAMPED, RECORDED = "stamped", "recorded"
"""Quantities of the columns of time: the message's own stamp, and the recorder's time."""
ENDINGS = {"position": "", "velocity": "/velocity", "effort": "/effort"}
"""Quantities of joints in a message, and the endings of their columns' names after the joint's."""
BY_RECORDER = f"take the recorder's times with --time {RECORDED}"


@dataclass(frozen=True)
class JointMessage:
    """A message, whose number in its topic counts from 1.

    `recorded` and `stamp` are in ns; `arrays` has one number of each quantity for each name, or none at all.
    """

    number: int
    recorded: int
    stamp: int
    names: tuple[str, ...]
    arrays: Mapping[str, Sequence[float]]

    def has(self, quantity: str) -> bool:
        """Return whether there are numbers of a quantity.

        Raises LinkwiseError if there are not as many as names.
        """
        count = len(self.arrays[quantity])
        if count not in (0, len(self.names)):
            raise LinkwiseError(
                f"message {self.number} has {len(self.names)} names and {count} numbers of {quantity}"
            )
        return count > 0


@dataclass(frozen=True)
class Cell:
    """Content of a column: a time, or a quantity of a joint."""

    quantity: str
    joint: str = ""


def rows_of(states: Iterator[JointMessage], cells: Sequence[Cell], rows: int) -> Iterator[tuple[Array, int]]:
    """Yield blocks (at most `rows`, len(cells)), times in s from the first message, and messages read.

    A message without any of the joints is skipped, and so is one that repeats another, including its stamp.
    Raises LinkwiseError for a message with only some of the joints, and for stamps that do not increase.
    """
    block: list[list[float]] = []
    first = last = None
    row: list[float] = []
    number, named, places = 0, None, None
    for state in states:
        number = state.number
        first = first or state
        if state.names != named:
            named, places = state.names, _places(state, cells)
        if places is None:
            continue
        found = _row(state, cells, places, first)
        if last is not None and _repeats(cells, last, state, row, found, first):
            continue
        last, row = state, found
        block.append(row)
        if len(block) == rows:
            yield np.array(block), number
            block = []
    yield np.array(block).reshape(-1, len(cells)), number


def _places(state: JointMessage, cells: Sequence[Cell]) -> list[int] | None:
    """Return the index of each cell's joint among a message's names, -1 if absent; None if all are absent."""
    place = {name: at for at, name in enumerate(state.names)}
    if len(place) < len(state.names):
        raise LinkwiseError(f"message {state.number} names a joint twice: {listed(state.names)}")
    wanted = {cell.joint for cell in cells if cell.joint}
    if wanted and wanted.isdisjoint(place):
        return None
    return [place.get(cell.joint, -1) for cell in cells]


def _row(
    state: JointMessage, cells: Sequence[Cell], places: Sequence[int], first: JointMessage
) -> list[float]:
    """Return the values of a message, one for each cell."""
    row = []
    there = {quantity: state.has(quantity) for quantity in ENDINGS}
    for cell, place in zip(cells, places, strict=True):
        if cell.quantity == STAMPED:
            row.append((state.stamp - first.stamp) / 1e9)
        elif cell.quantity == RECORDED:
            row.append((state.recorded - first.recorded) / 1e9)
        elif place >= 0 and there[cell.quantity]:
            row.append(float(state.arrays[cell.quantity][place]))
        else:
            has = [joint for joint in state.names if joint in {cell.joint for cell in cells}]
            raise LinkwiseError(
                f"message {state.number} has {listed(map(repr, has))} and no {cell.quantity} of"
                f" {cell.joint!r}, but a row needs all of the robot's joints: record them in one message, or"
                " lock the others with linkwise generate --lock"
            )
    return row


def _repeats(
    cells: Sequence[Cell],
    last: JointMessage,
    state: JointMessage,
    row: Sequence[float],
    found: Sequence[float],
    first: JointMessage,
) -> bool:
    """Return whether a row repeats the one before.

    Raises LinkwiseError where only the stamp repeats, or where it runs backwards.
    """
    if state.stamp > last.stamp or all(cell.quantity != STAMPED for cell in cells):
        return False
    if state.stamp == last.stamp and np.array_equal(row, found, equal_nan=True):
        return True
    seconds = (state.stamp - first.stamp) / 1e9
    how = f"repeats {seconds:.9g} s with other values"
    if state.stamp < last.stamp:
        how = f"runs back to {seconds:.9g} s"
    raise LinkwiseError(f"message {state.number}: its stamp {how}; {BY_RECORDER}")


JOINT_STATE = "sensor_msgs/msg/JointState"
NAMED = 10_000
"""Messages at the beginning of a topic that are searched for the names of joints."""


@dataclass(frozen=True)
class BagLog:
    """The joint states of a topic.

    Times are in s from the first message: `time` by the stamps in messages, `recorded` by those of the
    recorder. Rows are the messages that have the requested joints, from 1. `cells` are the columns.
    """

    path: Path
    topic: str
    cells: Mapping[str, Cell]
    size: int
    """Number of messages of the topic."""
    warnings: tuple[str, ...]
    degrees: bool | None = None
    first_row: int = 1

    @classmethod
    def open(cls, path: Path, topic: str | None) -> "BagLog":
        """Find the topic, and the joints in its first messages; raise LinkwiseError where there are none."""
        with opened_bag(path) as bag:
            name = _chosen_topic(bag.topics, topic)
            states = list(islice(_states(bag, name), NAMED))
            size = bag.topics[name].msgcount
            if not states:
                raise LinkwiseError(f"{size:,} messages of {name} are promised, and none is there")
            columns = _columns(states)
        is_stamped = bool(states[0].stamp)
        told = () if is_stamped else (f"messages of {name} have no stamps: the time is that of recording",)
        times = [("time", Cell(STAMPED if is_stamped else RECORDED)), (RECORDED, Cell(RECORDED))]
        cells = [*times, *columns]
        with within(str(path)):
            named_once([column for column, _ in cells])
        return cls(path, name, dict(cells), size, told)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of columns: times by stamp and by recorder; positions, velocities, efforts of joints."""
        return tuple(self.cells)

    @property
    def brought(self) -> frozenset[str]:
        """Columns of times, velocities and efforts."""
        return frozenset(column for column, cell in self.cells.items() if cell.quantity != "position")

    def read(self, columns: Sequence[int], rows: int = 65536) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)) and the number of messages read so far.

        Raises LinkwiseError, naming the message, for one that has only some of the joints, for stamps that
        run backwards, and at the end where there are fewer messages than are promised.
        """
        cells, number = [self.cells[self.columns[at]] for at in columns], 0
        with opened_bag(self.path) as bag:
            for block, number in rows_of(_states(bag, self.topic), cells, rows):
                yield block, number
            if number < self.size:
                raise LinkwiseError(
                    f"{number:,} messages of {self.topic} are there, and {self.size:,} are promised; add the"
                    " files that are missing, or write its metadata anew with `ros2 bag reindex`"
                )


def _chosen_topic(topics: Mapping[str, Any], wanted: str | None) -> str:
    """Return the name of the topic to read, among those with joint states."""
    found = {
        name: topic.msgcount
        for name, topic in topics.items()
        if topic.msgtype == JOINT_STATE and topic.msgcount
    }
    told = listed([f"{name} ({count:,} messages)" for name, count in found.items()])
    if not found:
        others = listed([f"{name} ({topic.msgtype})" for name, topic in topics.items()]) or "none"
        raise LinkwiseError(f"no messages of type {JOINT_STATE}; record such a topic too (topics: {others})")
    if wanted is not None:
        if name := next((name for name in (wanted, f"/{wanted}") if name in found), None):
            return name
        raise LinkwiseError(f"--topic {wanted}: no joint states there; they are in {told}")
    if len(found) > 1:
        raise LinkwiseError(f"joint states in several topics: {told}; choose one with --topic")
    return next(iter(found))


def _states(bag: Any, topic: str) -> Iterator[JointMessage]:
    """Yield the messages of a topic by their time of recording."""
    stores = extra("rosbags.typesys")
    is_ros1 = type(bag).__module__.startswith("rosbags.rosbag1")
    store = stores.get_typestore(stores.Stores.ROS1_NOETIC if is_ros1 else stores.Stores.ROS2_HUMBLE)
    parsed = store.deserialize_ros1 if is_ros1 else store.deserialize_cdr
    for number, (_, recorded, raw) in enumerate(bag.messages(bag.topics[topic].connections), 1):
        message = parsed(raw, JOINT_STATE)
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        arrays = {quantity: getattr(message, quantity) for quantity in ENDINGS}
        yield JointMessage(number, recorded, stamp, tuple(message.name), arrays)


def _columns(states: Sequence[JointMessage]) -> list[tuple[str, Cell]]:
    """Return the columns of all joints that messages carry, in the order in which messages name them."""
    found: dict[str, dict[str, Cell]] = {quantity: {} for quantity in ENDINGS}
    for state in states:
        for quantity, ending in ENDINGS.items():
            if state.has(quantity):
                found[quantity] |= {f"{joint}{ending}": Cell(quantity, joint) for joint in state.names}
    return [named for some in found.values() for named in some.items()]
