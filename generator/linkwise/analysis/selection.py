"""Which column of a log is the time, and which is which joint."""

from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError


@dataclass(frozen=True)
class Selection:
    """Column numbers: the time's, each joint's in the robot's order; and the names left out."""

    time: int
    joints: tuple[int, ...]
    ignored: tuple[str, ...]

    @property
    def columns(self) -> tuple[int, ...]:
        """The columns to read: time first, then the joints."""
        return (self.time, *self.joints)


def select(columns: Sequence[str], joints: Sequence[str], reading: Reading) -> Selection:
    """Match columns to joints by --map, else by name; none may be left over unknowingly."""
    for name in columns:
        if list(columns).count(name) > 1:
            raise LinkwiseError(f"column {name!r} stands twice in the header; rename one")
    time = _time(columns, reading)
    source = {joint: joint for joint in joints}
    for column, joint in reading.mapping:
        if joint not in source:
            raise LinkwiseError(
                f"--map {column}={joint}: the robot has no joint {joint!r}; its joints are {_list(joints)}"
            )
        if column not in columns:
            raise LinkwiseError(
                f"--map {column}={joint}: the log has no column {column!r}; it has {_list(columns)}"
            )
        source[joint] = column
    missing = [joint for joint, column in source.items() if column not in columns]
    free = [c for c in columns if c not in source.values() and c != columns[time]]
    if missing:
        raise LinkwiseError(
            f"no column for joint {_list(missing)}; name it with --map COLUMN={missing[0]}"
            f" (columns not used: {_list(free) if free else 'none'})"
        )
    if free and not reading.ignore_extra:
        raise LinkwiseError(
            f"no joint for column {_list(free)}; leave such columns out with --ignore-extra,"
            " or map them with --map COLUMN=JOINT"
        )
    found = tuple(list(columns).index(column) for column in source.values())
    for joint, at in zip(source, found, strict=True):
        if found.count(at) > 1 or at == time:
            raise LinkwiseError(f"column {columns[at]!r} is asked to be joint {joint!r} and more")
    return Selection(time, found, tuple(free))


def _time(columns: Sequence[str], reading: Reading) -> int:
    if reading.time is not None:
        if reading.time not in columns:
            raise LinkwiseError(f"--time {reading.time}: no such column; the log has {_list(columns)}")
        return list(columns).index(reading.time)
    for at, name in enumerate(columns):
        if name.lower() in {"time", "t"}:
            return at
    raise LinkwiseError(
        f"no column 'time' in {_list(columns)}; say which one holds seconds with --time COLUMN"
    )


def _list(names: Sequence[str]) -> str:
    shown = ", ".join(repr(name) for name in names[:8])
    return shown + (f" and {len(names) - 8} more" if len(names) > 8 else "")
