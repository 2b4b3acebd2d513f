"""Numbers of a C3D file's head, from its bytes: ezc3d gives frames and rate as it found them, or breaks."""

import math
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError

BLOCK = 512
"""Bytes of a block; the head is the first, and says in which block parameters begin."""
MOST = 65535
"""Number of the last frame in a file of more frames than the head can count."""
DEC, BIG_ENDIAN = 85, 86
"""Byte that says which processor's numbers a file has, where it is not 84 of Intel's: DEC's or MIPS's."""


@dataclass(frozen=True)
class C3DHead:
    """First and last frame as the head has them, frames a second, and `POINT:FRAMES`, 0 if not said."""

    first: int
    last: int
    rate: float
    frames: int

    def require_rate(self) -> None:
        """Raise LinkwiseError where frames have no time."""
        if not (math.isfinite(self.rate) and self.rate > 0.0):
            raise LinkwiseError(
                f"POINT:RATE is {self.rate:g}, which gives frames no time; write the frames a second there,"
                " or export it again"
            )

    def require_whole(self, there: int, actual: Sequence[Array]) -> None:
        """Raise LinkwiseError where fewer frames are `there` than the file says: ezc3d reads what is left.

        actual: `TRIAL:ACTUAL_START_FIELD` and `ACTUAL_END_FIELD`, their low and high halves, empty if not
        said; they and POINT:FRAMES tell frames where the head cannot count them.
        """
        said, source = self.last - self.first + 1, "its head"
        if self.last == MOST:
            if all(len(halves) == 2 for halves in actual):
                start, end = (int(low) % (MOST + 1) + (MOST + 1) * int(high) for low, high in actual)
                said, source = end - start + 1, "TRIAL:ACTUAL_END_FIELD"
            else:
                said, source = self.frames if self.frames != MOST else 0, "POINT:FRAMES"
        if there < said:
            raise LinkwiseError(
                f"{source} says {said} frames, and {there} are there: it was cut short; export or"
                " copy it again"
            )


def read_head(path: Path) -> C3DHead | None:
    """Return the numbers of a file's head; None where it is none of a C3D file."""
    with path.open("rb") as file:
        head = file.read(BLOCK)
        if len(head) < BLOCK or not head[0]:
            return None
        file.seek((head[0] - 1) * BLOCK)
        section = file.read(4)
        if len(section) < 4:
            return None
        section += file.read(section[2] * BLOCK)
    order, is_dec = ">" if section[3] == BIG_ENDIAN else "<", section[3] == DEC
    first, last = struct.unpack(order + "HH", head[6:10])
    rate, frames = (_of_point(section, name, order, is_dec) for name in (b"RATE", b"FRAMES"))
    if rate is None:
        rate = _float(head[20:24], order, is_dec)
    return C3DHead(first, last, rate, int(frames) if frames and math.isfinite(frames) else 0)


def _of_point(section: bytes, name: bytes, order: str, is_dec: bool) -> float | None:
    """Return a number of the group POINT; None where it is not there.

    A group's name stands after its length and its number, below 0, and a parameter's after its length and
    that number, above 0; a length is below 0 where the name is locked.
    """
    group = re.search(rb"[\x05\xfb]([\x80-\xff])POINT", section, re.DOTALL)
    if group is None:
        return None
    length = re.escape(bytes([len(name)])) + b"|" + re.escape(bytes([256 - len(name)]))
    of = re.escape(bytes([256 - group[1][0]]))
    one = rb"(?:\x00|\x01\x01)"  # no dimension, or one of length 1
    for kind, size in (b"\x02", 2), (b"\x04", 4):
        found = re.search(
            b"(?:" + length + b")" + of + name + rb".." + kind + one + b"(.{%d})" % size, section, re.DOTALL
        )
        if found:
            is_float = size == 4
            return _float(found[1], order, is_dec) if is_float else struct.unpack(order + "H", found[1])[0]
    return None


def _float(four: bytes, order: str, is_dec: bool) -> float:
    """Return a number of four bytes; DEC's have their halves swapped, and are four times as large."""
    value = struct.unpack(order + "f", four[2:] + four[:2] if is_dec else four)[0]
    return float(value) / (4.0 if is_dec else 1.0)
