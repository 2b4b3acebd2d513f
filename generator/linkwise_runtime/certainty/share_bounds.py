"""Least and greatest value of each share over all bodies that could exist with the same joint torques."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, Protocol

import numpy as np

from ..chosen_names import choice, position_of, short
from ..door import Door
from ..interface import array_of
from ..robot_axes import WRENCH
from ..rule.joint_tree import Bodies
from .conic_program import solver
from .feasible_bodies import feasible_bodies
from .identifiability import STATES, Masks, by_link, hidden_from
from .pseudo_inertia import Floats, central
from .share_ends import Asked, Place, ShareEnds
from .share_rows import LinearRobot, OnNumpy, RigidRobot

SHARES = ("torque", "acceleration", "velocity", "gravity", "reactions")
"""Kinds of shares that may be asked for."""
BORNE = SHARES[-1]
"""Kind of which a share is a component of the wrench that a joint of the tree bears."""
TOLERANCE = 1e-6
"""Largest gap of an end that counts as proved, as a part of the largest of ends and value."""


class MovedRobot(RigidRobot, Protocol):
    """A robot of rigid links at whose entry motion is read."""

    door: Door[Any]


@dataclass(frozen=True, eq=False)
class ShareBounds:
    """Ends of shares over all bodies with the same joint torques at every motion, by kind of share.

    Arrays are those of `propagation`: torque and gravity (m, N), acceleration and velocity (m, N, m), and of
    `reactions` their sums over causes (F, N, 6), in N m or N. m joints have torques of their own: all, or the
    independent ones where joints are tied. Of shares that follow from torques both ends are the value itself.
    """

    joints: tuple[str, ...]
    tree_joints: tuple[str, ...]
    """Names of the F joints that bear wrenches."""
    links: tuple[str, ...]
    value: Mapping[str, Floats]
    """Shares of the robot's own bodies."""
    follows: Mapping[str, Masks]
    """Shares that follow from torques alone."""
    least: Mapping[str, Floats]
    """Values below which no possible bodies go, as proved; minus infinity where they go without end."""
    greatest: Mapping[str, Floats]
    """Values above which no possible bodies go, as proved; infinity where they go without end."""
    gap: Mapping[str, Floats]
    """Largest distance, over both ends, of what is proved from what bodies that were found attain."""
    sized: Mapping[str, Masks]
    """Shares of which the largest size of links holds back an end: with larger links it would go further."""
    limits: Floats
    """Least and greatest mass of each link, (N, 2), infinite where none was given."""
    ends: Mapping[tuple[str, Place], tuple[Floats, Floats]]
    """Parameters (N, 10) of the bodies at both ends, by kind and place of the share."""

    @property
    def proved(self) -> Mapping[str, Masks]:
        """Ends whose gap is within `TOLERANCE` of the largest of ends and value."""
        found = {}
        for kind, gap in self.gap.items():
            every = np.stack([self.least[kind], self.greatest[kind], self.value[kind]])
            sizes = np.abs(np.where(np.isfinite(every), every, 0.0)).max(0)
            found[kind] = gap <= TOLERANCE * sizes
        return found

    def bodies(
        self,
        joint: int | str,
        link: int | str,
        coordinate: int | str | None = None,
        kind: str = "torque",
        end: str = "greatest",
        component: int | str | None = None,
    ) -> Bodies[Floats]:
        """Return the bodies, as `load(bodies=...)` takes them, whose share is at one end.

        coordinate: k, of shares by acceleration or velocity
        component: component of a wrench, such as "force_x", of kind "reactions"
        end: "least" or "greatest"; without an end, bodies of the largest size that was allowed

        Raises ValueError for a share that is not there or follows from torques.
        """
        if kind not in self.value:
            raise ValueError(
                f"kind is {short(kind)}; choose one that was asked for: {choice(kind, self.value, 'value')}"
            )
        if end not in ("least", "greatest"):
            raise ValueError(f"end is {short(end)}; choose least or greatest")
        bearing = self.tree_joints if kind == BORNE else self.joints
        asked: list[tuple[object, tuple[str, ...], str, str]] = [(joint, bearing, "joint", "joint")]
        asked.append((link, self.links, "link", "link"))
        if kind == BORNE:
            asked.append((component, WRENCH, "component", "component"))
        elif self.value[kind].ndim == 3:
            asked.append((coordinate, self.joints, "joint", "coordinate"))
        place = tuple(position_of(*one) for one in asked)
        pair = self.ends.get((kind, place))
        if pair is None:
            words = ", ".join(names[at] for at, (_, names, *_) in zip(place, asked, strict=True))
            raise ValueError(
                f"the {kind} share of {words} is zero, follows from joint torques, or was not asked for: "
                "there are no bodies at its ends"
            )
        return bodies_of(pair[end == "greatest"])


def bodies_of(pi: Floats) -> Bodies[Floats]:
    """Return the bodies of parameters (N, 10); a body without mass has its centre at the origin."""
    masses, centres, inertias = zip(*(central(one) for one in pi), strict=True)
    return Bodies(np.array(masses), np.array(centres), np.array(inertias))


def share_bounds(
    robot: MovedRobot,
    on_numpy: OnNumpy,
    motion: Mapping[str, object],
    masses: object,
    measured: object,
    shares: object,
    joints: object,
) -> ShareBounds:
    """Return the answer of `Dynamics.share_bounds`."""
    kinds = _kinds(shares)
    linear = LinearRobot.of(robot, on_numpy)
    limits = mass_limits(masses, linear.parameters[:, 0], robot.link_names)
    _, read = robot.door.read(motion)
    state = [np.asarray(array_of(a), dtype=float)[None] for a in read]
    if state[0].ndim != 2:
        raise ValueError(
            f"q, qd and qdd have samples of shape {state[0].shape[1:-1]}; give one position, velocity and "
            "acceleration for each joint: each share is two semidefinite programs"
        )
    if not all(np.isfinite(a).all() for a in state):
        raise ValueError("q, qd or qdd is NaN or infinite; give finite numbers")
    solver()
    places = linear.measured(measured)
    several = linear.random_motion(len(places))
    space = hidden_from(linear, places, several)
    borne, loaded = BORNE in kinds, _asked(joints, linear.joints, robot.tree_joint_names, kinds)
    everywhere = linear.share_rows([a[:STATES] for a in several], reactions=borne)
    rows = linear.share_rows(_closed(linear, state), reactions=borne)
    rows = {kind: _of_motion(kind, rows[kind][0], state, linear.own) for kind in kinds}
    bodies = feasible_bodies(linear.parameters, space.hidden_parameters, limits, robot.link_names)
    masks = {kind: by_link(everywhere, kind, space) for kind in kinds}
    found = {}
    for kind in kinds:
        asked = Asked(linear.parameters, bodies, loaded[kind], () if kind == BORNE else tuple(places))
        found[kind] = ShareEnds.of(rows[kind], masks[kind].follows, asked)
    return ShareBounds(
        linear.joints,
        robot.tree_joint_names,
        robot.link_names,
        {kind: one.value for kind, one in found.items()},
        {kind: masks[kind].follows for kind in kinds},
        {kind: one.least for kind, one in found.items()},
        {kind: one.greatest for kind, one in found.items()},
        {kind: one.gap for kind, one in found.items()},
        {kind: one.sized for kind, one in found.items()},
        limits,
        {(kind, place): pair for kind, one in found.items() for place, pair in one.pairs.items()},
    )


def _kinds(given: object) -> tuple[str, ...]:
    several = [given] if isinstance(given, str) else given
    if not isinstance(several, list | tuple) or not several:
        raise ValueError(f"shares is {short(given)}; give some of {', '.join(SHARES)}")
    for one in several:
        if one not in SHARES:
            raise ValueError(f"shares has {short(one)}; choose among {', '.join(SHARES)}")
    return tuple(dict.fromkeys(several))


def _closed(linear: LinearRobot, state: Sequence[Floats]) -> Sequence[Floats]:
    """Return a motion in which ties close, from the motion of the independent joints."""
    if not linear.is_tied:
        return state
    q, qd, qdd = state
    ties = linear.robot.constraints
    qd = np.asarray(ties.velocity(q, qd[:, linear.own]))
    return q, qd, np.asarray(ties.acceleration(q, qd, qdd[:, linear.own]))


def _of_motion(kind: str, rows: Floats, state: Sequence[Floats], own: Sequence[int]) -> Floats:
    """Return rows of shares (m, N, ..., 10): those of coefficients times what moves."""
    at = {"velocity": 1, "acceleration": 2}.get(kind)
    return rows if at is None else rows * state[at][0, list(own)][:, None]


def mass_limits(given: object, own: Floats, links: Sequence[str]) -> Floats:
    """Return the least and greatest mass of each link, (N, 2), for `masses` of `Dynamics.share_bounds`.

    own: masses that the file claims, (N,)

    Raises ValueError for links that are not there and for limits that no mass keeps.
    """
    limits = np.stack([np.zeros_like(own), np.full_like(own, np.inf)], 1)
    if given is None:
        return limits
    if isinstance(given, Mapping):
        for name, one in given.items():
            j = position_of(name, links, "link", "masses")
            limits[j] = _limits(one, float(own[j]), f"masses[{short(name)}]")
        return limits
    return np.array([_limits(given, float(mass), "masses") for mass in own])


def _limits(given: object, mass: float, where: str) -> tuple[float, float]:
    """Return limits of one mass, given as a part of it or as a pair of kg."""
    pair = given if isinstance(given, list | tuple) and where != "masses" else [given]
    numbers = [float(x) for x in pair if isinstance(x, Real) and not isinstance(x, bool)]
    if len(numbers) == len(pair) == 1 and 0.0 <= numbers[0] < np.inf:
        return max(mass * (1.0 - numbers[0]), 0.0), mass * (1.0 + numbers[0])
    if len(numbers) == len(pair) == 2 and 0.0 <= numbers[0] <= numbers[1]:
        return numbers[0], numbers[1]
    raise ValueError(
        f"{where} is {short(given)}; give a part of the claimed mass, 0.1 for 10 % less or more, or by "
        "link's name such a part or (least, greatest) in kg"
    )


def _asked(
    given: object, joints: Sequence[str], tree_joints: Sequence[str], kinds: Sequence[str]
) -> dict[str, tuple[int, ...]]:
    """Return the places of the loaded joints that were asked for, by kind, all unless given.

    A name that only one of both lists has counts there; other kinds have nothing of it.
    """
    lists = {kind: tree_joints if kind == BORNE else joints for kind in kinds}
    if given is None:
        return {kind: tuple(range(len(names))) for kind, names in lists.items()}
    several = given if isinstance(given, list | tuple) else [given]
    every = tuple(dict.fromkeys(name for names in lists.values() for name in names))
    for one in several:
        position_of(one, every, "joint", "joints")
    return {
        kind: tuple(
            position_of(one, names, "joint", "joints")
            for one in several
            if not isinstance(one, str) or one in names
        )
        for kind, names in lists.items()
    }
