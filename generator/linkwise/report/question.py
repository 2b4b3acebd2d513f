"""Which part of which torque is wanted."""

from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.errors import LinkwiseError

ORDERS = ("gravity", "velocity", "acceleration")


@dataclass(frozen=True)
class Question:
    """One bucket of some torques τ_ij; the default is the paper's. Indices from 0; None means all.

    joint: i            link: j            coordinate: k, the joint whose motion is followed
    order: 2 keeps what contains q̈_k, 1 what contains q̇_k, 0 gravity
    """

    joint: int | None = 0
    link: int | None = None
    coordinate: int = 0
    order: int = 2

    def __str__(self) -> str:
        motion = f" of joint {self.coordinate + 1}" if self.order else ""
        return f"{ORDERS[self.order]}{motion}"

    def joints(self, n: int) -> tuple[int, ...]:
        """Return the joints whose torque is asked for, of n."""
        return tuple(range(n)) if self.joint is None else (self.joint,)


def position(text: str, names: Sequence[str], option: str) -> int:
    """Index of a name, or of a number from 1; raises LinkwiseError naming the choices."""
    if text in names:
        return names.index(text)
    if text.isascii() and text.isdigit() and 1 <= int(text) <= len(names):
        return int(text) - 1
    raise LinkwiseError(f"{option} {text!r} is not there; choose 1..{len(names)} or {', '.join(names)}")
