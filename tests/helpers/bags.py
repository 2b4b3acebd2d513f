"""Bags of ROS for the tests, written by the library's writers, and files of arrays."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

TYPE = "sensor_msgs/msg/JointState"
BEGIN = 1_700_000_000_123_456_789
"""ns since 1970: so late that floats have no more digits for a microsecond."""


@dataclass(frozen=True)
class State:
    """A message: `stamp` and `recorded` in ns since the beginning of the bag; a stamp of None is 0."""

    stamp: int | None
    names: Sequence[str]
    position: Sequence[float] = ()
    velocity: Sequence[float] = ()
    effort: Sequence[float] = ()
    topic: str = "/joint_states"
    late: int = 1_000_000


def states(table: NDArray[np.float64], names: Sequence[str]) -> list[State]:
    """Messages of a table's rows: time in s, and positions."""
    return [State(round(1e9 * time), names, row) for time, *row in table.tolist()]


def write_bag(path: Path, messages: Iterable[State], storage: str = "mcap") -> Path:
    """Write a bag: a folder of rosbag2 with `storage` mcap or sqlite3, or a file of ROS 1, "ros1"."""
    if storage == "ros1":
        store = get_typestore(Stores.ROS1_NOETIC)
        bag, pack = Writer1(path), store.serialize_ros1
    else:
        store = get_typestore(Stores.ROS2_HUMBLE)
        bag, pack = (
            Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()]),
            store.serialize_cdr,
        )
    types = store.types
    with bag:
        topics: dict[str, object] = {}
        for number, said in enumerate(messages):
            if said.topic not in topics:
                topics[said.topic] = bag.add_connection(said.topic, TYPE, typestore=store)
            stamp = 0 if said.stamp is None else BEGIN + said.stamp
            time = types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
            before = {"seq": number} if storage == "ros1" else {}
            header = types["std_msgs/msg/Header"](**before, stamp=time, frame_id="")
            arrays = [np.array(numbers, float) for numbers in (said.position, said.velocity, said.effort)]
            message = types[TYPE](header, list(said.names), *arrays)
            recorded = BEGIN + (said.stamp or 0) + said.late
            bag.write(topics[said.topic], recorded, pack(message, TYPE))
    return path
