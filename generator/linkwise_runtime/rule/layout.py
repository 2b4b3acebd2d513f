"""Positions of the rigid-link rule's numbers in packed results.

The rule answers group by group: for every link of a group and every two joints on the group's path a dense
block, (i, link, kind, k), whether these joints carry the link or not. A packed value is one of its entries;
where several joints follow one coordinate, as mimic joints do, it is the sum of several.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .joint_tree import JointTree

SPAN = 16
"""Most links of one group: links near the base of a long chain need not pay for the joints behind them."""


@dataclass(frozen=True)
class LinkGroup:
    """Links on one way from the ground, and the joints on the way to the last of them."""

    links: tuple[int, ...]
    path: tuple[int, ...]


def link_groups(tree: JointTree) -> tuple[LinkGroup, ...]:
    """Return groups of links, with every link in one of them, the longest ways first."""
    chains = [tree.chain(link.joint) for link in tree.links]
    left, groups = set(range(len(chains))), []
    for end in sorted(left, key=lambda j: -len(chains[j])):
        on_the_way = [
            j for j in sorted(left, key=lambda j: len(chains[j])) if set(chains[j]) <= set(chains[end])
        ]
        for start in range(0, len(on_the_way) if end in left else 0, SPAN):
            links = on_the_way[start : start + SPAN]
            groups.append(LinkGroup(tuple(links), chains[links[-1]]))
            left.difference_update(links)
    return tuple(groups)


@dataclass(frozen=True)
class RuleLayout:
    """Positions of packed values in the rule's answers, a row for each summand; `zero` is no entry's."""

    groups: tuple[LinkGroup, ...]
    acceleration: NDArray[np.intp]
    velocity: NDArray[np.intp]
    position_gradient: NDArray[np.intp]
    zero: int
    """Number of entries of all groups together."""
    torque: NDArray[np.intp]
    """Positions of tau in answers (joint, kind, link), of which gravity is the second kind."""
    gravity: NDArray[np.intp]
    diagonal: NDArray[np.intp]
    """Position of the packed tau_i for each packed c0_ik with i = k; for others, the number of packed tau."""


def rule_layout(tree: JointTree) -> RuleLayout:
    """Return the positions for a tree; packed values are in the order of `Layout`."""
    groups = link_groups(tree)
    blocks, total = dict[int, _Block](), 0
    for group in groups:
        for at, j in enumerate(group.links):
            blocks[j] = _Block(members(tree, j), at, group, total)
        total += 2 * len(group.links) * len(group.path) ** 2
    ordered = [blocks[j] for j in range(len(tree.links))]
    links, joints = len(tree.links), len(tree.joints)
    single = [members(tree, j) for j in range(links)]
    chains = [np.array(tree.chain(link.joint)) for link in tree.links]

    def torque(kind: int) -> NDArray[np.intp]:
        rows = [np.where(m < 0, -1, (chains[j][m] * 2 + kind) * links + j).T for j, m in enumerate(single)]
        return joined(rows, joints * links * 2)

    upper = [b.entries(0)[:, np.triu(np.ones((b.count, b.count), bool)).reshape(-1)] for b in ordered]
    return RuleLayout(
        groups,
        joined(upper, total),
        joined([b.entries(1) for b in ordered], total),
        joined([b.slopes() for b in ordered], total),
        total,
        torque(0),
        torque(1),
        _diagonal([block.count for block in ordered]),
    )


def _diagonal(counts: Sequence[int]) -> NDArray[np.intp]:
    start, blocks = 0, []
    for count in counts:
        block = np.full((count, count), sum(counts))
        np.fill_diagonal(block, range(start, start + count))
        blocks.append(block.reshape(-1))
        start += count
    return np.concatenate(blocks)


@dataclass(frozen=True)
class PairLayout:
    """Positions of values where every pair of a link and a joint on its way has wrenches of its own.

    A value is the sum of S_e . (wrench) over rows of e and of the wrench: pairs of the first kind, then of
    the second. Joint e is the ground, which has no screw, where there is no summand.
    """

    links: NDArray[np.intp]
    joints: NDArray[np.intp]
    """Link and joint of each pair."""
    entries: tuple[tuple[tuple[NDArray[np.intp], NDArray[np.intp]], ...], ...]
    """Rows (e, wrench) for each of the given tables."""


def pair_layout(layout: RuleLayout, tables: Sequence[NDArray[np.intp]], ground: int) -> PairLayout:
    """Return the pairs for positions in the answers of all groups."""
    starts = np.cumsum([0, *(2 * len(g.links) * len(g.path) ** 2 for g in layout.groups)])
    every = np.arange(layout.zero)
    e, j, kind, f = np.empty((4, layout.zero), dtype=np.intp)
    for group, start, end in zip(layout.groups, starts[:-1], starts[1:], strict=True):
        links, path = np.array(group.links), np.array(group.path)
        shape = (len(path), len(links), 2, len(path))
        at = np.unravel_index(every[start:end] - start, shape)
        e[start:end], j[start:end], kind[start:end], f[start:end] = (
            path[at[0]],
            links[at[1]],
            at[2],
            path[at[3]],
        )
    used = np.unique(np.concatenate([table[table < layout.zero] for table in tables]))
    pairs, number = np.unique(j[used] * (ground + 1) + f[used], return_inverse=True)
    wrench = np.zeros(layout.zero + 1, dtype=np.intp)
    wrench[used] = number + kind[used] * len(pairs)
    e = np.append(e, ground)
    entries = tuple(tuple((e[row], wrench[row]) for row in table) for table in tables)
    return PairLayout(pairs // (ground + 1), pairs % (ground + 1), entries)


@dataclass(frozen=True)
class _Block:
    """Entries of one link: members (coordinates, joints), place in its group, and where the group begins."""

    members: NDArray[np.intp]
    at: int
    group: LinkGroup
    start: int

    @property
    def count(self) -> int:
        """Number of coordinates that move the link."""
        return len(self.members)

    def entries(self, kind: int | NDArray[np.intp]) -> NDArray[np.intp]:
        """Return positions (summands, i and k) of a kind, or of one for each two joints (path, path).

        They are -1 where there is no entry.
        """
        i, k = self.members[:, :, None, None], self.members[None, None]
        if not isinstance(kind, int):
            kind = kind[i, k]
        where = self.start + ((i * len(self.group.links) + self.at) * 2 + kind) * len(self.group.path) + k
        where = np.where((i < 0) | (k < 0), -1, where)
        return where.transpose(1, 3, 0, 2).reshape(-1, self.count**2)

    def slopes(self) -> NDArray[np.intp]:
        """Return the positions of c0: of the second kind where joint i is not behind joint k."""
        d = len(self.group.path)
        return self.entries(np.triu(np.ones((d, d), dtype=np.intp)))


def members(tree: JointTree, link: int) -> NDArray[np.intp]:
    """Return where the joints of each coordinate of a link's path stand on the way.

    Rows are the coordinates, ascending, with -1 behind the joints.
    """
    chain = tree.chain(tree.links[link].joint)
    found: dict[int, list[int]] = {}
    for at, joint in enumerate(chain):
        found.setdefault(tree.joints[joint].coordinate, []).append(at)
    most = max(map(len, found.values()))
    return np.array([found[k] + [-1] * (most - len(found[k])) for k in sorted(found)], dtype=np.intp)


def joined(blocks: Sequence[NDArray[np.intp]], zero: int) -> NDArray[np.intp]:
    """Return the rows of all links side by side, with `zero` in place of missing entries."""
    most = max(len(block) for block in blocks)
    filled = [np.pad(block, ((0, most - len(block)), (0, 0)), constant_values=-1) for block in blocks]
    joined = np.concatenate(filled, 1)
    joined[joined < 0] = zero
    return joined
