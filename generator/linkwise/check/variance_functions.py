"""Checks of the C functions that answer with variances of shares by uncertain bodies and uncertain motion."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array, Index
from linkwise.check.compare import Entries, IndexRows
from linkwise.check.compiled_c import Numbers, Prototype
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.reference import Reference, body_reference
from linkwise.oracle.states import NUMBERS, States
from linkwise.package.manifest import Manifest

BY_BODIES = "share_variances"
"""Function that takes a covariance of what links carry beside the motion."""
VARIED = {"c2": "Y c2", "c1": "Y c1", "g": "Y g", "tau": "Y"}
"""Outputs of it, and the rows by which they lean on what links carry."""
BY_MOTION = "motion_variances_blocks"
"""Function that takes a covariance of the motion beside the motion."""
FACTOR = {BY_BODIES: ("factor",), BY_MOTION: ("factor",)}
"""Inputs of both beside the motion."""
OF_LINKS = {
    "c2": "c2",
    "c1": "c1",
    "g": "g",
    "tau": "tau",
    "acceleration": "c1",
    "velocity": "c1",
    "power": "tau",
}
"""Outputs of the latter for shares through one link, and the arrays in whose order they are."""
OUTPUTS = (*OF_LINKS, *(f"joint_{name}" for name in OF_LINKS), "joint_motion", "room")
"""Outputs of the latter; what is in `room` is of no use afterwards."""
STATES, BLOCKS = 3, (1, 3)
"""Most states whose motion is uncertain, and numbers of blocks that they fill."""

Call = Callable[[Prototype, int, Mapping[str, Numbers | None], Mapping[str, int], int], dict[str, Numbers]]


class Uncertain(NamedTuple):
    """Values where the motion is uncertain, and sizes of the numbers that they are summed from."""

    states: States
    factor: Array
    """Rows by which q, qd and qdd, one after the other, change along directions, (samples, 3 n, 3 n)."""
    values: Mapping[str, Array]
    """Dense values by output, (samples, ...)."""
    scales: Mapping[str, Array]


def body_variances(
    call: Call, function: Prototype, rows: IndexRows, reference: Reference | None, counts: Sequence[int]
) -> Iterator[Entries]:
    """Yield variances by bodies, |F' Y|^2, for factors F that differ in every entry.

    reference: regressors; None for links of energies
    """
    if reference is None:
        return
    links = reference.values["Y"].shape[2]
    factor = np.cos(np.arange(100.0 * links)).reshape(links, 10, 10)
    states, sizes = reference.states, {what: len(rows.of(what)) for what in VARIED}
    for count, shift in product(counts, (0, 1)):
        at = np.arange(count) * 3 % max(len(states.q), 1)
        given = dict(zip(("q", "qd", "qdd"), states.at(at).motion, strict=True)) | {"factor": factor}
        asked = {what: count * size for what, size in sizes.items()}
        found = call(function, count, given, asked, shift)
        for what, of_bodies in VARIED.items():
            places = rows.of(what)
            own, scale = (
                of[of_bodies][(at[:, None], *places.T)] for of in (reference.values, reference.scales)
            )
            of_links = factor[places[:, 1]]
            along = np.einsum("spa,par->spr", own, of_links)
            most = np.einsum("spa,par->spr", scale, np.abs(of_links))
            value = found[what].reshape(count, sizes[what])
            yield Entries(what, value, (along**2).sum(-1), (most**2).sum(-1))


def motion_calls(
    call: Call, function: Prototype, width: int, rows: IndexRows, reference: Uncertain | None
) -> Iterator[Entries]:
    """Yield variances by motion, of blocks of `width` samples."""
    if reference is None:
        return
    n = reference.states.q.shape[1]
    room = sum(len(rows.of(what)) for what in ("c2", "c1", "g", "tau")) + 4 * n * (n + 1)
    for count, shift in product(BLOCKS, (0, 1)):
        at = np.arange(count * width) % len(reference.factor)
        motion = zip(("q", "qd", "qdd"), reference.states.at(at).motion, strict=True)
        given = dict(motion) | {"factor": reference.factor[at].reshape(len(at), -1)}
        blocks = {what: _blocks(x, width) for what, x in given.items()}
        expected, scales = (_packed(of, rows, at) for of in (reference.values, reference.scales))
        sizes = {what: value.size for what, value in expected.items()} | {"room": len(at) * room}
        found = call(function, count, blocks, sizes, shift)
        for what, value in expected.items():
            own = found[what].reshape(count, -1, width).swapaxes(1, 2).reshape(value.shape)
            yield Entries(what, own, value, scales[what])


def motion_reference(manifest: Manifest, tree: JointTree, states: States) -> Uncertain:
    """Return variances by motion, at the first few states, by divided differences of the recursion.

    Four directions: all that moves, velocities and accelerations, accelerations alone, one position.
    """
    n, links = len(manifest.joints), len(manifest.links)
    samples = max(1, min(STATES, len(states.q), NUMBERS // (9 * n * n * links)))
    few = np.concatenate([a[:samples] for a in states.motion], 1)
    factor = np.zeros((samples, 3 * n, 3 * n))
    by = 0.3 * np.cos(1.0 + np.arange(4.0 * samples * 3 * n)).reshape(samples, 4, 3 * n)
    by[:, 1, :n] = by[:, 2, : 2 * n] = 0.0
    by[:, 3, np.arange(3 * n) != n - 1] = 0.0
    used = min(4, 3 * n)
    factor[:, :used] = by[:, :used]
    recursion, magnitudes = NewtonEuler(manifest, tree), Magnitudes(manifest, tree)

    def at(moved: Array) -> Reference:
        return body_reference(recursion, magnitudes, States(*np.split(moved, 3, 1)))

    here = at(few)
    along = [(at(few + 3**0.5 * one), at(few - 3**0.5 * one)) for one in np.moveaxis(by[:, :used], 1, 0)]
    values = _variances(few, factor[:, :used], here.values, [(a.values, b.values) for a, b in along], -1.0)
    sizes = [(a.scales, b.scales) for a, b in along]
    scales = _variances(np.abs(few), np.abs(factor[:, :used]), here.scales, sizes, 1.0)
    return Uncertain(here.states, factor, values, scales)


def _variances(
    motion: Array,
    factor: Array,
    here: Mapping[str, Array],
    along: Sequence[tuple[Mapping[str, Array], Mapping[str, Array]]],
    sign: float,
) -> dict[str, Array]:
    """Return variances by output from values here and along directions; a sign of 1 gives bounds of them."""
    n, found = motion.shape[1] // 3, {}
    qd, qdd = slice(n, 2 * n), slice(2 * n, 3 * n)
    spread = (factor**2).sum(1)
    for joint in ("", "joint_"):
        steps: dict[str, list[Array]] = {}
        base: dict[str, Array] = {}
        for what in ("c2", "c1", "g", "tau"):
            one = _summed(here[what], joint)
            pairs = [(_summed(a[what], joint), _summed(b[what], joint)) for a, b in along]
            steps[what] = [(a + sign * b) / 12**0.5 for a, b in pairs]
            bends = [(a + b + sign * 2.0 * one) * 2**0.5 / 6.0 for a, b in pairs]
            found[f"{joint}{what}"] = sum((a**2 for a in (*steps[what], *bends)), 0.0 * one)
            base[what] = one
        for name, what, cause in (("acceleration", "c2", qdd), ("velocity", "c1", qd), ("power", "tau", qd)):
            a, va = base[what], found[f"{joint}{what}"]
            shape = (
                (len(a), *((1,) * (a.ndim - 2)), n) if what != "tau" else (len(a), n, *((1,) * (a.ndim - 2)))
            )
            b, vb = motion[:, cause].reshape(shape), spread[:, cause].reshape(shape)
            changes = zip(steps[what], np.moveaxis(factor[:, :, cause], 1, 0), strict=True)
            both = sum((step * by.reshape(shape) for step, by in changes), 0.0 * a)
            found[f"{joint}{name}"] = a**2 * vb + b**2 * va + va * vb + (2.0 * a * b + both) * both
    moves = zip(steps["tau"], np.moveaxis(factor.reshape(len(factor), -1, 3, n), 1, 0), strict=True)
    found["joint_motion"] = sum((step[:, None] * by for step, by in moves), np.zeros((len(factor), 3, n)))
    return found


def _summed(values: Array, joint: str) -> Array:
    """Return values (samples, n, N, ...), or their sums over the links."""
    whole: Array = values.sum(2) if joint else values
    return whole


def _packed(of: Mapping[str, Array], rows: IndexRows, at: Index) -> dict[str, Array]:
    """Return outputs (samples, count) as C writes them, from dense ones."""
    packed = {what: of[what][(at[:, None], *rows.of(order).T)] for what, order in OF_LINKS.items()}
    joints = (what for what in of if what.startswith("joint_"))
    return packed | {what: of[what][at].reshape(len(at), -1) for what in joints}


def _blocks(values: Array, width: int) -> Array:
    """Return samples (count, n) in blocks of `width`, samples innermost."""
    return values.reshape(-1, width, values.shape[-1]).swapaxes(1, 2)
