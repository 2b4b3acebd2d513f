"""Rows made from messages that carry joints in any order, and not each of them all joints."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.package.load import Array

STAMPED, RECORDED = "stamped", "recorded"
"""Quantities of the columns of time: the message's own stamp, and the recorder's time."""
ENDINGS = {"position": "", "velocity": "/velocity", "effort": "/effort"}
"""Quantities of joints in a message, and the endings of their columns' names after the joint's."""
BY_RECORDER = f"take the recorder's times with --time {RECORDED}"


@dataclass(frozen=True)
class JointMessage:
    """A message, whose number in its topic counts from 1.

    `recorded` and `stamp` are in ns; `arrays` has one number of each quantity for each name, or none at all.
    """

    number: int
    recorded: int
    stamp: int
    names: tuple[str, ...]
    arrays: Mapping[str, Sequence[float]]

    def has(self, quantity: str) -> bool:
        """Return whether there are numbers of a quantity.

        Raises LinkwiseError if there are not as many as names.
        """
        count = len(self.arrays[quantity])
        if count not in (0, len(self.names)):
            raise LinkwiseError(
                f"message {self.number} has {len(self.names)} names and {count} numbers of {quantity}"
            )
        return count > 0


@dataclass(frozen=True)
class Cell:
    """Content of a column: a time, or a quantity of a joint."""

    quantity: str
    joint: str = ""


def rows_of(states: Iterator[JointMessage], cells: Sequence[Cell], rows: int) -> Iterator[tuple[Array, int]]:
    """Yield blocks (at most `rows`, len(cells)), times in s from the first message, and messages read.

    A message without any of the joints is skipped, and so is one that repeats another, including its stamp.
    Raises LinkwiseError for a message with only some of the joints, and for stamps that do not increase.
    """
    block: list[list[float]] = []
    first = last = None
    row: list[float] = []
    number, named, places = 0, None, None
    for state in states:
        number = state.number
        first = first or state
        if state.names != named:
            named, places = state.names, _places(state, cells)
        if places is None:
            continue
        found = _row(state, cells, places, first)
        if last is not None and _repeats(cells, last, state, row, found, first):
            continue
        last, row = state, found
        block.append(row)
        if len(block) == rows:
            yield np.array(block), number
            block = []
    yield np.array(block).reshape(-1, len(cells)), number


def _places(state: JointMessage, cells: Sequence[Cell]) -> list[int] | None:
    """Return the index of each cell's joint among a message's names, -1 if absent; None if all are absent."""
    place = {name: at for at, name in enumerate(state.names)}
    if len(place) < len(state.names):
        raise LinkwiseError(f"message {state.number} names a joint twice: {listed(state.names)}")
    wanted = {cell.joint for cell in cells if cell.joint}
    if wanted and wanted.isdisjoint(place):
        return None
    return [place.get(cell.joint, -1) for cell in cells]


def _row(
    state: JointMessage, cells: Sequence[Cell], places: Sequence[int], first: JointMessage
) -> list[float]:
    """Return the values of a message, one for each cell."""
    row = []
    there = {quantity: state.has(quantity) for quantity in ENDINGS}
    for cell, place in zip(cells, places, strict=True):
        if cell.quantity == STAMPED:
            row.append((state.stamp - first.stamp) / 1e9)
        elif cell.quantity == RECORDED:
            row.append((state.recorded - first.recorded) / 1e9)
        elif place >= 0 and there[cell.quantity]:
            row.append(float(state.arrays[cell.quantity][place]))
        else:
            has = [joint for joint in state.names if joint in {cell.joint for cell in cells}]
            raise LinkwiseError(
                f"message {state.number} has {listed(map(repr, has))} and no {cell.quantity} of"
                f" {cell.joint!r}, but a row needs all of the robot's joints: record them in one message, or"
                " lock the others with linkwise generate --lock"
            )
    return row


def _repeats(
    cells: Sequence[Cell],
    last: JointMessage,
    state: JointMessage,
    row: Sequence[float],
    found: Sequence[float],
    first: JointMessage,
) -> bool:
    """Return whether a row repeats the one before.

    Raises LinkwiseError where only the stamp repeats, or where it runs backwards.
    """
    if state.stamp > last.stamp or all(cell.quantity != STAMPED for cell in cells):
        return False
    if state.stamp == last.stamp and np.array_equal(row, found, equal_nan=True):
        return True
    seconds = (state.stamp - first.stamp) / 1e9
    how = f"repeats {seconds:.9g} s with other values"
    if state.stamp < last.stamp:
        how = f"runs back to {seconds:.9g} s"
    raise LinkwiseError(f"message {state.number}: its stamp {how}; {BY_RECORDER}")
