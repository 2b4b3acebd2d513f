"""Test whether a robot's total mass matrix is singular: coordinates that carry no inertia of their own.

M(q) = A(q)ᵀ A(q), where A stacks √m times each link's linear and √I times its angular Jacobian. M is singular
in every state if it is so at random ones: A is analytic in q, and so its rank is largest almost everywhere.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.arrays import Array, Index, Mask
from linkwise.errors import LinkwiseError
from linkwise.robot.mass import SPECK, principal
from linkwise.robot.notes import IMPOSSIBLE, Note
from linkwise.robot.robot import Coordinate, Joint, Link

STATES = 3
"""Random states that must agree before a robot is refused."""

OWN = 1e-8
"""√ of the least share of a coordinate's inertia that is its own: in M, rounding hides a smaller one."""

CLEAR = 1e-5
"""√ of a share of which M itself, in double precision, leaves no doubt: 1e-10 of its diagonal."""

SHARE = 1e-6
"""Share of a coordinate's motion below which it is rounding."""


@dataclass(frozen=True)
class _Factor:
    """Factor A with M = AᵀA at one state, (rows, n), and the mass (n,) that each coordinate turns, in kg."""

    a: Array
    turned: Array

    @property
    def idle(self) -> Mask:
        """True where a coordinate moves no inertia (n,): no mass, or only points on its axis."""
        moved: Mask = (self.a**2).sum(0) <= SPECK * self.turned
        return moved

    def dependent(self, columns: Index) -> tuple[int, ...]:
        """Return the first column that depends on others before it, behind these; empty if there is none."""
        a = self.a[:, columns]
        a = a / np.sqrt((a**2).sum(0))
        if _clearly_regular(a.T @ a):
            return ()
        square = np.zeros((max(len(columns) - len(a), 0), len(columns)))
        r = np.asarray(np.linalg.qr(np.vstack([a, square]), mode="r"))
        found = np.flatnonzero(np.abs(np.diag(r)) <= OWN)
        if not found.size:
            return ()
        k = int(found[0])
        shares = np.linalg.solve(r[:k, :k], r[:k, k])
        return (*map(int, columns[:k][np.abs(shares) > SHARE]), int(columns[k]))


def _clearly_regular(m: Array) -> bool:
    """Return whether a matrix with ones on its diagonal is far from singular.

    The test is quick, and enough for most robots.
    """
    try:
        return bool(np.diag(np.linalg.cholesky(m)).min(initial=1.0) > CLEAR)
    except np.linalg.LinAlgError:
        return False


def check_mass_matrix(
    links: Sequence[Link],
    moving: Sequence[Coordinate],
    files: Collection[str],
    allow: bool,
    allow_mass: bool = False,
    made: Collection[str] = (),
) -> list[Note]:
    """Return a note on each coordinate without inertia of its own; raises LinkwiseError unless `allow`.

    Links have numbers for values; `files` are the names of those that stand in the file. With `allow_mass`,
    coordinates may lack inertia that move mass, or beyond which others do; those in `made` are the reader's.
    """
    generator = np.random.default_rng(0)
    states = generator.uniform(-np.pi, np.pi, (STATES, len(moving)))
    first = _factor(links, states[0])
    notes = []
    for k in map(int, np.flatnonzero(first.idle)):
        name, lacking = moving[k].name, "inertia" if first.turned[k] else "mass"
        if name in made:
            continue
        if not (allow or (allow_mass and first.turned[k])):
            raise LinkwiseError(
                f"joint {name!r} moves no {lacking} at all; give a link beyond it {lacking}, hold it with "
                f"--lock {name}=0, or pass --allow-unphysical"
            )
        notes.append(Note("unphysical", name, f"moves no {lacking}; its torque is zero", IMPOSSIBLE))
    columns = np.flatnonzero(~first.idle)
    alike = [first.dependent(columns)]
    if alike[0]:
        alike += [_factor(links, state).dependent(columns) for state in states[1:]]
    if all(alike):
        together = sorted({k for group in alike for k in group})
        names = ", ".join(repr(moving[k].name) for k in together)
        if not (allow or allow_mass):
            raise LinkwiseError(
                f"the joints {names} can move together without moving any mass; "
                f"{_mend(links, together[-1], files)}, "
                f"hold one with --lock {moving[together[-1]].name}=0, or pass --allow-unphysical"
            )
        notes.append(Note("unphysical", names, "can move together without moving any mass", IMPOSSIBLE))
    return notes


def _mend(links: Sequence[Link], coordinate: int, files: Collection[str]) -> str:
    """Return the remedy in words: mass for the link before the coordinate's joint, if the file has it."""
    at = next(link.parent for link in links if link.joint.coordinate == coordinate)
    if at is not None and links[at].name in files:
        return f"give link {links[at].name!r} between them mass and inertia"
    return "give the links that they move mass and inertia"


def _factor(links: Sequence[Link], q: Array) -> _Factor:
    """Return A at the state q (n,).

    A mass or moment below zero, which only an option allows, counts as one above.
    """
    frames, joints = _frames(links, q), [link.joint for link in links]
    axes = np.array([rotation[:, 2] for rotation, _ in frames])
    places = np.array([place for _, place in frames])
    ratios = np.array([_displacement(joint, q, 1) for joint in joints])[:, None]
    turns = np.array([joint.kind == "revolute" for joint in joints])[:, None]
    coordinates = np.array([joint.coordinate for joint in joints])
    chains: list[Array] = []
    blocks, turned = [np.zeros((0, len(q)))], np.zeros(len(q))
    for index, link in enumerate(links):
        above = chains[link.parent] if link.parent is not None else np.zeros(0, dtype=int)
        chains.append(chain := np.append(above, index))
        mass, rotation = abs(float(link.mass)), frames[index][0]
        moments, own = principal(mass, np.array(link.inertia, dtype=float))
        arm = places[index] + rotation @ np.array(link.com, dtype=float) - places[chain]
        axis, ratio, turn = axes[chain], ratios[chain], turns[chain]
        linear = np.sqrt(mass) * ratio * np.where(turn, np.cross(axis, arm), axis)
        angular = np.sqrt(np.abs(moments)) * ((ratio * turn * axis) @ rotation @ own)
        rows = np.hstack([linear, angular]).T
        block = np.zeros((len(rows), len(q)))
        np.add.at(block.T, coordinates[chain], rows.T)
        np.add.at(turned, coordinates[chain], mass * (turn * ratio**2)[:, 0])
        blocks.append(block[block.any(axis=1)])
    return _Factor(np.vstack(blocks), turned)


def _displacement(joint: Joint, q: Array, derivative: int = 0) -> float:
    """Return the displacement of a joint in rad or m, or the derivative of it by its coordinate."""
    x = float(q[joint.coordinate])
    if joint.curve:
        return joint.ratio * joint.curve(x, derivative)
    return joint.ratio * (1.0 if derivative else x)


def _frames(links: Sequence[Link], q: Array) -> list[tuple[Array, Array]]:
    """Return the rotation (3, 3) and origin (3,), in m, of each link's frame in the world, parents first."""
    frames: list[tuple[Array, Array]] = []
    for link in links:
        joint = link.joint
        rotation, place = (np.eye(3), np.zeros(3)) if link.parent is None else frames[link.parent]
        place = place + rotation @ np.array(joint.translation, dtype=float)
        rotation = rotation @ np.array(joint.rotation)
        moved = _displacement(joint, q)
        if joint.kind == "prismatic":
            place = place + moved * rotation[:, 2]
        else:
            c, s = np.cos(moved), np.sin(moved)
            rotation = rotation @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        frames.append((rotation, place))
    return frames
