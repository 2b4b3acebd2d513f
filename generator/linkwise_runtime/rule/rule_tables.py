"""The constants of the rigid-link rule for one robot, as each back end has them."""

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .joint_tree import JointTree
from .kinematics import KinematicTables, kinematic_tables
from .regressors import RegressorTables, regressor_tables
from .rigid_rule import LinkNumbers, LinkTables, link_numbers
from .rule_layout import RuleLayout, pair_layout
from .spatial_tables import SpatialNumbers, SpatialTables, spatial_numbers, spatial_tables
from .tree_arrays import TreeArrays, formula_sources, own_numbers


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

    def few(self, samples: int, links: int) -> bool:
        """Whether spatial matrices are quicker for so many samples of a robot of so many links."""

    def chunk(self, motion: Sequence[Any], most: int) -> int | None:
        """Samples to compute at once where `most` of them stay in the cache; None for all."""


class RuleTables(NamedTuple):
    """All constants of a robot, of one dtype on one device."""

    frames: KinematicTables
    links: LinkTables
    own: TreeArrays
    numbers: LinkNumbers
    spatial: SpatialTables
    matrices: SpatialNumbers
    """The tree's own."""
    sources: Any
    groups: tuple[tuple[Any, Any], ...]
    """Links and path of each."""
    positions: tuple[tuple[Any, ...], ...]
    """Of c2, c1, c0, g and tau in the answers, a table for each summand."""
    diagonal: Any
    """Of each c0_ik with i = k the packed tau_i, of others a zero behind."""
    pairs: tuple[Any, Any]
    """Links and joints of the pairs of `PairLayout`."""
    entries: tuple[tuple[tuple[Any, Any], ...], ...]
    """Of c2, c1 and c0, its rows, and of g and tau those of joint and of kind and link."""
    regressors: RegressorTables


def listed_tables(tree: JointTree, layout: RuleLayout) -> RuleTables:
    """All constants in float64, of NumPy."""
    own, eye = own_numbers(tree), np.eye(3)[:, :, None, None]
    # (a, -a, 0)
    skew = np.array([6, 5, 1, 2, 6, 3, 4, 0, 6])
    links = LinkTables(_span([link.joint for link in tree.links]), eye, skew)
    spatial = spatial_tables(tree, links.joints, _span([joint.coordinate for joint in tree.joints]))
    coefficients = [layout.acceleration, layout.velocity, layout.position_gradient]
    pairs = pair_layout(layout, coefficients, len(tree.joints))
    # c2 and c1 have wrenches of one kind each.
    count = len(pairs.links)
    each = (tuple((e, row % count) for e, row in table) for table in pairs.entries[:2])
    # The place of no entry is that of the ground, which has no screw.
    width = 2 * len(tree.links)
    singles = (tuple((row // width, row % width) for row in t) for t in (layout.gravity, layout.torque))
    fields = ("acceleration", "velocity", "position_gradient", "gravity", "torque")
    return RuleTables(
        kinematic_tables(tree),
        links,
        own,
        link_numbers(np, eye, *own.carried),
        spatial,
        spatial_numbers(np, spatial, own),
        formula_sources(tree),
        tuple((_span(group.links), _span(group.path)) for group in layout.groups),
        tuple(tuple(getattr(layout, field)) for field in fields),
        layout.diagonal,
        (pairs.links, pairs.joints),
        (*each, *pairs.entries[2:], *singles),
        regressor_tables(tree),
    )


def converted(table: Any, space: Space, like: Any) -> Any:
    """A table, with what it holds, for a dtype and device."""
    if isinstance(table, np.ndarray):
        return space.index(table, like) if table.dtype.kind == "i" else space.constant(table, like)
    if isinstance(table, tuple):
        entries = (converted(entry, space, like) for entry in table)
        return type(table)(*entries) if hasattr(table, "_fields") else tuple(entries)
    return table


def _span(positions: Sequence[int]) -> Any:
    """Positions in a row as a slice, which takes no copy."""
    first, count = positions[0], len(positions)
    if list(positions) == list(range(first, first + count)):
        return slice(first, first + count)
    return np.array(positions, dtype=np.intp)
