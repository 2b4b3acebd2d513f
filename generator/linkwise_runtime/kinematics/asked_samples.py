"""Samples of a call on frames: with them innermost, in pieces, and with the vectors that are given beside."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..rule.tree_arrays import TreeArrays
from .frame_arrays import Carried, carried, moving, point_at

CACHE = 1 << 21
"""Bytes of the arrays of one piece of a batch, which are to stay in the processor's cache."""
NUMBERS = 60
"""Numbers that a joint or a frame has of one sample."""
VECTORS = {
    "point": "x, y, z in the frame, in m",
    "at": "x, y, z in the world, in m",
    "force": "x, y, z in the world, in N",
    "moment": "x, y, z in the world, in N m",
}
"""What may be given beside motion."""


class Asked(NamedTuple):
    """What a call computes with: array namespace, constants, the tree's numbers, motion (n, samples) each."""

    xp: Any
    tables: Any
    """`FrameTables`, or others that tell how much they move."""
    numbers: TreeArrays
    motion: list[Any]
    vectors: dict[str, Any]
    """Those of `VECTORS` that were given, (3, 1, samples) each."""

    def frame(self, from_world: bool = False) -> Carried:
        """The frame, or all of them."""
        q, offsets = self.motion[0], self.numbers.offsets
        return carried(self.xp, self.tables, self.numbers, offsets, q, from_world)

    def centres(self, from_world: bool = False) -> Carried:
        """Centres of mass of the links."""
        q, offsets = self.motion[0], self.numbers.centres
        return carried(self.xp, self.tables, self.numbers, offsets, q, from_world)

    def place(self, found: Carried) -> Any:
        """Where the point is, the frame's origin unless given."""
        return point_at(found, self.vectors.get("point"))

    def moving(self, found: Carried) -> Any:
        """Motion of the joints."""
        return moving(self.xp, self.tables, self.numbers, found, *self.motion[1:])

    def some(self, samples: slice) -> "Asked":
        """The same for some of the samples; of a number that all share there is one."""
        numbers = (a[..., samples] if a.shape[-1] > 1 else a for a in self.numbers)
        vectors = {name: a[..., samples] for name, a in self.vectors.items()}
        motion = [a[:, samples] for a in self.motion]
        return Asked(self.xp, self.tables, TreeArrays(*numbers), motion, vectors)


def in_pieces(own: Any, motion: Sequence[Any], at: Asked, answer: Callable[[Asked], Any], count: int) -> Any:
    """Answers (samples, count), as many samples at once as the back end wants."""
    xp, samples = at.xp, at.motion[0].shape[1]
    size = own.chunk(motion, max(16, CACHE // (motion[0].itemsize * (NUMBERS * at.tables.moved + count))))
    if size is None or samples <= size:
        return xp.swapaxes(answer(at).reshape(count, samples), 0, 1)
    whole = xp.empty((samples, count), dtype=motion[0].dtype)
    for start in range(0, samples, size):
        piece = slice(start, min(start + size, samples))
        found = answer(at.some(piece)).reshape(count, piece.stop - start)
        whole[piece] = xp.swapaxes(found, 0, 1)
    return whole


def with_vectors(own: Any, motion: Sequence[Any], beside: dict[str, Any]) -> tuple[list[Any], dict[str, Any]]:
    """Motion and vectors in one shape of samples; raises ValueError for a vector that does not go with it."""
    q, samples = motion[0], tuple(motion[0].shape[:-1])
    batch = samples
    vectors = {name: own.weights(name, a, q) for name, a in beside.items() if a is not None}
    for name, a in vectors.items():
        if a.ndim == 0 or a.shape[-1] != 3:
            raise ValueError(f"{name} has shape {tuple(a.shape)}; its last axis must be 3: {VECTORS[name]}")
        try:
            batch = own.xp.broadcast_shapes(batch, tuple(a.shape[:-1]))
        except (ValueError, RuntimeError):  # of NumPy, of torch
            raise ValueError(
                f"{name} has shape {tuple(a.shape)}, the motion has samples of shape {samples}; "
                f"give one {name}, or one for each sample"
            ) from None
    if all(a.shape[:-1] == samples for a in vectors.values()):
        return list(motion), vectors
    motion = [own.xp.broadcast_to(a, (*batch, a.shape[-1])) for a in motion]
    return motion, {name: own.xp.broadcast_to(a, (*batch, 3)) for name, a in vectors.items()}
