"""Bags and files of arrays: the same movement gives what its CSV gives, the unclear is refused."""

import contextlib
import shutil
import sqlite3
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from helpers.bags import states, write_bag
from helpers.motion_logs import JOINTS, PLANAR3, smooth, write_csv
from linkwise import analyze, identify
from linkwise.analysis.logs import open_log
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError
from numpy.typing import NDArray

TABLE = smooth(80, 3)
TIME, Q = TABLE[:, 0], TABLE[:, 1:]


def folder(path: Path) -> Path:
    return write_bag(path / "bag", states(TABLE, JOINTS), "mcap")


def mcap(path: Path) -> Path:
    return folder(path) / "bag.mcap"


def sqlite(path: Path) -> Path:
    return write_bag(path / "bag", states(TABLE, JOINTS), "sqlite3")


def db3(path: Path) -> Path:
    return sqlite(path) / "bag.db3"


def ros1(path: Path) -> Path:
    return write_bag(path / "a.bag", states(TABLE, JOINTS), "ros1")


def npz(path: Path) -> Path:
    np.savez(path / "a.npz", time=TIME, q=Q[:, ::-1], joint_names=JOINTS[::-1])
    return path / "a.npz"


def hdf5(path: Path) -> Path:
    with h5py.File(path / "a.h5", "w") as file:
        file["run/time"] = TIME[None, :]
        file["run/position"] = Q.T
        file["run/position"].attrs["joint_names"] = list(JOINTS)
    return path / "a.h5"


@pytest.mark.parametrize("write", [folder, mcap, sqlite, db3, ros1, npz, hdf5])
def test_a_movement_is_the_same_in_every_format(tmp_path: Path, write: Callable[[Path], Path]) -> None:
    expected = analyze(write_csv(tmp_path / "a.csv", TABLE), PLANAR3)
    found = analyze(write(tmp_path), PLANAR3)
    np.testing.assert_allclose(found.values, expected.values, rtol=1e-12, atol=1e-12)
    assert found.columns == expected.columns
    assert found.warnings == ()


def test_a_bag_without_definitions_of_messages_is_read(tmp_path: Path) -> None:
    """Recorders before ROS 2 Iron wrote such bags."""
    path = db3(tmp_path)
    with contextlib.closing(sqlite3.connect(path)) as file:
        file.executescript(
            "DROP TABLE message_definitions; DROP TABLE schema; DROP TABLE metadata;"
            " ALTER TABLE topics DROP COLUMN type_description_hash"
        )
    np.testing.assert_array_equal(analyze(path, PLANAR3).q, Q)


def test_uneven_time_is_told_about_resampling(tmp_path: Path) -> None:
    time = np.round(np.cumsum(np.random.default_rng(1).uniform(0.007, 0.013, 300)), 9)
    time -= time[0]
    signal = [lambda at, k=k: np.sin((2 + k) * at + k) for k in range(3)]
    jitter = np.column_stack([time, *(of(time) for of in signal)])
    dropped = np.delete(TABLE, 30, axis=0)
    np.savez(tmp_path / "a.npz", time=dropped[:, 0], q=dropped[:, 1:])
    with pytest.raises(
        LinkwiseError, match=r"a\.npz: rows 30 to 31, .* gap of 0.02 .*; fill it, or .* --resample 100"
    ):
        analyze(tmp_path / "a.npz", PLANAR3)
    gap = write_bag(tmp_path / "gap", states(dropped, JOINTS))
    with pytest.raises(LinkwiseError, match=r"gap: rows 30 to 31, time column: a gap of 0.02 "):
        analyze(gap, PLANAR3)
    bag = write_bag(tmp_path / "bag", states(jitter, JOINTS))
    with pytest.raises(
        LinkwiseError, match=r"bag: row \d+, time column: a step of .* --resample (99|100)\.\d+"
    ):
        analyze(bag, PLANAR3)
    found = analyze(bag, PLANAR3, Reading(resample=100.0))
    np.testing.assert_allclose(found.q, np.stack([of(found.time) for of in signal], 1), atol=1e-6)


def test_messages_may_have_joints_in_any_order_and_those_of_others_between(tmp_path: Path) -> None:
    messages = states(TABLE, JOINTS)
    for at in range(0, len(messages), 3):
        messages[at] = replace(messages[at], names=JOINTS[::-1], position=messages[at].position[::-1])
    others = [
        replace(said, names=["finger"], position=[1.0], stamp=said.stamp - 5_000_000) for said in messages
    ]
    log = open_log(
        write_bag(tmp_path / "bag", [m for both in zip(others, messages, strict=True) for m in both])
    )
    assert log.columns == ("time", "recorded", "finger", *JOINTS[::-1])
    ((block, done),) = log.read([log.columns.index(joint) for joint in JOINTS])
    np.testing.assert_array_equal(block, Q)
    assert done == log.size == 160
    with pytest.raises(LinkwiseError, match="no joint for column 'finger'; leave such columns out"):
        analyze(log.path, PLANAR3)
    with pytest.raises(
        LinkwiseError, match=r"bag: message 1 has 'finger' and no position of 'joint3'.* --lock"
    ):
        list(log.read(range(6)))


def test_repeated_messages_count_once_and_stamps_that_mislead_are_named(tmp_path: Path) -> None:
    messages = states(TABLE, JOINTS)
    twice = write_bag(tmp_path / "twice", [m for said in messages for m in (said, said)])
    np.testing.assert_array_equal(analyze(twice, PLANAR3).q, Q)
    other = [*messages[:9], replace(messages[8], position=(0, 0, 0)), *messages[9:]]
    with pytest.raises(
        LinkwiseError, match=r"message 10: its stamp repeats 0.08 s with other values; .*--time recorded"
    ):
        analyze(write_bag(tmp_path / "other", other), PLANAR3)
    reset = [
        replace(said, stamp=said.stamp % 400_000_000, late=said.stamp // 400_000_000 * 400_000_000)
        for said in messages
    ]
    back = write_bag(tmp_path / "back", reset)
    with pytest.raises(LinkwiseError, match=r"back: message 41: its stamp runs back to 0 s"):
        analyze(back, PLANAR3)


def test_the_recorders_time_stands_in_for_stamps(tmp_path: Path) -> None:
    late = [replace(said, stamp=None, late=said.stamp) for said in states(TABLE, JOINTS)]
    found = analyze(write_bag(tmp_path / "bag", late), PLANAR3)
    np.testing.assert_allclose(found.time, TIME, atol=1e-12)
    assert found.warnings == ("messages of /joint_states have no stamps: the time is that of recording",)
    slow = write_bag(tmp_path / "slow", [replace(said, late=said.stamp) for said in states(TABLE, JOINTS)])
    found = analyze(slow, PLANAR3, Reading(time="recorded"))
    np.testing.assert_allclose(found.time, 2 * TIME, atol=1e-12)


def test_a_topic_is_chosen(tmp_path: Path) -> None:
    messages = states(TABLE, JOINTS)
    both = [m for said in messages for m in (said, replace(said, topic="/wanted", position=[1, 2, 3]))]
    bag = write_bag(tmp_path / "bag", both)
    with pytest.raises(
        LinkwiseError, match=r"in several topics: /joint_states \(80 messages\), /wanted .* --topic"
    ):
        analyze(bag, PLANAR3)
    with pytest.raises(LinkwiseError, match=r"--topic /tf: no joint states there; they are in /joint_states"):
        analyze(bag, PLANAR3, Reading(topic="/tf"))
    np.testing.assert_array_equal(analyze(bag, PLANAR3, Reading(topic="joint_states")).q, Q)


def test_measured_torques_are_found_and_need_not_be_left_out(tmp_path: Path) -> None:
    table = smooth(600, 3)
    tau = analyze(write_csv(tmp_path / "a.csv", table), PLANAR3).torque
    messages = [
        replace(said, velocity=effort, effort=effort)
        for said, effort in zip(states(table, JOINTS), tau.tolist(), strict=True)
    ]
    np.savez(tmp_path / "a.npz", t=table[:, 0], q=table[:, 1:], dq=tau, tau=tau)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"] = table[:, 0]
        for at, joint in enumerate(JOINTS):
            file[f"{joint}/position"], file[f"effort/{joint}"] = table[:, 1 + at], tau[:, at]
    for path in (write_bag(tmp_path / "bag", messages), tmp_path / "a.npz", tmp_path / "a.h5"):
        found = identify(path, PLANAR3)
        np.testing.assert_array_equal(found.log.torque, tau)
        np.testing.assert_array_equal(analyze(path, PLANAR3).q, table[:, 1:])


@pytest.mark.parametrize(
    ("arrays", "reading", "message"),
    [
        ({"q": Q}, {}, r"no array of times in 'q' \(80, 3\); call it 'time', in s, or name it with --time"),
        ({"q": Q, "t": TIME}, {"time": "clock"}, r"no array of times 'clock' in 'q' \(80, 3\), 't' \(80,\)"),
        ({"t": TIME, "q": Q[:70]}, {}, r"array 'q' is \(70, 3\) and 't' has 80 samples"),
        (
            {"t": TIME, "q": Q[:, :2]},
            {},
            r"array 'q' is \(80, 2\), and the robot has 3 joints; name its columns",
        ),
        (
            {"t": TIME, "q": Q, "joints": JOINTS[:2]},
            {},
            r"array 'q' is \(80, 3\), and 2 names; name its columns",
        ),
        (
            {"t": TIME, "q": Q, "joints": ["a", "a", "b"]},
            {},
            "'a' names two columns of 'q'; name each joint once",
        ),
        (
            {"t": TIME, "q": Q, "joints": np.array(JOINTS, object)},
            {},
            "array 'joints' holds Python objects; save texts",
        ),
        ({"t": TIME, "q": Q, "position": Q}, {}, r"no joint for column 'position\[0\]', 'position\[1\]'"),
        (
            {"a/t": TIME, "b/t": TIME, "a/q": Q, "b/q": Q},
            {},
            "times in several groups, /a, /b; choose one with --t",
        ),
        ({"a/t": TIME, "a/q": Q}, {"topic": "b"}, "--topic b: no such group with times; they are in /a"),
        ({"t": TIME, "joint1": TIME}, {}, "no column for joint 'joint2', 'joint3'"),
    ],
)
def test_arrays_that_are_not_clear_are_refused(
    tmp_path: Path, arrays: dict, reading: dict, message: str
) -> None:
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(LinkwiseError, match=rf"a\.npz: {message}"):
        analyze(tmp_path / "a.npz", PLANAR3, Reading(**reading))


def test_groups_have_clocks_of_their_own_or_that_above(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        file["time"], file["arm/q"], file["camera/time"] = TIME, Q, TIME[::8]
        file["camera/pose"], file["arm/image"], file["title"] = Q[::8], np.zeros((80, 2, 2)), "a movement"
    np.testing.assert_array_equal(analyze(tmp_path / "a.hdf5", PLANAR3, Reading(topic="/arm")).q, Q)
    columns = open_log(tmp_path / "a.hdf5", Reading(topic="/"), JOINTS).columns
    assert columns == ("time", *JOINTS)


def test_the_robots_order_is_taken_and_said_where_nothing_names_joints(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", time=TIME, q=Q)
    found = analyze(tmp_path / "a.npz", PLANAR3)
    np.testing.assert_array_equal(found.q, Q)
    (warning,) = found.warnings
    assert "nothing names the columns of 'q': they are taken for the robot's joints joint1, joint2" in warning


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.trc", "markers and force plates, not joints; give the .mot or .sto that inverse kinematics"),
        ("a.mcap", r"a\.mcap: not a bag of ROS, or damaged \("),
        ("a.db3", r"a\.db3: not a bag of ROS, or damaged \("),
        ("a.bag", r"a\.bag: not a bag of ROS, or damaged \("),
        ("a.npz", r"a\.npz: not an \.npz file, or damaged \("),
        ("a.h5", r"a\.h5: not an HDF5 file, or damaged \("),
    ],
)
def test_other_files_are_named(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / name).write_bytes(b"DataType=Vec3\nendheader\ntime\ta\n0\t1,2,3\n" * 9)
    with pytest.raises(LinkwiseError, match=message):
        open_log(tmp_path / name)


def test_other_folders_profiles_and_topics_are_named(tmp_path: Path) -> None:
    with pytest.raises(LinkwiseError, match=r"not that of a bag: it has no metadata\.yaml; give a file"):
        open_log(tmp_path)
    bag = mcap(tmp_path)
    content = bag.read_bytes()
    assert content[21:25] == b"ros2"
    bag.write_bytes(content[:21] + b"json" + content[25:])
    with pytest.raises(
        LinkwiseError, match=r"bag\.mcap: MCAP with the profile 'json', and not 'ros2'; record"
    ):
        open_log(bag)
    with pytest.raises(
        LinkwiseError, match=r"a\.csv: --topic goes with bags and files of arrays; leave it out"
    ):
        open_log(write_csv(tmp_path / "a.csv", TABLE), Reading(topic="/joint_states"))


@pytest.mark.parametrize("write", [mcap, db3, ros1, npz, hdf5])
def test_a_file_cut_off_is_named(tmp_path: Path, write: Callable[[Path], Path]) -> None:
    path = write(tmp_path)
    content = path.read_bytes()
    for count in (len(content) // 3, len(content) - 40, len(content) - 1):
        path.write_bytes(content[:count])
        with pytest.raises(
            LinkwiseError,
            match=rf"^{path}: not an? .* or damaged \(.*\); (write the file|mend it with .*) again$",
        ):
            analyze(path, PLANAR3)


def test_what_a_recorder_left_beside_a_database_is_not_left_out(tmp_path: Path) -> None:
    bag = sqlite(tmp_path)
    with contextlib.closing(sqlite3.connect(bag / "bag.db3")) as base:
        base.execute("pragma journal_mode = wal")
        base.execute("update messages set timestamp = timestamp")
        base.commit()
        shutil.copytree(bag, tmp_path / "copy")
    (tmp_path / "latest.db3").symlink_to(tmp_path / "copy/bag.db3")
    for copy in (tmp_path / "copy", tmp_path / "copy/bag.db3", tmp_path / "latest.db3"):
        with pytest.raises(LinkwiseError, match=r"bag\.db3-wal has what .* last, .*`sqlite3 \w+\.db3 "):
            analyze(copy, PLANAR3)
    with contextlib.closing(sqlite3.connect(tmp_path / "copy/bag.db3")) as base:
        base.execute("pragma journal_mode = delete")
    np.testing.assert_allclose(analyze(tmp_path / "copy", PLANAR3).q, Q, rtol=1e-12)


def test_a_folder_of_a_bag_may_be_called_like_a_file_in_capitals(tmp_path: Path) -> None:
    np.testing.assert_allclose(analyze(sqlite(tmp_path).rename(tmp_path / "D.DB3"), PLANAR3).q, Q, rtol=1e-12)


def test_a_bag_in_capitals_is_told_apart_from_a_damaged_one(tmp_path: Path) -> None:
    (tmp_path / "BAG.DB3").write_bytes((sqlite(tmp_path) / "bag.db3").read_bytes())
    with pytest.raises(LinkwiseError, match=r"bags are found by small letters; name it …\.db3"):
        analyze(tmp_path / "BAG.DB3", PLANAR3)


@pytest.mark.parametrize("write", [folder, sqlite])
def test_a_bag_with_fewer_messages_than_it_promises_is_refused(
    tmp_path: Path, write: Callable[[Path], Path]
) -> None:
    told = write(tmp_path) / "metadata.yaml"
    told.write_text(told.read_text().replace("message_count: 80", "message_count: 99"))
    with pytest.raises(LinkwiseError, match=r"80 messages of /\w+ are there, and 99 are promised; add"):
        analyze(told.parent, PLANAR3)


def test_a_file_may_name_its_joints_itself(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"], file["q"] = TIME, Q[:, ::-1]
        file.attrs["joint_names"] = list(JOINTS[::-1])
    np.testing.assert_allclose(analyze(tmp_path / "a.h5", PLANAR3).q, Q, atol=1e-12)


def test_units_of_datasets_count(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    for units, factor in (("degrees", 180 / np.pi), ("rad", 1.0)):
        with h5py.File(path, "w") as file:
            file["time"], file["q"], file["joint_names"] = TIME, Q * factor, [list(JOINTS)]
            file["q"].attrs["units"] = units
        np.testing.assert_allclose(analyze(path, PLANAR3).q, Q, rtol=1e-14)
    with pytest.raises(LinkwiseError, match="--units deg contradicts the file, whose angles are in radians"):
        analyze(path, PLANAR3, Reading(units="deg"))
    with h5py.File(path, "w") as file:
        file["time"] = TIME
        for name, values, units in zip(JOINTS, Q.T, ("deg", "rad", ""), strict=True):
            file[name] = values
            file[name].attrs["unit"] = units
    with pytest.raises(LinkwiseError, match="arrays 'joint1', 'joint2' are in rad and in degrees"):
        analyze(path, PLANAR3)


@pytest.mark.parametrize(
    ("q", "told"), [(Q[:, None], r"\(80, 1, 3\)"), (Q + 0j, r"\(80, 3\) without numbers")]
)
def test_positions_that_cannot_be_are_named(tmp_path: Path, q: NDArray[Any], told: str) -> None:
    np.savez(tmp_path / "a.npz", time=TIME, q=q)
    with pytest.raises(LinkwiseError, match=rf"a.npz: array 'q' is {told}; positions are numbers, \("):
        analyze(tmp_path / "a.npz", PLANAR3)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("time", "columns 1 and 3 are both named 'time'"),
        ("recorded", "columns 2 and 3 are both named 'recorded'"),
        ("joint2/velocity", "columns 3 and 7 are both named 'joint2/velocity'"),
    ],
)
def test_a_joint_of_a_bag_that_is_called_as_another_column_is_refused(
    tmp_path: Path, name: str, message: str
) -> None:
    names = (name, *JOINTS[1:])
    messages = [replace(said, velocity=said.position) for said in states(TABLE, names)]
    with pytest.raises(LinkwiseError, match=message):
        open_log(write_bag(tmp_path / "bag", messages))


def test_arrays_of_one_name_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, time=TIME, q=Q)
    with zipfile.ZipFile(path, "a") as file, pytest.warns(UserWarning, match="Duplicate name"):
        file.writestr("q.npy", file.read("q.npy"))
    with pytest.raises(LinkwiseError, match=r"a\.npz: arrays 2 and 3 are both named 'q'; rename one"):
        open_log(path, joints=JOINTS)
    np.savez(path, clock=TIME, q=Q, names=["clock", *JOINTS[1:]])
    with pytest.raises(LinkwiseError, match=r"a\.npz: columns 1 and 2 are both named 'clock'; rename one"):
        open_log(path, Reading(time="clock"), ("clock", *JOINTS[1:]))
