"""Files of ROS bags, and whether they are whole: their libraries read some that are not without an error."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from linkwise.analysis.logs.checks import read_as
from linkwise.errors import LinkwiseError, within
from linkwise.escape import short
from linkwise.extras import extra
from linkwise.input_file import require_file

MCAP_MAGIC, MCAP_BEFORE, MCAP_OF_ROS = b"\x89MCAP0\r\n", 8 + 1 + 8, "ros2"
"""First bytes of an MCAP file, number of bytes before the length of its profile, and the profile of ROS 2."""
ROS1_MAGIC = b"#ROSBAG V2.0\n"
"""First line of a ROS 1 bag; in any other file the library searches for its end up to the file's end."""
SQLITE_PAGE, SQLITE_LARGEST = slice(16, 18), 65536
"""Where a database of SQLite has the bytes of a page, and those of the largest."""
REINDEX = "`ros2 bag reindex`"
MEND = {".mcap": f"`mcap recover` or {REINDEX}", ".bag": "`rosbag reindex`"}
"""Programs that mend a bag, by its suffix."""


@contextmanager
def opened_bag(path: Path) -> Iterator[Any]:
    """Open a bag and give the library's reader."""
    if path.is_dir() and not (path / "metadata.yaml").is_file():
        raise LinkwiseError(
            f"{path}: this is a directory, not that of a bag: it has no metadata.yaml; give a file"
        )
    for file in path.iterdir() if path.is_dir() else ():
        if not file.is_dir():
            with within(str(file)):
                require_file(file)
    ending = path.suffix
    if path.is_file() and ending != ending.lower() and ending.lower() in (".db3", ".mcap"):
        raise LinkwiseError(f"{path}: bags are found by small letters; name it …{ending.lower()}")
    if (profile := _profile(path)) != MCAP_OF_ROS:
        raise LinkwiseError(
            f"{path}: MCAP with the profile {short(profile)!r}, and not {MCAP_OF_ROS!r}; record it with ros2"
            " bag, or write the joints as .csv or .npz"
        )
    is_ros1 = path.is_file() and path.suffix.lower() == ".bag"
    module = extra("rosbags.rosbag1" if is_ros1 else "rosbags.rosbag2")
    mend = MEND.get(path.suffix.lower(), REINDEX)
    with read_as("a bag of ROS", path, f"mend it with {mend}, or record it again"):
        if is_ros1:
            _require_ros1(path)
        for file in path.iterdir() if path.is_dir() else (path,):
            if file.suffix.lower() == ".db3":
                _require_whole_pages(file)
                _require_merged(file)
        with module.Reader(path) as bag:
            yield bag


def _require_ros1(path: Path) -> None:
    """Raise ValueError for a file that does not begin like a bag of ROS 1."""
    with path.open("rb") as file:
        if file.read(len(ROS1_MAGIC)) != ROS1_MAGIC:
            raise ValueError(f"its first line is not {ROS1_MAGIC.decode().strip()!r}")


def _require_whole_pages(path: Path) -> None:
    """Raise ValueError for a database of SQLite whose last page is cut: SQLite reads zeros there."""
    with path.open("rb") as file:
        head = file.read(SQLITE_PAGE.stop)
    size = int.from_bytes(head[SQLITE_PAGE], "big")
    size = SQLITE_LARGEST if size == 1 else size  # which two bytes cannot hold
    if size and (rest := path.stat().st_size % size):
        raise ValueError(f"{rest} of {size} bytes of its last page are there")


def _require_merged(path: Path) -> None:
    """Raise LinkwiseError for a database of SQLite with changes beside it, which the library leaves out."""
    for ending in ("-wal", "-journal"):
        beside = path.resolve().with_name(path.resolve().name + ending)  # SQLite's own way with links
        if beside.is_file() and beside.stat().st_size:
            raise LinkwiseError(
                f"{beside.name} has what was recorded last, and would be left out; bring it in with"
                f" `sqlite3 {path.name} 'pragma journal_mode = delete'`"
            )


def _profile(path: Path) -> str:
    """Return the profile in the header of an MCAP file; the profile of ROS 2 for other files."""
    if not path.is_file() or path.suffix.lower() != ".mcap":
        return MCAP_OF_ROS
    with path.open("rb") as file:
        is_mcap = file.read(MCAP_BEFORE).startswith(MCAP_MAGIC)
        length = int.from_bytes(file.read(4), "little")
        return file.read(min(length, 99)).decode("ascii", "replace") if is_mcap else MCAP_OF_ROS
