"""The rigid-link rule for one robot: packed results, in the order of `Layout`, from motion and numbers."""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..quantities import PARAMETERS
from .fused_products import FusedMoment
from .joint_tree import Bodies, JointTree
from .kinematics import poses, taken, twists
from .link_energies import link_energies
from .regressors import coefficient_rows, torque_rows
from .rigid_rule import LinkNumbers, link_numbers, link_states
from .rule_layout import RuleLayout, rule_layout
from .rule_products import Moment
from .rule_tables import RuleTables, Space, converted, listed_tables
from .spatial_rule import spatial_moment
from .spatial_tables import spatial_numbers
from .tree_arrays import TreeArrays, with_bodies, with_formulas

CACHE = 1 << 22
"""Bytes of the arrays of one chunk of samples, which are to stay in the processor's cache."""
LINK_NUMBERS = 200
"""Numbers that a link and its joint have of one sample, beside the products."""
ROW_NUMBERS = 6 * PARAMETERS
"""Numbers that a row of a regressor takes while it is computed."""


class Answering(Protocol):
    """Joints and links in motion, which packed numbers are made of."""

    def coefficients(self) -> list[Any]:
        """Packed c2 and c1."""

    def gradient(self) -> list[Any]:
        """Packed c0."""

    def own_bends(self) -> Any:
        """What curves add to c0_ii, packed as tau; None where no joint follows one."""

    def singles(self, fields: Sequence[int]) -> list[Any]:
        """Packed g (field 3) or tau (field 4), or both."""


class RigidRule:
    """The rule for a robot's tree; tables are made when first asked for, for each dtype and device."""

    def __init__(self, tree: JointTree) -> None:
        self.tree = tree
        self._tables: dict[Any, RuleTables] = {}

    @cached_property
    def layout(self) -> RuleLayout:
        """Where packed values stand."""
        return rule_layout(self.tree)

    @cached_property
    def _listed(self) -> RuleTables:
        return listed_tables(self.tree, self.layout)

    def tables(self, space: Space, like: Any) -> RuleTables:
        """Constants to compute with `like`."""
        key = space.xp.__name__, like.dtype, getattr(like, "device", None)
        if key not in self._tables:
            self._tables[key] = converted(self._listed, space, like)
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

        def answer(at: Answering) -> list[Any]:
            return [*at.coefficients(), *at.singles((3, 4))]

        return self._answers(space, motion, p, bodies, answer)

    def torque(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any], bodies: Bodies[Any] | None
    ) -> Any:
        """tau (..., count)."""

        def answer(at: Answering) -> list[Any]:
            return at.singles((4,))

        return self._answers(space, motion, p, bodies, answer)[0]

    def position_gradient(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any], bodies: Bodies[Any] | None
    ) -> Any:
        """c0 (..., count)."""

        diagonal = self.tables(space, motion[0]).diagonal

        def answer(at: Answering) -> list[Any]:
            gradient, own = at.gradient()[0], at.own_bends()
            if own is None:
                return [gradient]
            with_zero = space.xp.concat([own, 0.0 * own[:, :1]], 1)
            return [gradient + taken(with_zero, diagonal, -1)]

        return self._answers(space, motion, p, bodies, answer)[0]

    def energies(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any], bodies: Bodies[Any] | None
    ) -> list[Any]:
        """Kinetic and potential energies (..., N) for q and qd."""
        batch, tables = tuple(motion[0].shape[:-1]), self.tables(space, motion[0])
        numbers = self._numbers(space, tables, p, bodies, batch)

        def answer(own: Sequence[Any], some: TreeArrays, carried: LinkNumbers) -> list[Any]:
            found = link_energies(space.xp, tables.frames, tables.links.joints, some, *own)
            return [space.xp.swapaxes(a, 0, 1) for a in found]

        parts = self._in_pieces(space, motion, numbers, tables.numbers, answer, 0)
        return [a.reshape(*batch, a.shape[-1]) for a in parts]

    def regressor(self, space: Space, motion: Sequence[Any], p: Mapping[str, Any]) -> Any:
        """Y of tau, (..., count * 10)."""
        return self._regressed(space, motion, p, torque_rows, len(self.layout.torque[0]))[0]

    def coefficient_regressors(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any]
    ) -> Sequence[Any]:
        """Y of c2, c1 and g, (..., count * 10) each."""
        rows = len(self.layout.acceleration[0]) + len(self.layout.velocity[0])
        return self._regressed(space, motion, p, coefficient_rows, rows)

    def _regressed(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any], made: Any, rows: int
    ) -> list[Any]:
        """Regressors that `made` computes, so many rows of them a sample."""
        batch, tables = tuple(motion[0].shape[:-1]), self.tables(space, motion[0])
        numbers = with_formulas(space.xp, self.tree, tables.own, tables.sources, p, batch)

        def answer(own: Sequence[Any], some: TreeArrays, carried: LinkNumbers) -> list[Any]:
            found: list[Any] = made(space.xp, tables.frames, tables.regressors, some, own)
            return found

        parts = self._in_pieces(space, motion, numbers, tables.numbers, answer, ROW_NUMBERS * rows)
        return [a.reshape(*batch, a.shape[-1]) for a in parts]

    def _answers(
        self, space: Space, motion: Sequence[Any], p: Mapping[str, Any], bodies: Any, answer: Any
    ) -> list[Any]:
        """What `answer` gives for the samples of a motion, (..., n) each."""
        q = motion[0]
        batch, n = tuple(q.shape[:-1]), q.shape[-1]
        tables = self.tables(space, q)
        numbers = self._numbers(space, tables, p, bodies, batch)
        given = numbers is not tables.own
        samples = math.prod(batch)
        if space.few(samples, len(self.tree.links)):
            matrices = spatial_numbers(space.xp, tables.spatial, numbers) if given else tables.matrices
            flat = [a.reshape(samples, n) for a in motion]
            parts = answer(spatial_moment(space.xp, tables, matrices, flat))
        else:
            links = link_numbers(space.xp, tables.links.eye, *numbers.carried) if given else tables.numbers

            def innermost(own: Sequence[Any], some: TreeArrays, carried: LinkNumbers) -> list[Any]:
                found: list[Any] = answer(_moment(space, tables, own, some, carried))
                return found

            parts = self._in_pieces(space, motion, numbers, links, innermost, 2 * self.layout.zero)
        return [a.reshape(*batch, a.shape[-1]) for a in parts]

    def _numbers(
        self, space: Space, tables: RuleTables, p: Mapping[str, Any], bodies: Any, batch: tuple[int, ...]
    ) -> TreeArrays:
        """The tree's own numbers, or those for parameters and bodies that are given."""
        numbers = with_formulas(space.xp, self.tree, tables.own, tables.sources, p, batch)
        return numbers if bodies is None else with_bodies(space.xp, numbers, bodies, batch)

    def _in_pieces(
        self,
        space: Space,
        motion: Sequence[Any],
        numbers: TreeArrays,
        links: LinkNumbers,
        answer: Any,
        products: int,
    ) -> list[Any]:
        """What `answer` gives with the samples innermost, as many at once as the back end wants.

        products: numbers of one sample that it computes beside those of joints and links
        """
        xp, n = space.xp, motion[0].shape[-1]
        # A copy: with views a compiler would gather from rows of samples in every loop.
        samples = math.prod(motion[0].shape[:-1])
        flat = xp.stack([xp.swapaxes(a.reshape(samples, n), 0, 1) for a in motion], 0)
        joined: list[Any] = []
        for piece in self._pieces(space, motion, samples, products):
            own = [a[:, piece] for a in flat]
            some = TreeArrays(*(_samples(a, piece) for a in numbers))
            carried = LinkNumbers(*(_samples(a, piece) for a in links))
            part: list[Any] = answer(own, some, carried)
            if piece == slice(None):
                return part
            joined = joined or [xp.empty((samples, a.shape[1]), dtype=a.dtype) for a in part]
            for whole, a in zip(joined, part, strict=True):
                whole[piece] = a
        return joined

    def _pieces(self, space: Space, motion: Sequence[Any], samples: int, products: int) -> Sequence[slice]:
        """Slices of the samples, each to be computed at once."""
        links = len(self.tree.links)
        most = CACHE // (motion[0].itemsize * (products + LINK_NUMBERS * links)) + 1
        size = space.chunk(motion, max(most, 16))
        if size is None or samples <= size:
            return [slice(None)]
        return [slice(start, start + size) for start in range(0, samples, size)]


def _moment(
    space: Space, tables: RuleTables, motion: Sequence[Any], numbers: TreeArrays, links: LinkNumbers
) -> Moment | FusedMoment:
    """Motion of joints and links for q, qd and qdd (n, samples)."""
    xp, frames = space.xp, tables.frames
    position, velocity, acceleration = (taken(a, frames.coordinates) for a in motion)
    placed = poses(xp, frames, numbers.translations, position)
    moved = twists(xp, frames, placed, numbers.gravity, velocity, acceleration)
    states = link_states(xp, tables.links, links, placed, moved, numbers.gravity)
    if space.fuses:
        return FusedMoment(xp, tables, moved, states)
    return Moment(xp, tables, links, moved, states)


def _samples(a: Any, piece: slice) -> Any:
    """The numbers of some samples; one that all share stays."""
    return a[..., piece] if a.shape[-1] > 1 else a
