"""Matching of a log's columns: the time, each joint's column, and the unit of angles."""

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from linkwise_runtime.chosen_names import STATES, end_of_path, known_as, nearest_first

from linkwise.analysis.logs import Log
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

MOST_FOUND, LONGEST_FOUND = 6, 300
"""Most column names offered in one message, and most characters for one wanted name."""
PAST_LIMITS = 1.0
"""An angle that exceeds its joint's limits by this, in rad, or a turn at all, is more likely in degrees."""
SAYS_DEGREES = re.compile(r"(?<![^\W_])deg(?:rees?)?(?![^\W_])", re.IGNORECASE)
FAR = 100.0
"""Length in m beyond which a column is more likely in mm."""
TIMES = ("time", "t")
"""Names of the time column, in upper or lower case."""
STATE, SPEED = (f"/{state}" for state in STATES)
OLD_SPEED = "_u"
"""Ending of the states of OpenSim 3 that are speeds."""
JOINTS = "/jointset/"
"""Beginning of OpenSim's coordinate paths, /jointset/JOINT/COORDINATE; among states, /value is added."""


@dataclass(frozen=True)
class Selection:
    """Column numbers of the time and of each joint, in the robot's order, and the names left out."""

    time: int
    joints: tuple[int, ...]
    ignored: tuple[str, ...]

    @property
    def columns(self) -> tuple[int, ...]:
        """Numbers of the columns to read: time first, then the joints."""
        return (self.time, *self.joints)


def select(
    columns: Sequence[str],
    joints: Sequence[str],
    reading: Reading,
    beside: Collection[str] = (),
    brought: Collection[str] = (),
    coupled: Collection[str] = (),
    inputs: Collection[str] = (),
) -> Selection:
    """Match columns to joints by `reading.mapping`, else by name, also as OpenSim's states name them.

    columns: the names of a log's columns, each once
    beside: columns of no joint that are read elsewhere
    brought: columns that the log's format adds by itself
    coupled: joints that follow others by the robot's file; their columns and those of `brought` may be left
    out without `reading.ignore_extra`
    inputs: those of `joints` that are inputs

    Raises LinkwiseError for a joint without a column, a column used twice, and a column without a joint
    where that was not allowed.
    """
    time = time_column(columns, reading)
    source = _mapped(columns, joints, reading)
    at_column = {column: at for at, column in enumerate(columns)}
    used = {*source.values(), columns[time]}
    free = tuple(column for column in columns if column not in used and column not in beside)
    missing = [joint for joint, column in source.items() if column not in at_column]
    _refuse_missing("joint", [joint for joint in missing if joint not in inputs], free)
    _refuse_missing("input", missing, free)
    if not reading.ignore_extra:
        allowed = {*_speeds_of(used), *brought}
        _refuse_extra([one for one in free if one not in allowed and end_of_path(one) not in coupled], source)
    found = tuple(at_column[column] for column in source.values())
    for joint, at in zip(source, found, strict=True):
        if found.count(at) > 1 or at == time:
            raise LinkwiseError(f"column {columns[at]!r} is asked to be joint {joint!r} and more")
    return Selection(time, found, free)


def _speeds_of(positions: Iterable[str]) -> Iterator[str]:
    """Yield the names that OpenSim has for the speeds of states."""
    for column in positions:
        yield f"{column}{OLD_SPEED}"
        if column.endswith(STATE):
            yield f"{column.removesuffix(STATE)}{SPEED}"


def _refuse_missing(what: str, joints: Sequence[str], free: Sequence[str]) -> None:
    """Raise LinkwiseError for joints without a column, with the nearest of the columns without a joint.

    what: joint or input
    """
    if joints:
        near = with_nearest(joints, [column for column in free if not column.endswith(SPEED)])
        held = " ".join(f"--lock {joint}=VALUE" for joint in joints[:MOST_FOUND])
        mends = [f"name it with --map COLUMN={joints[0]}"] if free or what != "joint" else []
        mends += [f"hold what the log leaves out with {held}, in rad or m"] if what == "joint" else []
        raise LinkwiseError(f"no column for {what} {near}; {', or '.join(mends)}")


def _refuse_extra(columns: Sequence[str], source: Mapping[str, str]) -> None:
    """Raise LinkwiseError for columns of no joint; source: the column of each joint."""
    for column in columns:
        if (own := source.get(end_of_path(column))) is not None:
            raise LinkwiseError(
                f"columns {own!r} and {column!r} are both of joint {end_of_path(column)!r}; leave what is"
                " of none out with --ignore-extra"
            )
    if columns:
        raise LinkwiseError(
            f"no joint for column {listed(map(repr, columns))}; leave such columns out with --ignore-extra,"
            " or map them with --map COLUMN=JOINT"
        )


def with_columns(
    columns: Sequence[str], joints: Sequence[str], optional: Collection[str], reading: Reading
) -> tuple[int, ...]:
    """Return the numbers of the joints to read: `optional` ones only if the log has a column for them.

    Raises LinkwiseError for a mapping whose joint or column does not exist.
    """
    source = _mapped(columns, joints, reading)
    return tuple(k for k, joint in enumerate(joints) if joint not in optional or source[joint] in columns)


def radians_per_unit(log: Log, reading: Reading) -> float:
    """Return the factor that brings the log's angles to radians.

    Raises LinkwiseError where file and user disagree.
    """
    told = None if reading.units is None else reading.units == "deg"
    if told is not None and log.degrees is not None and told != log.degrees:
        raise LinkwiseError(
            f"--units {reading.units} contradicts the file, whose angles are in"
            f" {'degrees' if log.degrees else 'radians'}; leave --units out"
        )
    return math.pi / 180 if (log.degrees if told is None else told) else 1.0


@dataclass(frozen=True)
class Peak:
    """A joint's column and its largest magnitude in the log.

    `reach` is the largest magnitude that the joint's limits allow, in rad or m.
    """

    column: str
    magnitude: float
    reach: float = math.inf


def unit_warnings(log: Log, reading: Reading, peaks: Sequence[Peak]) -> tuple[str, ...]:
    """Return warnings about a stated unit of angles that is unlikely, given their size.

    Raises LinkwiseError where the unit is not stated: in a file whose header should state it, where the name
    of a column says degrees, and where angles in radians would exceed a turn or their joint's limits.
    Positions of simulators are never in degrees.
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
    """Yield reasons why the angles are hardly in radians.

    Column names and joint limits count only where nobody stated that they are.
    """
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
    """Return warnings about lengths in the log whose size is unlikely."""
    return tuple(
        f"column {peak.column!r} reaches {peak.magnitude:.4g} m: if that is mm, divide it by 1000"
        for peak in peaks
        if peak.magnitude > FAR
    )


def time_column(columns: Sequence[str], reading: Reading) -> int:
    """Return the number of the time column; raises LinkwiseError where there is none."""
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
    """Return the wanted names as text, each with the names found, the nearest first.

    Such a text is 'knee_r' (found 'knee', 'hip').
    """
    if not found:
        return f"{listed(map(repr, wanted))} (found none)"
    shown = max(1, MOST_FOUND // len(wanted))
    near = {name: listed(map(repr, nearest_first(name, found)[:shown])) for name in wanted}
    return listed((f"{name!r} (found {those})" for name, those in near.items()), longest=LONGEST_FOUND)


def _mapped(columns: Sequence[str], joints: Sequence[str], reading: Reading) -> dict[str, str]:
    """Return the name of each joint's column by the joint's name, in the robot's order."""
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
    """Return the column with a joint's name, else the only path of OpenSim to that coordinate.

    Where there is neither, return the joint's name.
    """
    paths = [
        column
        for column in columns
        if end_of_path(column) == joint
        and (column.endswith(STATE) or (column.startswith(JOINTS) and not column.endswith(SPEED)))
    ]
    return paths[0] if joint not in columns and len(paths) == 1 else joint
