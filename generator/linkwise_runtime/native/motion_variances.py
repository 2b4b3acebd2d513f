"""Variances by uncertain motion from the compiled C, which takes and answers blocks of samples."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..certainty.motion_variances import variance_sizes
from .calls import NativeCalls, plain
from .library import function
from .memory import NumberArray, NumberType, address, memory

LINE = 64
"""Bytes of one number of all samples of a block."""
AT_ONCE = 4096
"""Most samples at once: C keeps several times their results meanwhile."""
FUNCTION = "motion_variances_blocks"


def motion_variances(
    calls: NativeCalls, motion: Sequence[NumberArray], roots: NDArray[np.floating], names: Sequence[str]
) -> dict[str, NumberArray]:
    """Return variances by name, (entries, S) each, with the samples along rows.

    motion: q, qd and qdd (S, n)
    roots: D (S or 1, 3 n, R) with D D^T the covariance of q, qd and qdd, one after the other
    names: which of `VARIANCES` are wanted
    """
    samples = len(motion[0])
    if samples <= AT_ONCE:
        return _piece(calls, motion, roots, names)
    pieces = [
        _piece(calls, [a[some] for a in motion], roots[some] if len(roots) > 1 else roots, names)
        for some in (slice(at, at + AT_ONCE) for at in range(0, samples, AT_ONCE))
    ]
    return {name: np.concatenate([piece[name] for piece in pieces], 1) for name in names}


def _piece(
    calls: NativeCalls, motion: Sequence[NumberArray], roots: NDArray[np.floating], names: Sequence[str]
) -> dict[str, NumberArray]:
    """Return the same of a piece of the samples."""
    kind, samples, structure = motion[0].dtype, len(motion[0]), calls.structure
    width = LINE // kind.itemsize
    blocks = -(-samples // width)
    if not blocks:
        return {name: np.zeros((size, 0), kind) for name, size in variance_sizes(structure).items()}
    read = [_in_blocks(a, width) for a in motion]
    if calls.parameters:
        read.append(plain(calls.constants(kind)))
    read.append(_factors(roots, samples, width, kind))
    sizes = variance_sizes(structure)
    n = structure.n
    room = sum(structure.sizes[:4]) + 4 * n * (n + 1)
    ends = np.cumsum([0, *sizes.values(), room]) * blocks * width
    whole = memory((int(ends[-1]),), kind)
    written = [whole[a:b] for a, b in pairwise(ends.tolist())]
    compute = function(calls.sources, FUNCTION, kind.str[1:], len(read) + len(written))
    shared = bool(calls.parameters)
    steps = [0 if shared and number == len(motion) else a[0].nbytes for number, a in enumerate(read)]
    arrays = [
        *zip(map(address, read), steps, strict=True),
        *((address(a), a.nbytes // blocks) for a in written),
    ]
    calls.share(compute, blocks, arrays, calls.parts(whole.nbytes), (read, written))
    found = dict(zip(sizes, written, strict=False))
    return {name: _rows(found[name].reshape(blocks, -1, width), samples) for name in names}


def _in_blocks(values: NumberArray, width: int) -> NumberArray:
    """Return numbers (S, count) in blocks (blocks, count, width); the last sample fills up the last."""
    lacking = -len(values) % width
    if lacking:
        values = np.concatenate([values, np.repeat(values[-1:], lacking, 0)])
    return np.ascontiguousarray(values.reshape(-1, width, values.shape[-1]).swapaxes(1, 2))


def _factors(roots: NDArray[np.floating], samples: int, width: int, kind: NumberType) -> NumberArray:
    """Return the factors of covariances in blocks (blocks, 3 n, 3 n, width), a row for each direction."""
    size, count = roots.shape[1:]
    found = np.zeros((-(-samples // width), size, size, width), kind)
    every = np.broadcast_to(roots, (samples, size, count)).swapaxes(1, 2)
    whole = samples // width * width
    full = every[:whole].reshape(whole // width, width, count, size)
    found[: whole // width, :count] = np.moveaxis(full, 1, 3)
    found[whole // width :, :count, :, : samples - whole] = np.moveaxis(every[None, whole:], 1, 3)
    return found


def _rows(blocks: NumberArray, samples: int) -> NumberArray:
    """Return results (blocks, count, width) as rows (count, S)."""
    found: NumberArray = blocks.swapaxes(0, 1).reshape(blocks.shape[1], -1)[:, :samples]
    return found
