"""Shares that joint torques determine: which follow from them alone, and which lean on the file's masses.

A share through link j is y . pi_j. It is determined if y lies in the space of `torque_space` at every motion,
here at some random ones. Shares that are zero for all motion, as off the path of a link, are not counted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..chosen_names import listed
from .pseudo_inertia import Floats
from .share_rows import LinearRobot, OnNumpy, RigidRobot, ShareArrays
from .torque_space import TorqueSpace, torque_space

Masks = NDArray[np.bool_]
KINDS = {
    "torque": "partial torques tau_ij",
    "acceleration": "coefficients c2_ijk",
    "velocity": "coefficients c1_ijk",
    "gravity": "gravity g_ij",
    "reactions": "wrench components of joints by link",
}
"""Kinds of shares, and what they are called."""
STATES = 4
"""Number of random motions at which a share is looked at."""
LEANS = 1e-6
"""Part of a share's row from which on it leans on what torques do not show; smaller ones are rounding."""
NONE = 1e-11
"""Part of the largest row of a kind, up to which a row is rounding, and its share zero for all motion."""


class Determined(NamedTuple):
    """Masks of one kind of share: which are there at all, and which of them follow from joint torques."""

    there: Masks
    follows: Masks

    @property
    def counts(self) -> tuple[int, int]:
        """Number of shares that follow, and of all."""
        return int(self.follows.sum()), int(self.there.sum())


@dataclass(frozen=True, eq=False)
class Identifiability:
    """Shares that follow from joint torques alone; the others lean on how the file spreads mass over links.

    m joints have torques of their own: all, or the independent ones where joints are tied.
    """

    name: str
    joints: tuple[str, ...]
    """Names of the m joints, those of the axes i and k."""
    links: tuple[str, ...]
    """Names of the N links."""
    measured: tuple[str, ...]
    """Names of the joints whose torques are taken to be measured."""
    tree_joints: tuple[str, ...]
    """Names of the F joints that bear wrenches."""
    base_count: int
    """Number of base parameters: combinations of the inertial parameters that torques determine."""
    shares: Mapping[str, Determined]
    """Shares by link: torque and gravity (m, N), acceleration and velocity (m, N, m), reactions (F, N, 6)."""
    sums: Mapping[str, Determined]
    """Sums over the links: (m,), (m, m) by coordinate, and (F, 6)."""

    @property
    def parameter_count(self) -> int:
        """Number of inertial parameters, 10 N."""
        return 10 * len(self.links)

    @property
    def coefficient_counts(self) -> tuple[int, int]:
        """Number of coefficients c2_ijk and c1_ijk that follow from torques, and of all."""
        pairs = [self.shares[kind].counts for kind in ("acceleration", "velocity")]
        return sum(own for own, _ in pairs), sum(every for _, every in pairs)

    def __str__(self) -> str:
        """Return a table: how many shares of each kind follow, then joint by joint the links of tau_ij."""
        measured = "all joints" if self.measured == self.joints else listed(self.measured)
        lines = [
            f"{self.name}: torques of {measured} determine {self.base_count} combinations of "
            f"{self.parameter_count} inertial parameters",
            f"  {'':<37}{'by link':>13}{'summed over links':>20}",
        ]
        for kind, words in KINDS.items():
            if kind in self.shares:
                by_link, summed = (of_all(*some[kind].counts) for some in (self.shares, self.sums))
                lines.append(f"  {words:<37}{by_link:>13}{summed:>20}")
        lines.append("tau_ij that follow from torques alone:")
        there, follows = self.shares["torque"]
        for i, joint in enumerate(self.joints):
            own = [self.links[j] for j in np.flatnonzero(follows[i])]
            others = int(there[i].sum()) - len(own)
            rest = f"; {others} through other links lean on the file's masses" if others else ""
            lines.append(f"  {joint}: {', '.join(own) or 'none'}{rest}")
        return "\n".join(lines)


def of_all(some: int, every: int) -> str:
    """Return a number of all in words, "1 of 6"."""
    return f"{some} of {every}"


def identifiability(robot: RigidRobot, on_numpy: OnNumpy, measured: object = None) -> Identifiability:
    """Return the answer of `Dynamics.identifiability`."""
    linear = LinearRobot.of(robot, on_numpy)
    places = linear.measured(measured)
    motion = linear.random_motion(len(places))
    space = hidden_from(linear, places, motion)
    rows = linear.share_rows([a[:STATES] for a in motion])
    return Identifiability(
        robot.name,
        linear.joints,
        robot.link_names,
        tuple(linear.joints[at] for at in places),
        robot.tree_joint_names,
        space.count,
        {kind: by_link(rows, kind, space) for kind in KINDS},
        {kind: _summed(rows, kind, space) for kind in KINDS},
    )


def hidden_from(linear: LinearRobot, measured: Sequence[int], motion: Sequence[Floats]) -> TorqueSpace:
    """Return the space of the torques of some joints, at random motions (S, n)."""
    rows = linear.torque_rows(motion)[:, list(measured)]
    return torque_space(rows.reshape(-1, linear.parameters.size), linear.robot.name)


def by_link(rows: ShareArrays, kind: str, space: TorqueSpace) -> Determined:
    """Return the masks of a kind of share by link, rows (S, ., N, ..., 10)."""
    own = rows[kind]
    links = [space.leaning(own[:, :, j], j) for j in range(own.shape[2])]
    sizes = np.stack([_sizes(own[:, :, j], space, j) for j in range(own.shape[2])], 2)
    return _determined(sizes, np.stack(links, 2))


def _summed(rows: ShareArrays, kind: str, space: TorqueSpace) -> Determined:
    """Return the masks of sums over the links."""
    whole = np.moveaxis(rows[kind], 2, -2)
    whole = whole.reshape(*whole.shape[:-2], -1)
    return _determined(_sizes(whole, space), space.leaning(whole))


def _sizes(rows: Floats, space: TorqueSpace, link: int | None = None) -> Floats:
    columns = slice(None) if link is None else slice(10 * link, 10 * link + 10)
    found: Floats = np.linalg.norm(rows / space.scales[columns], axis=-1)
    return found


def _determined(sizes: Floats, leaning: Floats) -> Determined:
    """Return the masks from sizes and leaning parts (S, ...) at the motions S."""
    counts = sizes > NONE * sizes.max(initial=0.0)
    there = counts.any(0)
    return Determined(there, there & ~((leaning > LEANS) & counts).any(0))
