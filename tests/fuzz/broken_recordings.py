"""Bags of ROS and files of arrays, broken."""

import io
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import h5py
import numpy as np
from helpers.bags import State, write_bag

from fuzz.broken_logs import log_case, random_rows
from fuzz.case import JOINTS, Case
from fuzz.mutations import NUMBERS, TEXTS, mutated_bytes

ODD = [float(value) for value in NUMBERS if not isinstance(value, int) or abs(value) < 1 << 1000]
"""Numbers that a float holds."""


def bag(rng: Random) -> Case:
    """A bag of ROS 2 in one file, or of ROS 1: bytes flipped, or messages that are not of one kind."""
    states = [State(round(row[0] * 1e9), JOINTS, tuple(row[1:])) for row in random_rows(rng) or [[0.0] * 4]]
    for _ in range(rng.randint(0, 3)):
        some = (*JOINTS, rng.choice(TEXTS).replace("\0", ""))
        names = tuple(rng.choice(some) for _ in range(rng.randrange(5)))
        position = tuple(rng.choice(ODD) for _ in range(rng.choice((len(names), 2))))
        stamp, topic = rng.choice((None, 0, 5, 10**17)), rng.choice(("/joint_states", "/other"))
        states[rng.randrange(len(states))] = State(stamp, names, position, topic=topic)
    name, storage = rng.choice((("log.mcap", "mcap"), ("log.db3", "sqlite3"), ("log.bag", "ros1")))
    with TemporaryDirectory() as folder:
        made = write_bag(Path(folder) / name, states, storage)
        content = (made / f"{name}{made.suffix}" if made.is_dir() else made).read_bytes()
    return log_case(rng, name, _perhaps_mutated(rng, content))


def arrays(rng: Random) -> Case:
    """An .npz or HDF5 file: bytes flipped, or arrays of other names, shapes and types."""
    table = np.array(random_rows(rng)).reshape(-1, 4)
    found: dict[str, object] = {"time": table[:, 0], "q": table[:, 1:], "joint_names": np.array(JOINTS, "S")}
    for _ in range(rng.randint(0, 3)):
        name = rng.choice(list(found))
        other = rng.choice(("t", "joint1", "qd", "tau", "arm/q", "arm/time", "a b", "joints", "q/joint1"))
        odd = (
            table.T,
            table[:3],
            1.0,
            np.zeros((0, 3)),
            np.array(["a", "b", ""], "S"),
            np.zeros((4, 3), "c8"),
        )
        found[rng.choice((name, other))] = rng.choice((found[name], *odd))
        if rng.random() < 0.5 and len(found) > 1:
            del found[name]
    buffer = io.BytesIO()
    if rng.random() < 0.5:
        np.savez(buffer, **found)
        return log_case(rng, "log.npz", _perhaps_mutated(rng, buffer.getvalue()))
    with h5py.File(buffer, "w") as file:
        for name, array in found.items():
            if not any(other.startswith(f"{name}/") for other in found):
                file[name] = array
    return log_case(rng, rng.choice(("log.h5", "log.hdf5")), _perhaps_mutated(rng, buffer.getvalue()))


def _perhaps_mutated(rng: Random, content: bytes) -> bytes:
    return mutated_bytes(rng, content) if rng.random() < 0.6 else content
