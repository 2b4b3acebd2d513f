"""The rigid-link rule for one robot: packed results, in the order of `Layout`, from motion and numbers."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .joint_tree import Bodies, JointTree
from .kinematics import KinematicTables, Twists, kinematic_tables, poses, taken, twists
from .rigid_rule import (
    LinkMoments,
    LinkNumbers,
    LinkStates,
    LinkTables,
    decomposition_columns,
    decomposition_wrenches,
    gradient_columns,
    gradient_matrices,
    gradient_wrenches,
    link_matrices,
    link_numbers,
    link_states,
)
from .rule_layout import RuleLayout, pair_layout, rule_layout
from .tree_arrays import TreeArrays, formula_sources, own_numbers, with_bodies, with_formulas

CACHE = 1 << 22
"""Bytes of the arrays of one chunk of samples, which are to stay in the processor's cache."""
LINK_NUMBERS = 200
"""Numbers that a link and its joint have of one sample, beside the products."""


class Space(Protocol):
    """What the rule asks of a back end: its array namespace, and constants beside the arrays given."""

    @property
    def xp(self) -> Any:
        """The array namespace, numpy or torch."""

    def constant(self, values: NDArray[Any], like: Any) -> Any:
        """A table of numbers, to compute with `like`."""

    def index(self, values: NDArray[np.intp], like: Any) -> Any:
        """A table of positions, to take from `like`."""

    @property
    def fuses(self) -> bool:
        """Whether a compiler makes one loop of many operations, to which a matrix product is a wall."""

    def chunk(self, motion: Sequence[Any], most: int) -> int | None:
        """Samples to compute at once where `most` of them stay in the cache; None for all."""


class RuleTables(NamedTuple):
    """All constants of a robot, of one dtype on one device."""

    frames: KinematicTables
    links: LinkTables
    own: TreeArrays
    numbers: LinkNumbers
    sources: Any
    groups: tuple[tuple[Any, Any], ...]
    """Links and path of each."""
    positions: tuple[tuple[Any, ...], ...]
    """Of c2, c1, c0, g and tau in the answers, a table for each summand."""
    pairs: tuple[Any, Any]
    """Links and joints of the pairs of `PairLayout`."""
    entries: tuple[tuple[tuple[Any, Any], ...], ...]
    """Of c2, c1 and c0, its rows, and of g and tau those of joint and of kind and link."""


class Moment(NamedTuple):
    """Samples side by side: how joints and links move, and with which numbers."""

    tables: RuleTables
    numbers: LinkNumbers
    moved: Twists
    states: LinkStates


class RigidRule:
    """The rule for a robot's tree; tables are made when first asked for, for each dtype and device."""

    def __init__(self, tree: JointTree) -> None:
        self.tree = tree
        self._tables: dict[Any, RuleTables] = {}

    @cached_property
    def layout(self) -> RuleLayout:
        """Where packed values stand."""
        return rule_layout(self.tree)

    def tables(self, space: Space, like: Any) -> RuleTables:
        """Constants to compute with `like`."""
        key = space.xp.__name__, like.dtype, getattr(like, "device", None)
        if key not in self._tables:
            self._tables[key] = _converted(self._listed, space, like)
        return self._tables[key]

    def bodies(self) -> Bodies[NDArray[np.float64]]:
        """What the links carry, as the package has it."""
        links = self.tree.links
        return Bodies(
            np.array([link.mass for link in links]),
            np.array([link.centre for link in links]),
            np.array([link.inertia for link in links]),
        )

    def decomposition(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any], bodies: Bodies[Any] | None
    ) -> list[Any]:
        """c2, c1, g and tau, (..., count) each."""

        def answer(at: Moment) -> list[Any]:
            pairs = _fused_coefficients(space, at) if space.fuses else _coefficients(space, at)
            return [*pairs, *_singles(space, at, (3, 4))]

        return self._answers(space, motion, p, bodies, answer)

    def torque(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any], bodies: Bodies[Any] | None
    ) -> Any:
        """tau (..., count)."""

        def answer(at: Moment) -> list[Any]:
            return _singles(space, at, (4,))

        return self._answers(space, motion, p, bodies, answer)[0]

    def position_gradient(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any], bodies: Bodies[Any] | None
    ) -> Any:
        """c0 (..., count)."""

        def answer(at: Moment) -> list[Any]:
            return _fused_gradient(space, at) if space.fuses else _gradient(space, at)

        return self._answers(space, motion, p, bodies, answer)[0]

    @cached_property
    def _listed(self) -> RuleTables:
        """All constants in float64, of NumPy."""
        own, eye = own_numbers(self.tree), np.eye(3)[:, :, None, None]
        # (a, -a, 0)
        skew = np.array([6, 5, 1, 2, 6, 3, 4, 0, 6])
        links = LinkTables(_span([link.joint for link in self.tree.links]), eye, skew)
        layout = self.layout
        coefficients = [layout.acceleration, layout.velocity, layout.position_gradient]
        pairs = pair_layout(layout, coefficients, len(self.tree.joints))
        # The place of no entry is that of the ground, which has no screw.
        width = 2 * len(self.tree.links)
        singles = (tuple((row // width, row % width) for row in t) for t in (layout.gravity, layout.torque))
        fields = ("acceleration", "velocity", "position_gradient", "gravity", "torque")
        return RuleTables(
            kinematic_tables(self.tree),
            links,
            own,
            link_numbers(np, eye, *own[2:]),
            formula_sources(self.tree),
            tuple((_span(group.links), _span(group.path)) for group in layout.groups),
            tuple(tuple(getattr(layout, field)) for field in fields),
            (pairs.links, pairs.joints),
            (*pairs.entries, *singles),
        )

    def _answers(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any], bodies: Any, answer: Any
    ) -> list[Any]:
        """What `answer` gives for the samples of a motion, (..., n) each."""
        q = motion[0]
        batch, n = tuple(q.shape[:-1]), q.shape[-1]
        xp, tables = space.xp, self.tables(space, q)
        numbers, links = tables.own, tables.numbers
        if self.tree.formulas or bodies is not None:
            numbers = with_formulas(xp, self.tree, numbers, tables.sources, p, batch)
            if bodies is not None:
                numbers = with_bodies(xp, numbers, bodies, batch)
            links = link_numbers(xp, tables.links.eye, *numbers[2:])
        flat = [xp.swapaxes(a.reshape(-1, n), 0, 1) for a in motion]
        joined: list[Any] = []
        samples = flat[0].shape[1]
        for piece in self._pieces(space, motion, samples):
            own = [a[:, piece] for a in flat]
            some = TreeArrays(*(_samples(a, piece) for a in numbers))
            carried = LinkNumbers(*(_samples(a, piece) for a in links))
            part = answer(_moment(xp, tables, own, some, carried))
            if piece == slice(None):
                joined = part
                continue
            joined = joined or [xp.empty((samples, a.shape[1]), dtype=q.dtype) for a in part]
            for whole, a in zip(joined, part, strict=True):
                whole[piece] = a
        return [a.reshape(*batch, a.shape[-1]) for a in joined]

    def _pieces(self, space: Space, motion: Sequence[Any], samples: int) -> Sequence[slice]:
        """Slices of the samples, each to be computed at once."""
        links = len(self.tree.links)
        most = CACHE // (motion[0].itemsize * (2 * self.layout.zero + LINK_NUMBERS * links)) + 1
        size = space.chunk(motion, max(most, 16))
        if size is None or samples <= size:
            return [slice(None)]
        return [slice(start, start + size) for start in range(0, samples, size)]


def _coefficients(space: Space, at: Moment) -> list[Any]:
    """Packed c2 and c1, by matrix products."""
    xp, tables = space.xp, at.tables
    matrices = link_matrices(xp, tables.links, at.numbers, at.states.moments)
    dense = _products(xp, at, matrices, decomposition_columns(xp, at.moved))
    return [_packed(xp, dense, positions) for positions in tables.positions[:2]]


def _gradient(space: Space, at: Moment) -> list[Any]:
    """Packed c0, by matrix products."""
    xp, tables = space.xp, at.tables
    matrices = link_matrices(xp, tables.links, at.numbers, at.states.moments)
    matrices = gradient_matrices(xp, tables.links, matrices, at.states.wrenches[:, 0])
    dense = _products(xp, at, matrices, gradient_columns(xp, at.moved))
    return [_packed(xp, dense, tables.positions[2])]


def _fused_coefficients(space: Space, at: Moment) -> list[Any]:
    """Packed c2 and c1, pair by pair."""
    links, joints = at.tables.pairs
    wrenches = decomposition_wrenches(space.xp, _of_pairs(at.states.moments, links), joints, at.moved)
    return [_gathered(at, wrenches, entries) for entries in at.tables.entries[:2]]


def _fused_gradient(space: Space, at: Moment) -> list[Any]:
    """Packed c0, pair by pair."""
    links, joints = at.tables.pairs
    moments, wrench = _of_pairs(at.states.moments, links), taken(at.states.wrenches[:, 0], links)
    wrenches = gradient_wrenches(space.xp, moments, joints, at.moved, wrench)
    return [_gathered(at, wrenches, at.tables.entries[2])]


def _of_pairs(moments: LinkMoments, links: Any) -> LinkMoments:
    """The moments of each pair's link."""
    return LinkMoments(*(taken(a, links) for a in moments))


def _gathered(at: Moment, wrenches: Any, entries: Sequence[tuple[Any, Any]]) -> Any:
    """Sums of S_e . (wrench), of wrenches (6, rows, samples), as (samples, count)."""
    screws = at.moved.screws
    parts = [
        taken(screws[axis % 3, axis // 3], e) * taken(wrenches[axis], row)
        for e, row in entries
        for axis in range(6)
    ]
    return sum(parts[1:], parts[0]).swapaxes(0, 1)


def _products(xp: Any, at: Moment, matrices: Any, columns: Any) -> Any:
    """S_e . (L column) for each group's links and any two joints e and f on its path, (samples, entries).

    Entries are ordered by e, link, column, f; groups stand in a row.
    """
    screws = _screws(xp, at.moved)
    left, axes, right = (_outermost(xp, a) for a in (matrices, screws, columns))
    samples, size, kinds = left.shape[0], left.shape[1], right.shape[2]
    answers = []
    for links, path in at.tables.groups:
        block, s, behind = (taken(a, i, -1) for a, i in ((left, links), (axes, path), (right, path)))
        count, depth = block.shape[-1], s.shape[-1]
        rows = xp.swapaxes(block.reshape(samples, size, 6 * count), 1, 2)
        wrench = rows @ behind.reshape(samples, size, kinds * depth)
        answer = xp.swapaxes(s, 1, 2) @ wrench.reshape(samples, 6, count * kinds * depth)
        answers.append(answer.reshape(samples, depth * count * kinds * depth))
    return xp.concat(answers, 1) if len(answers) > 1 else answers[0]


def _singles(space: Space, at: Moment, fields: Sequence[int]) -> list[Any]:
    """Packed S_e . (wrench) of g or tau, or both."""
    xp = space.xp
    if space.fuses:
        flat = at.states.wrenches.reshape(6, -1, at.states.wrenches.shape[-1])
        return [_gathered(at, flat, at.tables.entries[field]) for field in fields]
    axes, wrenches = _outermost(xp, _screws(xp, at.moved)), _outermost(xp, at.states.wrenches)
    samples, joints, links = axes.shape[0], axes.shape[2], wrenches.shape[3]
    answer = xp.swapaxes(axes, 1, 2) @ wrenches.reshape(samples, 6, 2 * links)
    dense = answer.reshape(samples, joints * 2 * links)
    return [_packed(xp, dense, at.tables.positions[field]) for field in fields]


def _moment(
    xp: Any, tables: RuleTables, motion: Sequence[Any], numbers: TreeArrays, links: LinkNumbers
) -> Moment:
    """Motion of joints and links for q, qd and qdd (n, samples)."""
    frames = tables.frames
    position, velocity, acceleration = (taken(a, frames.coordinates) for a in motion)
    placed = poses(xp, frames, numbers.translations, position)
    moved = twists(xp, frames, placed, numbers.gravity, velocity, acceleration)
    own = velocity, acceleration
    states = link_states(xp, tables.links, links, placed, moved, own, numbers.gravity)
    return Moment(tables, links, moved, states)


def _screws(xp: Any, moved: Twists) -> Any:
    """z and s of the joints, (6, joints, samples)."""
    return xp.concat([moved.screws[:3, 0, :-1], moved.screws[:3, 1, :-1]], 0)


def _outermost(xp: Any, a: Any) -> Any:
    """An array (..., samples) as (samples, ...), in one piece of memory."""
    shape, samples = tuple(a.shape[:-1]), a.shape[-1]
    flat = xp.swapaxes(a.reshape(int(np.prod(shape)), samples), 0, 1)
    flat = np.ascontiguousarray(flat) if isinstance(flat, np.ndarray) else flat.contiguous()
    return flat.reshape(samples, *shape)


def _packed(xp: Any, values: Any, positions: Sequence[Any]) -> Any:
    """Entries (samples, count) of values (samples, entries), or sums of some; behind them stands a zero."""
    if len(positions) > 1:
        values = xp.concat([values, 0.0 * values[:, :1]], 1)
    first, *others = (taken(values, index, -1) for index in positions)
    return sum(others, first)


def _samples(a: Any, piece: slice) -> Any:
    """The numbers of some samples; one that all share stays."""
    return a[..., piece] if a.shape[-1] > 1 else a


def _span(positions: Sequence[int]) -> Any:
    """Positions in a row as a slice, which takes no copy."""
    first, count = positions[0], len(positions)
    if list(positions) == list(range(first, first + count)):
        return slice(first, first + count)
    return np.array(positions, dtype=np.intp)


def _converted(table: Any, space: Space, like: Any) -> Any:
    """A table, with what it holds, for a dtype and device."""
    if isinstance(table, np.ndarray):
        return space.index(table, like) if table.dtype.kind == "i" else space.constant(table, like)
    if isinstance(table, tuple):
        entries = (_converted(entry, space, like) for entry in table)
        return type(table)(*entries) if hasattr(table, "_fields") else tuple(entries)
    return table
