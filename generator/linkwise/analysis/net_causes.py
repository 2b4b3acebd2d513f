"""Net causes of joint torques: a coordinate's motion, gravity, a load; all links and orders summed.

A coordinate's motion is one cause, its acceleration and its velocity together. For every joint the torques by
all causes sum to the joint's torque.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple
from urllib.parse import unquote

from linkwise_runtime.motion.trace_equations import BETWEEN, LOAD, SHARE

from linkwise.analysis.loads.placed import PlacedLoad
from linkwise.analysis.motion_words import MotionWords, shown_joints
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_quantities import MOTION, PASSIVE

NET = "tau_by"
"""Quantity whose rows are net torques by cause."""


class NetCause(NamedTuple):
    """Cause of net torques, by the quantity that is summed, and its number along an axis of that."""

    quantity: str
    number: int = 0


def net_causes(robot: OpenedRobot, loads: int) -> tuple[NetCause, ...]:
    """Return the causes in order: gravity or shares with names, loads, passive torques, each joint's motion.

    loads: how many loads there are
    """
    named = [NetCause("tau_share", m) for m in range(len(robot.share_names))]
    own = [NetCause(name) for name, field in PASSIVE.items() if robot.with_own(field)]
    return (
        *(named if robot.is_written else [NetCause("tau_gravity")]),
        *(NetCause("tau_load", e) for e in range(loads)),
        *own,
        *(NetCause(MOTION[0], k) for k in range(len(robot.joints))),
    )


def cause_names(robot: OpenedRobot, loads: Sequence[PlacedLoad]) -> tuple[str, ...]:
    """Return the names of causes as columns have them, in the order of `net_causes`.

    Loads are load:NAME and shares with names share:NAME, as among the sources of a trace. A coordinate's
    motion has the coordinate's name, and motion:NAME where another cause is called so already.
    """
    causes = net_causes(robot, len(loads))
    others = [_name(cause, robot, loads) for cause in causes if cause.quantity not in MOTION]
    return (*others, *(f"motion{BETWEEN}{name}" if name in others else name for name in robot.joints))


def _name(cause: NetCause, robot: OpenedRobot, loads: Sequence[PlacedLoad]) -> str:
    if cause.quantity == "tau_load":
        return f"{LOAD}{BETWEEN}{loads[cause.number].name}"
    if cause.quantity == "tau_share":
        return f"{SHARE}{BETWEEN}{robot.share_names[cause.number]}"
    return cause.quantity.removeprefix("tau_")


def label_of(name: str, words: Mapping[str, MotionWords]) -> str:
    """Return a cause in words, from its name in columns.

    words: words of coordinates, by name
    """
    kind, between, rest = unquote(name).partition(BETWEEN)
    if between and kind in (LOAD, SHARE):
        return f"load {rest}" if kind == LOAD else rest
    if kind == "gravity" or f"tau_{kind}" in PASSIVE:
        return kind if kind == "gravity" else f"own {kind}"
    moved = rest if kind == "motion" and between else unquote(name)
    return f"{shown_joints([moved], words)[0]} motion"


def cause_of(quantity: str, at: Sequence[int]) -> NetCause | None:
    """Return the cause of which an entry of a quantity is a part; None for one of another kind.

    at: index along each axis of the quantity, the joint first
    """
    if quantity in MOTION or quantity == "tau_share":
        return NetCause(MOTION[0] if quantity in MOTION else quantity, at[2])
    if quantity == "tau_load":
        return NetCause(quantity, at[1])
    return NetCause(quantity) if quantity in ("tau_gravity", *PASSIVE) else None


def net_places(
    causes: Sequence[NetCause], others: Iterable[tuple[str, tuple[int, ...]]]
) -> list[tuple[str, tuple[int, ...]]]:
    """Return the place of each joint and cause of which there is a part among other places, sorted."""
    number = {cause: at for at, cause in enumerate(causes)}
    found = {(at[0], number[cause]) for name, at in others if (cause := cause_of(name, at)) is not None}
    return [(NET, at) for at in sorted(found)]
