"""Which column of a log is the time, which is which joint, and in which unit its angles are."""

import math
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from linkwise_runtime.chosen_names import STATES, end_of_path, known_as, nearest_first

from linkwise.analysis.logs import Log
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

MOST_FOUND, LONGEST_FOUND = 6, 300
"""Names of columns that are offered in all, and letters of what is offered for one."""
PAST_LIMITS = 1.0
"""An angle so far past its joint's limits, in rad, is more likely one in degrees, as is one past a turn."""
SAYS_DEGREES = re.compile(r"(?<![^\W_])deg(?:rees?)?(?![^\W_])", re.IGNORECASE)
FAR = 100.0
"""m; a length beyond it is more likely one in mm."""
TIMES = ("time", "t")
"""Names of the time's column, in any case."""
STATE, SPEED = (f"/{state}" for state in STATES)
OLD_SPEED = "_u"
"""How states of OpenSim 3 end that are speeds."""
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

    columns: the names of a log's, each once

    Raises LinkwiseError for a joint without a column, a column used twice, and a column without a joint
    where that was not allowed.
    """
    time = time_column(columns, reading)
    source = _mapped(columns, joints, reading)
    at_column = {column: at for at, column in enumerate(columns)}
    missing = [joint for joint, column in source.items() if column not in at_column]
    used = {*source.values(), columns[time]}
    free = [column for column in columns if column not in used and column not in beside]
    speeds = {f"{column.removesuffix(STATE)}{SPEED}" for column in used if column.endswith(STATE)}
    speeds |= {f"{column}{OLD_SPEED}" for column in used}
    if missing:
        positions = [column for column in free if not column.endswith(SPEED)]
        raise LinkwiseError(
            f"no column for joint {with_nearest(missing, positions)}; name it with --map COLUMN={missing[0]}"
        )
    unasked = {*speeds, *brought, *(column for column in free if end_of_path(column) in coupled)}
    extra = [column for column in free if column not in unasked]
    if extra and not reading.ignore_extra:
        for column in extra:
            if (own := source.get(end_of_path(column))) is not None:
                raise LinkwiseError(
                    f"columns {own!r} and {column!r} are both of joint {end_of_path(column)!r}; leave what is"
                    " of none out with --ignore-extra"
                )
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
            f"--units {reading.units} contradicts the file, whose angles are in"
            f" {'degrees' if log.degrees else 'radians'}; leave --units out"
        )
    return math.pi / 180 if (log.degrees if told is None else told) else 1.0


@dataclass(frozen=True)
class Peak:
    """An angle's column, its largest magnitude there, and the largest that its joint may have in rad."""

    column: str
    magnitude: float
    reach: float = math.inf


def unit_warnings(log: Log, reading: Reading, peaks: Sequence[Peak]) -> tuple[str, ...]:
    """Warnings about a told unit of angles that is unlikely by their size.

    Raises LinkwiseError where the unit is not told: in a file whose header ought to, where a column's name
    says degrees, and where angles in radians would make more than a turn or pass their joint's limits. No
    simulator has degrees.
    """
    if not peaks or reading.qpos is not None:
        return ()
    told = reading.units is not None or log.degrees is not None
    if log.path.suffix.lower() in {".mot", ".sto"} and not told:
        raise LinkwiseError("the header has no inDegrees: say what angles are in with --units deg or rad")
    in_radians = radians_per_unit(log, reading) == 1.0
    largest = max(peaks, key=lambda peak: peak.magnitude)
    if not in_radians and 0 < largest.magnitude <= math.pi:
        size = f"{largest.magnitude:.4g} degrees ({largest.column!r})"
        return (f"no angle exceeds {size}: if that is radians, pass --units rad",)
    doubts = tuple(_doubts(peaks, largest, told)) if in_radians else ()
    if doubts and not told:
        raise LinkwiseError(f"{doubts[0]}: say what angles are in with --units deg or rad")
    return tuple(f"{doubt}: if that is degrees, pass --units deg" for doubt in doubts[:1])


def _doubts(peaks: Sequence[Peak], largest: Peak, told: bool) -> Iterator[str]:
    """Why angles are hardly in radians; their names and limits count only where nobody told that they are."""
    if largest.magnitude > math.tau:
        turns = f"{largest.magnitude / math.tau:.1f} turns"
        yield f"column {largest.column!r} reaches {largest.magnitude:.4g} rad, {turns}"
    for peak in () if told else peaks:
        if SAYS_DEGREES.search(peak.column):
            yield f"column {peak.column!r} speaks of degrees"
        if peak.magnitude > peak.reach + PAST_LIMITS:
            limit = f"the limits of its joint {peak.reach:.4g}"
            yield f"column {peak.column!r} reaches {peak.magnitude:.4g} rad, {limit}"


def far_warnings(peaks: Sequence[Peak]) -> tuple[str, ...]:
    """Warnings about lengths, in the log, that are unlikely by their size."""
    return tuple(
        f"column {peak.column!r} reaches {peak.magnitude:.4g} m: if that is mm, divide it by 1000"
        for peak in peaks
        if peak.magnitude > FAR
    )


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
    taken: dict[str, str] = {}
    for column, given in reading.pairs:
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
        if taken.setdefault(joint, column) != column:
            raise LinkwiseError(
                f"--map {column}={joint}: column {taken[joint]!r} is that joint already; keep one"
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
