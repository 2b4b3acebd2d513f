"""The rigid-link rule for one robot: packed results, in the order of `Layout`, from motion and numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..interface import Dtype, Library, Numbers, TableKind
from ..quantities import PARAMETERS
from .joint_tree import Bodies, JointTree, Own
from .kinematics import gather, poses, twists
from .layout import RuleLayout, rule_layout
from .products import FusedMoment, Moment
from .regressors import coefficient_rows, torque_rows
from .rigid import LinkNumbers, link_energies, link_numbers, link_states
from .spatial import SpatialMoment, spatial_moment
from .tables import RuleTables, converted, listed_tables, spatial_numbers
from .tree_arrays import TreeArrays, given_numbers

CACHE = 1 << 22
"""Bytes of the arrays of one chunk of samples, which are to stay in the processor's cache."""
LINK_NUMBERS = 200
"""Numbers of a link and its joint for one sample, without the products."""
STEP = 0.5
"""Step of joints' places in m, of the size of robots: no digits are lost."""
ROW_NUMBERS = 6 * PARAMETERS
"""Numbers that a row of a regressor needs while it is computed."""


Moving = Moment | FusedMoment | SpatialMoment
"""Joints and links in motion, from which packed numbers are made."""
Innermost = Callable[[Sequence[Numbers], TreeArrays, LinkNumbers], list[Numbers]]
"""Function of motion, the tree's numbers and its links' that returns answers, all with samples innermost."""


def kept_rule_tables(rule: "RigidRule", library: Library, dtype: Dtype, device: object) -> RuleTables:
    """Return a rule's constants, made once; compilers take them as they are, and do not follow this."""
    key = library.xp.__name__, dtype, device
    if key not in rule._tables:
        rule._tables[key] = converted(rule._listed, library, cast("Numbers", TableKind(dtype, device)))
    return rule._tables[key]


class RigidRule:
    """Rigid-link rule for a robot's tree; tables are made when first asked for, for each dtype and device."""

    def __init__(self, tree: JointTree) -> None:
        self.tree = tree
        self._tables: dict[tuple[str, Dtype, object], RuleTables] = {}

    @cached_property
    def layout(self) -> RuleLayout:
        """Positions of packed values."""
        return rule_layout(self.tree)

    @cached_property
    def _listed(self) -> RuleTables:
        return listed_tables(self.tree, self.layout)

    def tables(self, library: Library, like: Numbers) -> RuleTables:
        """Return the constants to compute with `like`."""
        return kept_rule_tables(self, library, like.dtype, getattr(like, "device", None))

    def bodies(self) -> Bodies[NDArray[np.float64]]:
        """Return the bodies that the links carry, as the package has them."""
        links = self.tree.links
        return Bodies(
            np.array([link.mass for link in links]),
            np.array([link.com for link in links]),
            np.array([link.inertia for link in links]),
        )

    def decomposition(
        self,
        library: Library,
        motion: Sequence[Own],
        p: Mapping[str, Numbers],
        bodies: Bodies[Numbers] | None,
    ) -> list[Own]:
        """Return c2, c1, g and tau, (..., count) each."""
        return self._answers(library, motion, p, bodies, lambda at: [*at.coefficients(), *at.singles((3, 4))])

    def torque(
        self,
        library: Library,
        motion: Sequence[Own],
        p: Mapping[str, Numbers],
        bodies: Bodies[Numbers] | None,
    ) -> Own:
        """Return tau (..., count)."""
        return self._answers(library, motion, p, bodies, lambda at: at.singles((4,)))[0]

    def position_gradient(
        self,
        library: Library,
        motion: Sequence[Own],
        p: Mapping[str, Numbers],
        bodies: Bodies[Numbers] | None,
    ) -> Own:
        """Return c0 (..., count)."""
        diagonal = self.tables(library, motion[0]).diagonal

        def answer(at: Moving) -> list[Numbers]:
            gradient, own = at.gradient()[0], at.own_bends()
            if own is None:
                return [gradient]
            with_zero = library.xp.concat([own, 0.0 * own[:, :1]], 1)
            return [gradient + gather(with_zero, diagonal, -1)]

        return self._answers(library, motion, p, bodies, answer)[0]

    def translation_gradient(
        self,
        library: Library,
        motion: Sequence[Own],
        numbers: TreeArrays,
        shift: Numbers,
    ) -> list[Own]:
        """Return the changes of c2, c1, g and tau, (..., count) each, with the joints' places along a shift.

        They are exact but for rounding: places enter in the second degree, of which central differences keep
        nothing, however wide.

        numbers: of the tree; shift: directions (3, frames) of joints' translations, zero for the ground
        """
        batch, tables = tuple(motion[0].shape[:-1]), self.tables(library, motion[0])
        links = link_numbers(library.xp, tables.links.eye, *numbers.bodies)
        step = STEP * shift[..., None]
        ways = [numbers._replace(translations=numbers.translations + way) for way in (step, -step)]

        def answer(own: Sequence[Numbers], some: TreeArrays, carried: LinkNumbers) -> list[Numbers]:
            at = _moment(library, tables, own, some, carried)
            return [*at.coefficients(), *at.singles((3, 4))]

        ahead, behind = (
            self._in_pieces(library, motion, way, links, answer, 2 * self.layout.zero) for way in ways
        )
        return [
            ((a - b) / (2.0 * STEP)).reshape(*batch, a.shape[-1]) for a, b in zip(ahead, behind, strict=True)
        ]

    def energies(
        self,
        library: Library,
        motion: Sequence[Own],
        p: Mapping[str, Numbers],
        bodies: Bodies[Numbers] | None,
    ) -> list[Own]:
        """Return the kinetic and potential energies (..., N) in J, for q and qd."""
        xp, tables = library.xp, self.tables(library, motion[0])

        def answer(own: Sequence[Numbers], some: TreeArrays, carried: LinkNumbers) -> list[Numbers]:
            found = link_energies(xp, tables.frames, tables.links.joints, some, *own)
            return [xp.swapaxes(a, 0, 1) for a in found]

        return self._of_tree(library, motion, p, bodies, answer, 0)

    def regressor(self, library: Library, motion: Sequence[Own], p: Mapping[str, Numbers]) -> Own:
        """Return Y of tau, (..., count * 10)."""
        tables = self.tables(library, motion[0])

        def answer(own: Sequence[Numbers], some: TreeArrays, carried: LinkNumbers) -> list[Numbers]:
            return torque_rows(library.xp, tables.frames, tables.regressors, some, own)

        rows = len(self.layout.torque[0])
        return self._of_tree(library, motion, p, None, answer, ROW_NUMBERS * rows)[0]

    def coefficient_regressors(
        self, library: Library, motion: Sequence[Own], p: Mapping[str, Numbers]
    ) -> list[Own]:
        """Return Y of c2, c1 and g, (..., count * 10) each."""
        tables = self.tables(library, motion[0])

        def answer(own: Sequence[Numbers], some: TreeArrays, carried: LinkNumbers) -> list[Numbers]:
            return coefficient_rows(library.xp, tables.frames, tables.regressors, some, own)

        rows = len(self.layout.acceleration[0]) + len(self.layout.velocity[0])
        return self._of_tree(library, motion, p, None, answer, ROW_NUMBERS * rows)

    def _of_tree(
        self,
        library: Library,
        motion: Sequence[Own],
        p: Mapping[str, Numbers],
        bodies: Bodies[Numbers] | None,
        answer: Innermost,
        products: int,
    ) -> list[Own]:
        """Return the results of `answer` from the tree's numbers alone, (..., count) each.

        products: see `_in_pieces`
        """
        batch, tables = tuple(motion[0].shape[:-1]), self.tables(library, motion[0])
        own = tables.own, tables.sources
        numbers = given_numbers(library.xp, self.tree, own, p, bodies, batch)
        parts = self._in_pieces(library, motion, numbers, tables.numbers, answer, products)
        return [a.reshape(*batch, a.shape[-1]) for a in parts]

    def _answers(
        self,
        library: Library,
        motion: Sequence[Own],
        p: Mapping[str, Numbers],
        bodies: Bodies[Numbers] | None,
        answer: Callable[[Moving], list[Numbers]],
    ) -> list[Own]:
        """Return the results of `answer` for the samples of a motion, (..., count) each."""
        q = motion[0]
        batch, n = tuple(q.shape[:-1]), q.shape[-1]
        tables = self.tables(library, q)
        numbers = given_numbers(library.xp, self.tree, (tables.own, tables.sources), p, bodies, batch)
        given = numbers is not tables.own
        samples = math.prod(batch)
        if library.few(samples, len(self.tree.links)):
            matrices = spatial_numbers(library.xp, tables.spatial, numbers) if given else tables.matrices
            flat = [a.reshape(samples, n) for a in motion]
            parts = answer(spatial_moment(library.xp, tables, matrices, flat))
        else:
            links = link_numbers(library.xp, tables.links.eye, *numbers.bodies) if given else tables.numbers

            def innermost(own: Sequence[Numbers], some: TreeArrays, carried: LinkNumbers) -> list[Numbers]:
                return answer(_moment(library, tables, own, some, carried))

            parts = self._in_pieces(library, motion, numbers, links, innermost, 2 * self.layout.zero)
        return [a.reshape(*batch, a.shape[-1]) for a in parts]

    def _in_pieces(
        self,
        library: Library,
        motion: Sequence[Numbers],
        numbers: TreeArrays,
        links: LinkNumbers,
        answer: Innermost,
        products: int,
    ) -> list[Numbers]:
        """Return the results of `answer` with samples innermost, as many at once as the back end wants.

        products: numbers of one sample that it computes besides those of joints and links
        """
        xp, n = library.xp, motion[0].shape[-1]
        # A copy: with views, a compiler would gather from rows of samples in every loop.
        samples = math.prod(motion[0].shape[:-1])
        flat = xp.stack([xp.swapaxes(a.reshape(samples, n), 0, 1) for a in motion], 0)
        joined: list[Numbers] = []
        for piece in self._pieces(library, motion, samples, products):
            own = [a[:, piece] for a in flat]
            some = TreeArrays(*(_samples(a, piece) for a in numbers))
            carried = LinkNumbers(*(_samples(a, piece) for a in links))
            part = answer(own, some, carried)
            if piece == slice(None):
                return part
            joined = joined or [xp.empty((samples, a.shape[1]), dtype=a.dtype) for a in part]
            for whole, a in zip(joined, part, strict=True):
                whole[piece] = a
        return joined

    def _pieces(
        self, library: Library, motion: Sequence[Numbers], samples: int, products: int
    ) -> Sequence[slice]:
        """Return slices of the samples, each to be computed at once."""
        links = len(self.tree.links)
        most = CACHE // (motion[0].itemsize * (products + LINK_NUMBERS * links)) + 1
        size = library.chunk(motion, max(most, 16))
        if size is None or samples <= size:
            return [slice(None)]
        return [slice(start, start + size) for start in range(0, samples, size)]


def _moment(
    library: Library, tables: RuleTables, motion: Sequence[Numbers], numbers: TreeArrays, links: LinkNumbers
) -> Moment | FusedMoment:
    """Return the motion of joints and links for q, qd and qdd (n, samples)."""
    xp, frames = library.xp, tables.frames
    position, velocity, acceleration = (gather(a, frames.coordinates) for a in motion)
    placed = poses(xp, frames, numbers.translations, position)
    moved = twists(xp, frames, placed, numbers.gravity, velocity, acceleration)
    states = link_states(xp, tables.links, links, placed, moved, numbers.gravity)
    if library.fuses:
        return FusedMoment(xp, tables, moved, states)
    return Moment(xp, tables, links, moved, states)


def _samples(a: Numbers, piece: slice) -> Numbers:
    """Return the numbers of some samples; one that all share stays."""
    return a[..., piece] if a.shape[-1] > 1 else a
