"""Traces that are asked for: joints, windows of time, and where a trace begins anew."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal, get_args

import numpy as np
from linkwise_runtime.motion.traced import trace_parts, window_ends
from linkwise_runtime.motion.tracer import TraceParts

from linkwise.analysis.contacts.times import ContactTimes
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.settings import pairs
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.option import option

EVERY, PHASES = "all", "phases"
"""Words for all joints, and for begins and ends of phases."""
Weight = Literal["apart", "borne"]
AT_ONCE = 4096
"""Samples that are looked at for phases at once."""


@dataclass(frozen=True)
class TraceChoices:
    """Choices of a trace, as they are written.

    `torques` holds (column, joint) pairs, or is a dict of them. Raises LinkwiseError for choices without a
    joint that is traced.
    """

    joints: tuple[str, ...] = option(
        (),
        "Tell which sources the velocity of a joint, and what velocities ask of it, came from; all for every"
        " joint; may be repeated",
        "--trace",
        metavar="JOINT",
    )
    windows: float | None = option(
        None,
        "Cut the sources of --trace into windows of this length, s",
        "--trace-windows",
        metavar="S",
        is_key=False,  # columns would have each trial's own times in their names
    )
    weight: Weight = option(
        "apart",
        "Weight as a source of --trace, or borne by torques: these are what is beyond",
        "--trace-weight",
    )
    restart: tuple[str, ...] = option(
        (),
        "Begin the trace anew at a time, s, or wherever a phase begins or ends; may be repeated",
        "--trace-restart",
        metavar="S|phases",
    )
    torques: tuple[tuple[str, str], ...] | Mapping[str, str] = option(
        (),
        "Column of the torque that a joint's actuator gave, as a source of --trace; what such torques leave"
        " of the motion is the source residual; may be repeated",
        "--trace-torque",
        metavar="COLUMN=JOINT",
        read=partial(pairs, "--trace-torque"),
    )
    torque_factor: float = option(
        1.0, "What brings these torques to N m and forces to N: 0.001 for N mm", "--trace-torque-factor"
    )

    def __post_init__(self) -> None:
        for flag, given in (
            ("--trace-windows", self.windows),
            ("--trace-restart", self.restart),
            ("--trace-weight borne", self.weight == "borne"),
            ("--trace-torque", self.torques),
        ):
            if given and not self.joints:
                raise LinkwiseError(f"{flag} goes with --trace; add it")
        if not all(isinstance(pair, (tuple, list)) and len(pair) == 2 for pair in self.pairs):
            raise LinkwiseError(
                f"--trace-torque {self.torques!r}: give pairs of a column and a joint, or a dict"
            )
        if self.torque_factor != 1.0 and not self.torques:
            raise LinkwiseError("--trace-torque-factor goes with --trace-torque; add it")
        if not (self.torque_factor and np.isfinite(self.torque_factor)):
            raise LinkwiseError(f"--trace-torque-factor {self.torque_factor:g}: give a number that is not 0")

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Columns of torques and their joints."""
        return tuple(self.torques.items() if isinstance(self.torques, Mapping) else self.torques)


@dataclass(frozen=True)
class AskedTrace:
    """A trace that is asked for: joints, and how it is cut in time."""

    joints: tuple[int, ...]
    parts: TraceParts
    windows: tuple[tuple[float, float], ...]
    is_borne: bool
    """True if torques are those beyond what holds the weight, which is no source."""

    @classmethod
    def of(
        cls, choices: TraceChoices, restarts: Sequence[float], robot: OpenedRobot, time: Array
    ) -> "AskedTrace":
        """Return the trace of a movement at these times, in s.

        Raises LinkwiseError for a joint that is not there, for times outside the movement, and for weight
        that is borne of links that were written by hand.
        """
        windows, weight = choices.windows, choices.weight
        if weight not in get_args(Weight):
            raise LinkwiseError(f"--trace-weight {weight}: give {' or '.join(get_args(Weight))}")
        is_borne = weight == "borne"
        if is_borne and robot.is_written:
            raise LinkwiseError(
                f"--trace-weight borne: the links of {robot.name} were written by hand, and it is not said"
                " which of their shares torques bear; leave it out"
            )
        joints = [k for name in choices.joints for k in _joints(name, robot)]
        try:
            flags = "--trace-windows", "--trace-restart"
            parts = trace_parts(() if windows is None else windows, sorted(restarts), time.tolist(), flags)
        except ValueError as error:
            raise LinkwiseError(str(error)) from None
        return cls(tuple(dict.fromkeys(joints)), parts, window_ends(parts, time.tolist()), is_borne)


def restart_times(
    given: Sequence[str],
    phases: Sequence[PlacedPhase],
    robot: OpenedRobot,
    times: ContactTimes | None,
    time: Array,
    q: Array,
) -> list[float]:
    """Return the times at which a trace begins anew, from texts of them or the word phases.

    q: positions (S, n) at the times (S,). Raises LinkwiseError for another text, without any phase, and for a
    phase in which no sample is.
    """
    found: set[float] = set()
    for text in given:
        if text != PHASES:
            try:
                found.add(float(text))
            except ValueError:
                raise LinkwiseError(f"--trace-restart {text}: give a time in s, or {PHASES}") from None
            continue
        if not phases:
            raise LinkwiseError(f"--trace-restart {PHASES}: there are none; give some with --phase")
        ever_on = np.zeros(len(phases), dtype=np.bool_)
        for at in range(0, len(time), AT_ONCE):
            some = slice(at, at + AT_ONCE + 1)
            shares = np.zeros((0, len(time[some])))
            if times is not None:
                shares = times.shares(robot.model, time[some], q[some]).T
            for number, phase in enumerate(phases):
                on = phase.on(robot, time[some], q[some], shares)
                ever_on[number] |= on.any()
                found |= set(time[some][np.flatnonzero(np.diff(on)) + 1].tolist())
        for phase, is_ever_on in zip(phases, ever_on, strict=True):
            if not is_ever_on:
                raise LinkwiseError(f"--trace-restart {PHASES}: no sample is in the phase {phase.name}")
    ends = time[0], time[-1]
    return sorted(at for at in found if at not in ends)


def _joints(name: str, robot: OpenedRobot) -> Sequence[int]:
    """Return the joints of a name, or all of them."""
    if name in robot.joints:
        return [robot.joints.index(name)]
    if name == EVERY:
        return range(len(robot.joints))
    raise LinkwiseError(f"--trace {name}: no such joint; there are {listed(robot.joints)}, or {EVERY}")
