"""A log that promises more than it holds is refused before memory is taken, and no other file is opened."""

import math
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from helpers.bags import states, write_bag
from helpers.motion_logs import JOINTS, PLANAR3, smooth
from linkwise import LinkwiseError, analyze
from linkwise.own_process import ProcessLimits, in_own_process

TABLE = smooth(80, 3)
TIME, Q = TABLE[:, 0], TABLE[:, 1:]
LITTLE = ProcessLimits(seconds=10, memory=256 << 20)


def refusal(path: Path) -> str:
    """Return what is said of a log, which takes little time and memory, without its path."""
    with pytest.raises(LinkwiseError) as caught:
        in_own_process(lambda: analyze(path, PLANAR3).columns, LITTLE)
    return str(caught.value).removeprefix(f"{path}: ")


def zeros(path: Path, shapes: dict[str, tuple[int, ...]], most: int = 1 << 30) -> Path:
    """Arrays of zeros, packed, that end after so many bytes."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, shape in shapes.items():
            with file.open(f"{name}.npy", "w") as array:
                header = {"descr": "<f8", "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_1_0(array, header)
                array.write(bytes(min(8 * math.prod(shape), most)))
    return path


def test_zeros_that_are_packed_into_nothing_are_not_unpacked(tmp_path: Path) -> None:
    rows = 1 << 22
    path = zeros(tmp_path / "a.npz", {"time": (rows,), "q": (rows, 3)})
    size = path.stat().st_size
    told = (
        f"the file has {size:,} bytes and promises 134,217,728 bytes of numbers; no log is packed so well: "
    )
    assert refusal(path).startswith(told)


def test_array_that_is_shorter_than_its_header_says_is_refused(tmp_path: Path) -> None:
    path = zeros(tmp_path / "a.npz", {"time": (80,), "q": (80, 3 * 10**9)}, 800)
    assert refusal(path) == "array 'q' has 928 of its 1,920,000,000,000 bytes; write the file again"


def test_header_of_an_array_is_not_unpacked_where_it_promises_more_than_one_has(tmp_path: Path) -> None:
    length = 1 << 30
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("time.npy", b"\x93NUMPY\x02\x00" + length.to_bytes(4, "little") + bytes(1 << 29))
    told = "its header promises 1,073,741,824 bytes, and an array of numbers has no more than 10,000"
    assert refusal(tmp_path / "a.npz") == f"array 'time': {told}; write the file again"


def test_array_of_more_numbers_than_a_robot_has_is_refused_or_passed_over(tmp_path: Path) -> None:
    wide = np.zeros((80, 200_000), np.uint8)
    np.savez(tmp_path / "a.npz", time=TIME, q=wide)
    assert (
        refusal(tmp_path / "a.npz")
        == "array 'q' has 200,000 numbers a sample, which no robot has; leave it out"
    )
    np.savez(tmp_path / "b.npz", time=TIME, q=Q, picture=wide)
    np.testing.assert_array_equal(analyze(tmp_path / "b.npz", PLANAR3).q, Q)


def nothing_stored(file: h5py.File, other: Path) -> None:
    file.create_dataset("time", (2 * 10**9,), "f8", chunks=(1 << 16,))
    file.create_dataset("q", (2 * 10**9, 3), "f8", chunks=(1 << 16, 3))


def large_chunk(file: h5py.File, other: Path) -> None:
    file["time"] = TIME
    file.create_dataset("q", (80, 3), "f8", maxshape=(None, 3), chunks=(1 << 26, 3), fillvalue=0.0)


def external(file: h5py.File, other: Path) -> None:
    file["time"] = TIME
    file.create_dataset("q", (80, 3), "f8", external=[(str(other), 0, 8 * Q.size)])


def virtual(file: h5py.File, other: Path) -> None:
    file["time"] = TIME
    layout = h5py.VirtualLayout((80, 3), "f8", maxshape=(None, 3))
    source = h5py.VirtualSource(str(other), "q", (80, 3), maxshape=(None, 3))
    layout[: h5py.h5s.UNLIMITED, :] = source[: h5py.h5s.UNLIMITED, :]
    file.create_virtual_dataset("q", layout)


def linked(file: h5py.File, other: Path) -> None:
    file["time"] = TIME
    file["q"] = h5py.ExternalLink(str(other), "q")


@pytest.mark.parametrize(
    ("write", "told"),
    [
        (nothing_stored, "bytes and promises 64,000,000,000 bytes of numbers; no log is packed so well"),
        (large_chunk, "bytes and promises 1,610,613,376 bytes of numbers; no log is packed so well"),
        (external, "dataset 'q' has its numbers in other files; write them into this one"),
        (virtual, "dataset 'q' has its numbers in other files; write them into this one"),
        (linked, "no column for joint 'joint1', 'joint2', 'joint3'"),
    ],
)
def test_datasets_are_those_that_the_file_holds(
    tmp_path: Path, write: Callable[[h5py.File, Path], None], told: str
) -> None:
    other = tmp_path / "other"
    with h5py.File(tmp_path / "a.h5", "w") as file:
        write(file, other)
    os.mkfifo(other)
    assert told in refusal(tmp_path / "a.h5")


def in_groups(path: Path, *names: str) -> Path:
    """A log whose arrays lie in groups, one in the other."""
    with h5py.File(path, "w") as file:
        group = file
        for name in names:
            group = group.create_group(name)
        group["time"], group["q"] = TIME, Q
    return path


@pytest.mark.parametrize("names", [["a"] * 32, ["a" * 995]], ids=["deep", "long"])
def test_arrays_are_found_in_groups_as_deep_and_long_as_a_log_has_them(
    tmp_path: Path, names: list[str]
) -> None:
    np.testing.assert_array_equal(analyze(in_groups(tmp_path / "a.h5", *names), PLANAR3).q, Q)


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (["a"] * 3_000, "groups lie more than 32 deep, from 'a/a/a/a/a/a/…a/a/a/a/a/a' on; write the arrays"),
        (["a"] * 33, "groups lie more than 32 deep"),
        (
            ["a" * 996],
            "the path 'aaaaaaaaaaaa…aaaaaa/time' has 1,001 characters, and 1,000 are the most; give",
        ),
    ],
    ids=["deepest", "deep", "long"],
)
def test_groups_that_are_deeper_or_longer_than_any_log_has_are_not_walked(
    tmp_path: Path, names: list[str], told: str
) -> None:
    assert refusal(in_groups(tmp_path / "a.h5", *names)).startswith(told)


def test_rows_that_no_byte_stands_for_are_refused(tmp_path: Path) -> None:
    rows = 1 << 22
    empty = pa.nulls(rows, pa.float64())
    pq.write_table(pa.table(dict.fromkeys(("time", *JOINTS), empty)), tmp_path / "a.parquet")
    assert "bytes and promises 33,554,432 bytes of numbers; no log" in refusal(tmp_path / "a.parquet")


def test_long_text_that_every_row_has_is_not_read(tmp_path: Path) -> None:
    long = pa.DictionaryArray.from_arrays(np.zeros(len(TIME), np.int32), ["1" * 10_000_000])
    table = pa.table({"time": TIME, **dict.fromkeys(JOINTS, long)})
    pq.write_table(table, tmp_path / "a.parquet", store_schema=False)
    assert refusal(tmp_path / "a.parquet") == "column 'joint1' holds string, not numbers"


def test_file_without_lines_is_not_read_to_its_end_in_search_of_a_bag(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    path.touch()
    os.truncate(path, 1 << 30)
    told = "not a bag of ROS, or damaged (its first line is not '#ROSBAG V2.0'); mend it"
    assert refusal(path).startswith(told)


def test_pipe_in_the_folder_of_a_bag_is_refused(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", states(TABLE, JOINTS), "mcap")
    (bag / "bag.mcap").unlink()
    os.mkfifo(bag / "bag.mcap")
    told = f"{bag / 'bag.mcap'}: this is a pipe, which cannot be read twice; give a file"
    with pytest.raises(LinkwiseError) as caught:
        analyze(bag, PLANAR3)
    assert str(caught.value) == told
