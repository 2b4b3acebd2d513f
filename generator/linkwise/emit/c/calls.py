"""Calls of kernels, and where each writes: the decisions behind a robot's C file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from linkwise.emit.c.header import pointers
from linkwise.emit.c.kernel_function import KernelFunction
from linkwise.emit.c.sizes import EntryCounts, Span, whole


@dataclass(frozen=True)
class LinkKernels:
    """The kernels of one link; `rest` is what a shared part leaves of its decomposition, if there is one."""

    decomposition: KernelFunction
    torque: KernelFunction
    position_gradient: KernelFunction
    rest: KernelFunction | None

    @property
    def blocks(self) -> KernelFunction:
        """Decomposition of blocks of samples."""
        return self.rest or self.decomposition


@dataclass(frozen=True)
class Piece:
    """Values of some links in one array of the robot: how many, and where they go.

    `rows` and `blocks` are the places of the first of them for the samples from s on, and for block s.
    """

    array: str
    total: str
    count: int
    rows: str
    blocks: str


@dataclass(frozen=True)
class LinkCalls:
    """How one link's kernels are called for one sample, and for the position gradient of a block."""

    number: int
    outputs: str
    alone: str
    decomposition: str
    torque: str
    position_gradient: str
    gradients: Piece


@dataclass(frozen=True)
class GroupCalls:
    """How the kernels of a group of links are called for one block, and where their results go.

    `places` are those of every array of the robot, for block s.
    """

    name: str
    what: str
    shared: bool
    decomposition: tuple[str, ...]
    torque: tuple[str, ...]
    pieces: tuple[Piece, ...]
    places: tuple[str, ...]
    torques: Piece


def link_calls(link: Span, kernels: LinkKernels) -> LinkCalls:
    """Calls of one link's kernels."""
    arrays = {array: array for array in link.size.arrays}
    return LinkCalls(
        link.first,
        pointers("real", link.size.arrays),
        call(kernels.decomposition, "one", "m.", arrays),
        call(kernels.decomposition, "one", "m.", arrays, link.start),
        call(kernels.torque, "one", "m.", {"tau": "tau"}, link.start),
        call(kernels.position_gradient, "block", "m.", {"c0": "c0_block"}),
        _piece("c0", link),
    )


def group_calls(links: Sequence[Span], kernels: Sequence[LinkKernels], arrays: Sequence[str]) -> GroupCalls:
    """Calls of the kernels of `links`; `arrays` are those of the robot."""
    group = whole(links)
    into = {array: f"r->{array}" for array in arrays}
    mine = [(kernels[link.first - 1], link.start - group.start) for link in links]
    one = group.first == group.last
    return GroupCalls(
        f"link_{group.first}" if one else f"links_{group.first}_to_{group.last}",
        f"Link {group.first}" if one else f"Links {group.first} to {group.last}",
        any("shared" in k.blocks.reads for k, _ in mine),
        tuple(call(k.blocks, "block", "m->", into, start) for k, start in mine),
        tuple(call(k.torque, "block", "m.", {"tau": "tau_block"}, start) for k, start in mine),
        tuple(_piece(array, group) for array in group.size.arrays),
        tuple(_piece(array, group).blocks for array in arrays),
        _piece("tau", group),
    )


def call(
    function: KernelFunction,
    width: str,
    motion: str,
    into: Mapping[str, str],
    start: EntryCounts | None = None,
) -> str:
    """Call of a kernel for one sample or a block; outputs begin at their pointers, or `start` entries on."""
    reads = [array if array == "shared" else f"{motion}{array}" for array in function.reads]
    writes = [_at(into[array], start.of(array) if start else 0) for array in function.writes]
    return f"{function.name}_{width}({', '.join([*reads, *writes])})"


def total(array: str) -> str:
    """Name in C of the number of entries of an array."""
    return {"tau": "G", "c0": "C1"}.get(array, array.upper())


def _piece(array: str, links: Span) -> Piece:
    start, every = links.start.of(array), total(array)
    rows = f"{array} + s * {every}" + (f" + {start}" if start else "")
    blocks = f"{array} + " + (f"(s * {every} + {start}) * BLOCK" if start else f"s * {every} * BLOCK")
    return Piece(array, every, links.size.of(array), rows, blocks)


def _at(pointer: str, entry: int) -> str:
    return f"{pointer} + {entry} * W" if entry else pointer
