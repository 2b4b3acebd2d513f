"""ROS bags with joint states: folders of rosbag2, their .mcap and .db3 files, and .bag files of ROS 1."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from linkwise.analysis.logs.damaged_files import read_as
from linkwise.analysis.logs.joint_states import ENDINGS, RECORDED, STAMPED, Cell, JointMessage, rows_of
from linkwise.analysis.logs.named_once import named_once
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed, short
from linkwise.extras import extra
from linkwise.input_file import require_file
from linkwise.package.load import Array

MCAP_MAGIC, MCAP_BEFORE, MCAP_OF_ROS = b"\x89MCAP0\r\n", 8 + 1 + 8, "ros2"
"""First bytes of an MCAP file, number of bytes before the length of its profile, and the profile of ROS 2."""
ROS1_MAGIC = b"#ROSBAG V2.0\n"
"""First line of a ROS 1 bag; in any other file the library searches for its end up to the file's end."""
MEND = "mend it with `mcap recover` or `ros2 bag reindex`, or record it again"
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
        with _opened(path) as bag:
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

        Raises LinkwiseError, naming the message, for one that has only some of the joints, and for stamps
        that run backwards.
        """
        cells = [self.cells[self.columns[at]] for at in columns]
        with _opened(self.path) as bag:
            yield from rows_of(_states(bag, self.topic), cells, rows)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a bag and give the library's reader."""
    if path.is_dir() and not (path / "metadata.yaml").is_file():
        raise LinkwiseError(
            f"{path}: this is a directory, not that of a bag: it has no metadata.yaml; give a file"
        )
    for file in path.iterdir() if path.is_dir() else ():
        if not file.is_dir():
            with within(str(file)):
                require_file(file)
    if (profile := _profile(path)) != MCAP_OF_ROS:
        raise LinkwiseError(
            f"{path}: MCAP with the profile {short(profile)!r}, and not {MCAP_OF_ROS!r}; record it with ros2"
            " bag, or write the joints as .csv or .npz"
        )
    is_ros1 = path.is_file() and path.suffix.lower() == ".bag"
    module = extra("rosbags.rosbag1" if is_ros1 else "rosbags.rosbag2")
    with read_as("a bag of ROS", path, MEND):
        if is_ros1:
            _require_ros1(path)
        with module.Reader(path) as bag:
            yield bag


def _require_ros1(path: Path) -> None:
    """Raise ValueError for a file that does not begin like a bag of ROS 1."""
    with path.open("rb") as file:
        if file.read(len(ROS1_MAGIC)) != ROS1_MAGIC:
            raise ValueError(f"its first line is not {ROS1_MAGIC.decode().strip()!r}")


def _profile(path: Path) -> str:
    """Return the profile in the header of an MCAP file; the profile of ROS 2 for other files."""
    if not path.is_file() or path.suffix.lower() != ".mcap":
        return MCAP_OF_ROS
    with path.open("rb") as file:
        is_mcap = file.read(MCAP_BEFORE).startswith(MCAP_MAGIC)
        length = int.from_bytes(file.read(4), "little")
        return file.read(min(length, 99)).decode("ascii", "replace") if is_mcap else MCAP_OF_ROS


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
