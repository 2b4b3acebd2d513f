"""Calls of the links' functions, and the place that each writes to: the decisions behind a robot's C file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from linkwise.emit.c.form_function import CFormFunction
from linkwise.emit.c.prototypes import NUMBERS, pointers
from linkwise.emit.c.sizes import EntryCounts, Span, most_counts, whole


@dataclass(frozen=True)
class LinkFormFunctions:
    """The functions of one link's closed forms."""

    decomposition: CFormFunction
    torque: CFormFunction
    position_gradient: CFormFunction


@dataclass(frozen=True)
class Motions:
    """Struct that the links' functions read: its fields, and its values.

    These are of one sample, of block t of a tile whose rows were gathered, of block t of a tile in blocks.
    """

    fields: str
    sample: str
    gathered: str
    blocks: str


@dataclass(frozen=True)
class Moves:
    """Calls that take values of some links in one array from block t of a tile; their place in block `at`."""

    scatter: str
    put_rows: str
    stream: str
    place: str


@dataclass(frozen=True)
class PastCache:
    """Call of a link's function into arrays of its own, and calls that write these past the cache."""

    decomposition: str
    streams: tuple[str, ...]


@dataclass(frozen=True)
class LinkCalls:
    """Calls of one link's functions for one sample, and for the position gradient of a block.

    `links` is this one as functions of dense.h take it: first, counted from 0, and the one after the last.
    """

    number: int
    outputs: str
    alone: str
    decomposition: str
    torque: str
    position_gradient: str
    gradients_to_rows: str
    links: str
    to_dense: str


@dataclass(frozen=True)
class GroupCalls:
    """Functions of a group of links for a tile of blocks: name and statements, and how results leave.

    `unread` stands before those that read no motion; `places` puts results into every array of the robot, for
    block `at`; `past` has the links one by one, and `room` the arrays that hold results of any of them.
    """

    what: str
    name: str
    unread: tuple[str, ...]
    decomposition: tuple[str, ...]
    past: tuple[PastCache, ...]
    room: tuple[tuple[str, int], ...]
    moves: tuple[Moves, ...]
    places: tuple[str, ...]
    unread_torque: tuple[str, ...]
    torque: tuple[str, ...]
    torques_to_rows: str
    links: str


def motions(inputs: Sequence[str]) -> Motions:
    """Return the struct's fields and values; `inputs` are the arrays that every function takes."""
    parameters = [array for array in inputs if array == "p"]
    motion, turned = ("q", "qd", "qdd"), ("sine", "cosine")
    return Motions(
        ", ".join(f"*{array}" for array in (*motion, *turned, *parameters)),
        _braces([*motion, *turned, *parameters]),
        _braces([*(f"x[t].{array}" for array in (*motion, *turned)), *parameters]),
        _braces([*(f"{array} + at" for array in motion), "sine[t]", "cosine[t]", *parameters]),
    )


def link_calls(link: Span, functions: LinkFormFunctions) -> LinkCalls:
    """Return the calls of one link's functions."""
    arrays = {array: array for array in link.size.arrays}
    return LinkCalls(
        link.first,
        pointers("real", link.size.arrays),
        call(functions.decomposition, "one", "m.", arrays),
        call(functions.decomposition, "one", "m.", arrays, link.start),
        call(functions.torque, "one", "m.", {"tau": "tau"}, link.start),
        call(functions.position_gradient, "", "m[t].", {"c0": "c0_block"}),
        _moves("c0", link).scatter,
        _counted_from_0(link),
        f"to_dense_one({link.first - 1}, &m, &r, to)",
    )


def group_calls(
    links: Sequence[Span], functions: Sequence[LinkFormFunctions], arrays: Sequence[str]
) -> GroupCalls:
    """Return the calls of the functions of `links`; `arrays` are those of the robot."""
    group, most = whole(links), most_counts([link.size for link in links])
    into = {array: f"r[t].{array}" for array in arrays}
    mine = [(functions[link.first - 1], link.start - group.start) for link in links]
    one = group.first == group.last
    decomposition = tuple(call(k.decomposition, "block", "m[t].", into, start) for k, start in mine)
    torque = tuple(call(k.torque, "block", "m[t].", {"tau": "r[t].tau"}, start) for k, start in mine)
    return GroupCalls(
        f"Link {group.first}" if one else f"Links {group.first} to {group.last}",
        f"link_{group.first}" if one else f"links_{group.first}_to_{group.last}",
        unread(decomposition),
        decomposition,
        tuple(_past_cache(functions[link.first - 1], link, group) for link in links),
        tuple((array, most.of(array)) for array in most.arrays),
        tuple(_moves(array, group) for array in group.size.arrays),
        tuple(_moves(array, group).place for array in arrays),
        unread(torque),
        torque,
        _moves("tau", group).scatter,
        _counted_from_0(group),
    )


def call(
    function: CFormFunction,
    width: str,
    motion: str,
    into: Mapping[str, str],
    start: EntryCounts | None = None,
) -> str:
    """Return a call of a function for one sample, a block, or, without width, as SIZED says.

    Outputs may begin at a later entry, `start`.
    """
    reads = [f"{motion}{array}" for array in function.reads]
    writes = [_at(into[array], start.of(array) if start else 0) for array in function.writes]
    name = f"{function.name}_{width}" if width else f"SIZED({function.name})"
    return f"{name}({', '.join([*reads, *writes])})"


def unread(calls: Sequence[str]) -> tuple[str, ...]:
    """Return statements that mark the motion as unread where no call reads it, as for a constant force."""
    return () if any("m[t]." in text for text in calls) else ("(void)m",)


def total(array: str) -> str:
    """Return the name in C of the number of entries of an array."""
    return NUMBERS[array]


def _moves(array: str, links: Span) -> Moves:
    start, every, count = links.start.of(array), total(array), links.size.of(array)
    rows = f"{array} + at * {every}" + (f" + {start}" if start else "")
    place = f"{array} + " + (f"(at * {every} + {start}) * BLOCK" if start else f"at * {every} * BLOCK")
    waiting = "c0_block" if array == "c0" else f"r[t].{array}"
    return Moves(
        f"scatter(samples, {count}, {every}, {waiting}, {rows})",
        f"put_rows(samples, {every}, large, {waiting}, {rows}, scratch)",
        f"stream({count} * BLOCK, {waiting}, {place})",
        place,
    )


def _past_cache(functions: LinkFormFunctions, link: Span, group: Span) -> PastCache:
    start, arrays = link.start - group.start, link.size.arrays
    streams = (
        f"stream({link.size.of(array)} * BLOCK, {array}, {_at(f'r[t].{array}', start.of(array))})"
        for array in arrays
    )
    own = {array: array for array in arrays}
    return PastCache(call(functions.decomposition, "block", "m[t].", own), tuple(streams))


def _counted_from_0(links: Span) -> str:
    return f"{links.first - 1}, {links.last}"


def _braces(values: Sequence[str]) -> str:
    return f"{{{', '.join(values)}}}"


def _at(pointer: str, entry: int) -> str:
    return f"{pointer} + {entry} * W" if entry else pointer
