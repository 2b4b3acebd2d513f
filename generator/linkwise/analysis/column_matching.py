"""Which column of a log is the time, which is which joint, and in which unit its angles are."""

import math
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from linkwise.analysis.logs import Log
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.runtime.chosen_names import STATES, end_of_path, known_as, nearest_first

MOST_FOUND, LONGEST_FOUND = 6, 300
"""Names of columns that are offered in all, and letters of what is offered for one."""
MANY_TURNS = 4 * math.pi
"""An angle past two turns in radians is more likely one in degrees."""
TIMES = ("time", "t")
"""Names of the time's column, in any case."""
STATE, SPEED = (f"/{state}" for state in STATES)
JOINTS = "/jointset/"
"""How OpenSim's paths of coordinates begin, /jointset/JOINT/COORDINATE, with /value behind among states."""


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


def select(
    columns: Sequence[str],
    joints: Sequence[str],
    reading: Reading,
    beside: Collection[str] = (),
    brought: Collection[str] = (),
    coupled: Collection[str] = (),
) -> Selection:
    """Match columns to joints by `reading.mapping`, else by name, also as OpenSim's states name them.

    beside: columns that are of no joint, and asked for elsewhere
    brought: columns that the log's format has of itself, and coupled: joints that follow others by the
    robot's file, whose columns may be left out unasked

    Raises LinkwiseError for a joint without a column, a column used twice, and a column without a joint
    where that was not allowed.
    """
    twice = [name for name, count in Counter(columns).items() if count > 1]
    if twice:
        raise LinkwiseError(f"column {twice[0]!r} stands twice in the header; rename one")
    time = time_column(columns, reading)
    source = _mapped(columns, joints, reading)
    at_column = {column: at for at, column in enumerate(columns)}
    missing = [joint for joint, column in source.items() if column not in at_column]
    used = {*source.values(), columns[time]}
    free = [column for column in columns if column not in used and column not in beside]
    speeds = {f"{column.removesuffix(STATE)}{SPEED}" for column in used if column.endswith(STATE)}
    if missing:
        positions = [column for column in free if not column.endswith(SPEED)]
        raise LinkwiseError(
            f"no column for joint {with_nearest(missing, positions)}; name it with --map COLUMN={missing[0]}"
        )
    unasked = {*speeds, *brought, *(column for column in free if end_of_path(column) in coupled)}
    extra = [column for column in free if column not in unasked]
    if extra and not reading.ignore_extra:
        raise LinkwiseError(
            f"no joint for column {listed(map(repr, extra))}; leave such columns out with --ignore-extra,"
            " or map them with --map COLUMN=JOINT"
        )
    found = tuple(at_column[column] for column in source.values())
    for joint, at in zip(source, found, strict=True):
        if found.count(at) > 1 or at == time:
            raise LinkwiseError(f"column {columns[at]!r} is asked to be joint {joint!r} and more")
    return Selection(time, found, tuple(free))


def with_columns(
    columns: Sequence[str], joints: Sequence[str], optional: Collection[str], reading: Reading
) -> tuple[int, ...]:
    """Which joints are to be read: those `optional` only where the log has a column for them.

    Raises LinkwiseError for a mapping of what is not there.
    """
    source = _mapped(columns, joints, reading)
    return tuple(k for k, joint in enumerate(joints) if joint not in optional or source[joint] in columns)


def radians_per_unit(log: Log, reading: Reading) -> float:
    """Factor that brings the log's angles to radians; LinkwiseError where file and user disagree."""
    told = None if reading.units is None else reading.units == "deg"
    if told is not None and log.degrees is not None and told != log.degrees:
        raise LinkwiseError(
            f"--units {reading.units} contradicts the file's"
            f" inDegrees={'yes' if log.degrees else 'no'}; leave --units out"
        )
    return math.pi / 180 if (log.degrees if told is None else told) else 1.0


def unit_warnings(log: Log, reading: Reading, peaks: Sequence[tuple[str, float]]) -> tuple[str, ...]:
    """Warnings about a told unit of angles that is unlikely by their size.

    peaks: column and largest magnitude, as written in the log, of every angle

    Raises LinkwiseError where the unit is not told: in a file whose header ought to, and where angles in
    radians would turn many times.
    """
    if not peaks:
        return ()
    told = reading.units is not None or log.degrees is not None
    if log.path.suffix.lower() in {".mot", ".sto"} and not told:
        raise LinkwiseError("the header has no inDegrees: say what angles are in with --units deg or rad")
    in_radians = radians_per_unit(log, reading) == 1.0
    column, peak = max(peaks, key=lambda item: item[1])
    if in_radians and peak > MANY_TURNS:
        turns = f"column {column!r} reaches {peak:.4g} rad, {peak / math.tau:.1f} turns"
        if not told:
            raise LinkwiseError(f"{turns}: say what angles are in with --units deg or rad")
        return (f"{turns}: if that is degrees, pass --units deg",)
    if not in_radians and 0 < peak <= math.pi:
        return (f"no angle exceeds {peak:.4g} degrees ({column!r}): if that is radians, pass --units rad",)
    return ()


def time_column(columns: Sequence[str], reading: Reading) -> int:
    """Number of the column of the time; raises LinkwiseError where none is."""
    if reading.time is not None:
        if reading.time not in columns:
            raise LinkwiseError(
                f"--time {reading.time}: no such column; the log has"
                f" {listed(map(repr, nearest_first(reading.time, columns)))}"
            )
        return list(columns).index(reading.time)
    for at, name in enumerate(columns):
        if name.lower() in TIMES:
            return at
    near = listed(map(repr, nearest_first("time", columns)))
    raise LinkwiseError(f"no column 'time' in {near}; say which one holds seconds with --time COLUMN")


def with_nearest(wanted: Sequence[str], found: Sequence[str]) -> str:
    """What is wanted, each beside what was found, the nearest first: 'knee_r' (found 'knee', 'hip')."""
    if not found:
        return f"{listed(map(repr, wanted))} (found none)"
    shown = max(1, MOST_FOUND // len(wanted))
    near = {name: listed(map(repr, nearest_first(name, found)[:shown])) for name in wanted}
    return listed((f"{name!r} (found {those})" for name, those in near.items()), longest=LONGEST_FOUND)


def _mapped(columns: Sequence[str], joints: Sequence[str], reading: Reading) -> dict[str, str]:
    """Name of each joint's column, in the robot's order."""
    source = {joint: _named(joint, columns) for joint in joints}
    for column, given in reading.mapping:
        joint = known_as(given, joints)
        if joint is None:
            raise LinkwiseError(
                f"--map {column}={given}: the robot has no joint {given!r}; its joints are"
                f" {listed(map(repr, nearest_first(given, joints)))}"
            )
        if column not in columns:
            raise LinkwiseError(
                f"--map {column}={joint}: the log has no column {column!r}; it has"
                f" {listed(map(repr, nearest_first(column, columns)))}"
            )
        source[joint] = column
    return source


def _named(joint: str, columns: Sequence[str]) -> str:
    """The column of a joint's name; where there is none, the only path of OpenSim's to that coordinate."""
    paths = [
        column
        for column in columns
        if end_of_path(column) == joint
        and (column.endswith(STATE) or (column.startswith(JOINTS) and not column.endswith(SPEED)))
    ]
    return paths[0] if joint not in columns and len(paths) == 1 else joint
