"""Storage files of joint torques: those of OpenSim's inverse dynamics, and a file a coordinate of its shares.

Columns of the first are called as OpenSim's InverseDynamicsTool calls them, hip_flexion_r_moment and
pelvis_tx_force; a file of shares is called as such a column. Its own columns are the total, then by body what
the coordinate asks for of that body, its motion and its weight, then what it asks for by loads, and by what
the joint has of its own.
"""

from collections import Counter
from collections.abc import Iterator, Sequence

from linkwise.analysis.opensim.storage_file import StorageFile
from linkwise.analysis.result_quantities import PASSIVE
from linkwise.analysis.result_rows import ResultRows
from linkwise.errors import LinkwiseError

NAME, TITLE = "InverseDynamics", "Inverse Dynamics Generalized Forces"
TOTAL = "total"
SUFFIXES = {"rad": "moment", "m": "force"}
OF_LINK, OF_LOAD = "tau_link", "tau_load"


def torque_files(rows: ResultRows) -> Iterator[StorageFile]:
    """Yield the file of all torques and, where they are told by link, that of each coordinate's shares.

    Raises LinkwiseError for two shares of one name.
    """
    joint = rows.axes["joint"]
    totals = {at[0]: row for row, at in rows["tau"].listed()}
    names = {i: f"{joint.names[i]}_{SUFFIXES[joint.units[i]]}" for i in totals}
    if totals:
        yield _file(NAME, TITLE, [(names[i], row) for i, row in totals.items()])
    for i, row in totals.items() if OF_LINK not in rows.left_out else ():
        yield _file(names[i], names[i], [(TOTAL, row), *_shares(rows, i)])


def _file(name: str, title: str, columns: Sequence[tuple[str, int]]) -> StorageFile:
    names = tuple(column for column, _ in columns)
    for column, count in Counter(names).items():
        if count > 1:
            raise LinkwiseError(
                f"--sto: {count} columns of {name} would be called {column!r}; rename a body or load"
            )
    turns = (False,) * len(names)
    return StorageFile(name, title, names, tuple((row,) for _, row in columns), turns, has_angles=False)


def _shares(rows: ResultRows, joint: int) -> Iterator[tuple[str, int]]:
    """Yield the shares of a joint's torque by name, each with its row."""
    for quantity, axis, prefix in ((OF_LINK, "link", ""), (OF_LOAD, "load", "load_")):
        for row, at in rows[quantity].listed():
            if at[0] == joint:
                yield f"{prefix}{rows.axes[axis].names[at[1]]}", row
    for quantity in PASSIVE:
        for row, at in rows[quantity].listed():
            if at[0] == joint:
                yield quantity.removeprefix("tau_"), row
