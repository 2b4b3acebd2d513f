"""Bytes of stack that a package's C takes, and robots that are too large for it.

Blocks of samples wait on the stack, in arrays whose sizes follow from the robot. A value of a block takes 64
bytes, 8 samples in double or 16 in float. Beside them a function keeps some kB of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass

from linkwise_runtime.native.library import MOST_CONTACTS

from linkwise.emit.c.robot_files import free
from linkwise.emit.c.robot_tables import columns, path_spans
from linkwise.emit.c.sizes import Span, most_counts, tile, waiting_counts, whole
from linkwise.emit.c.tie_tables import has_tied_functions, tied_rows
from linkwise.symbolic.system import RigidSystem, System

VALUE = 64
"""Bytes of a value in a block, one cache line."""

OWN = 8_000
"""Bytes for what functions keep beside their arrays."""

OWN_SMALL = 1_500
"""Bytes for what functions keep beside their arrays where samples are computed one by one."""

MOST_STACK = 5_000_000
"""Most bytes of stack of a function: a thread has 8 MiB as a rule, and its callers need some."""

MOST_RESULTS = 2_000_000
"""Most results of a sample, for each of which NAME_index.h has a line of some 13 bytes."""

MOST_INT = 2**31 - 1
"""Most entries that C counts in an int."""


@dataclass(frozen=True)
class SmallStack:
    """Bytes that functions take at most with LINKWISE_SMALL, calls among them included, as text.

    motion: those of torques, coefficients, gradients, regressors and reactions, in double and in float
    control: those of all functions
    """

    motion: tuple[str, str]
    control: tuple[str, str]


def small_stack(system: System, links: tuple[Span, ...], kept: int) -> SmallStack:
    """Return the bytes that functions take where samples are computed one by one.

    `links` are results, and `kept` numbers that a function of closed forms may have to keep.
    """
    motion = _motion_values(system, links, kept)
    control = max(motion, _control_values(system, links))
    return SmallStack(_small(motion), _small(control))


def _small(values: int) -> tuple[str, str]:
    return f"{8 * values + OWN_SMALL:,}", f"{4 * values + OWN_SMALL:,}"


def _motion_values(system: System, links: tuple[Span, ...], kept: int) -> int:
    """Return how many numbers functions other than those for control keep for one sample."""
    n, one = len(system.coordinates), most_counts([link.size for link in links])
    values = 7 * n + one.total + kept
    if not isinstance(system, RigidSystem):
        return values
    frames, longest = len(system.robot.links), _longest(system)
    moved = _moved(system) + 6 * (frames + 1) + 34 + 18 * longest
    return moved + max(values, 12 * longest + 30) + 2 * _numbers(system)


def _moved(system: RigidSystem) -> int:
    """Return how many numbers the motion of all frames has, and what it is made from."""
    frames = len(system.robot.links)
    columned = frames + len(columns(system).sums)
    curved = 16 * frames if any(link.joint.curve for link in system.robot.links) else 0
    return 24 * (frames + 1) + 12 * columned + 3 * len(system.coordinates) + 3 * frames + curved


def loops_stack(system: RigidSystem) -> int:
    """Return the bytes that the functions of loops take at most."""
    n, frames, longest = len(system.coordinates), len(system.robot.links), _longest(system)
    # motion: frames with 24 numbers each, and columns; wrenches; q, qd, qdd and angles, sines, cosines.
    moved = _moved(system)
    wrenches = 18 * longest
    cubes = _cubes(n, len(system.links), longest)
    square = longest * longest
    values = max(
        4 * max(longest, 96),
        longest * (longest + 1) // 2 + square + 2 * longest + 2 * n + cubes,
        6 * (frames + 1) + square + cubes,
    )
    blocks = VALUE * (moved + wrenches + values) + 8 * _numbers(system) + OWN
    return max(blocks, _varied_stack(system), control_stack(system, ()))


def _varied_stack(system: System) -> int:
    """Return the bytes that variances by motion take: a block that is ahead, and one that is behind."""
    if not isinstance(system, RigidSystem):
        return 0
    values = 2 * (_moved(system) + 18 * _longest(system) + 34) + 5 * len(system.coordinates)
    return VALUE * values + 8 * _numbers(system) + OWN


def control_stack(system: System, links: tuple[Span, ...]) -> int:
    """Return the bytes that functions for control of one sample, or of tied joints, take at most."""
    tied = _tied_values(system) if isinstance(system, RigidSystem) and has_tied_functions(system) else 0
    return 8 * max(_control_values(system, links), tied) + OWN


def _tied_values(system: RigidSystem) -> int:
    """Return how many numbers functions of tied joints keep: `struct tied`, and matrices beside it."""
    n, frames, rows = len(system.coordinates), len(system.robot.links), tied_rows(system) + 6 * MOST_CONTACTS
    pitch, borne = n + 15, rows + 7
    standing = _moved(system) + 34 * len(system.links) + n
    tied = standing + rows * (3 * n + pitch + 3) + n * (2 * pitch + 4)
    beside = rows * pitch + n * (borne + 4 * pitch + 5 * n + 40) + 49 * (frames + 1)
    controlled = n * (3 * pitch + 9 * n + 80) + rows * (pitch + 1) + 100
    offsets = 3 * len(system.robot.named_frames) if system.parameters else 0
    return tied + max(beside, standing, controlled) + 24 * _longest(system) + _numbers(system) + offsets


def _control_values(system: System, links: tuple[Span, ...]) -> int:
    """Return how many numbers functions for control keep: motion, bodies, matrices of n rows.

    For energies they keep the results of all `links`.
    """
    n = len(system.coordinates)
    matrices = 2 * n * n + 3 * max(n, 6) ** 2 + 60 * n + 250
    if not isinstance(system, RigidSystem):
        return whole(links).size.total + matrices
    composites, offsets = 31 * (len(system.robot.links) + 1), 3 * len(system.robot.named_frames)
    frames = _moved(system) + composites + _numbers(system) + offsets
    if not free(system):  # only frames and the mass matrix, which is in the caller's memory
        return frames + 20 * n + 60
    return frames + 34 * len(system.links) + 18 * _longest(system) + matrices


def straight_stack(system: System, links: tuple[Span, ...]) -> int:
    """Return the bytes that the functions of closed forms take at most, `links` being their results."""
    n, waiting = len(system.coordinates), waiting_counts(links)
    blocks, whole_robot = tile(waiting), whole(links).size
    cubes = _cubes(n, len(links), _longest(system))
    largest = max(map(waiting.of, whole_robot.arrays))
    beside = max(cubes, largest, most_counts([link.size for link in links]).total)
    values = max(waiting.total * blocks + beside, max(link.size.c1 for link in links) + cubes)
    stack = VALUE * (5 * n * blocks + values) + OWN
    return max(stack, _varied_stack(system), control_stack(system, links))


def too_large_for_loops(system: System) -> str:
    """Return why C in loops cannot be had; empty if it can."""
    if not isinstance(system, RigidSystem):
        return ""
    return _fault(system, "in loops", lambda _: loops_stack(system))


def too_large_for_straight(system: System) -> str:
    """Return why C of closed forms cannot be had, if none of its results is zero; empty if it can."""
    if not isinstance(system, RigidSystem):
        return ""
    return _fault(system, "of closed forms", lambda links: straight_stack(system, links))


def _fault(system: RigidSystem, kind: str, stack_of: Callable[[tuple[Span, ...]], int]) -> str:
    links = path_spans(system)
    n, results = len(system.coordinates), whole(links).size.total
    what = f"{n} joints are too many for C {kind}: "
    if n * n * len(links) > MOST_INT:
        return f"{what}its results with their zeros are {n * n * len(links)}, more than an int counts"
    if results > MOST_RESULTS:
        return f"{what}it answers with {results} values, and {MOST_RESULTS} are the most"
    if (stack := stack_of(links)) > MOST_STACK:
        return f"{what}it takes {stack} bytes of stack, and {MOST_STACK} are the most"
    return ""


def _numbers(system: RigidSystem) -> int:
    """Return how many numbers of `struct numbers` in tree.h functions keep, where parameters change them."""
    return 13 * len(system.robot.links) + 10 * len(system.links) + 3 if system.parameters else 0


def _longest(system: System) -> int:
    return max(len(system.path(j)) for j in range(len(system.links)))


def _cubes(n: int, links: int, longest: int) -> int:
    """Return how many values `struct waiting_cubes` in dense_rows.h has."""
    most = max(1024 // (n * n), 1)
    if most >= links:
        return 2 * links * n * n + n
    return ((longest + 1) * n if most == 1 else most * n * n) + 1 + n
