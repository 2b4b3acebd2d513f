"""Points whose acceleration is split by source: the joints, a point of a frame, the centre of mass."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.named_bodies import body_frame
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError

JOINTS, CENTRE = "joints", "centre-of-mass"
"""Names of the points that are no frames; a frame of such a name takes precedence."""
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class InducedPoint:
    """A point, whose acceleration is J q̈ + J̇ q̇, with a row for each of its components."""

    name: str
    """Name as the user gave it, and as columns show it."""
    rows: tuple[str, ...]
    units: tuple[str, ...]
    frame: str | None = None
    """Name of the frame; None for the joints and the centre of mass."""
    place: tuple[float, ...] = (0.0, 0.0, 0.0)
    """Position in the frame, in m."""

    def maps(self, robot: OpenedRobot, q: Array, qd: Array) -> tuple[Array, Array]:
        """Return J and J̇ at q and qd (S, n): (S, rows, n) each."""
        kinematics: Any = robot.model.kinematics if self.name != JOINTS or self.frame is not None else None
        if kinematics is None:
            unit = np.broadcast_to(np.eye(q.shape[1]), (*q.shape, q.shape[1]))
            return unit, np.zeros_like(unit)
        if self.frame is not None:
            jacobian = kinematics.jacobian(q, self.frame, self.place)
            return jacobian, kinematics.jacobian_rate(q, qd, self.frame, self.place)
        return _centre(robot, kinematics, q, qd)


@dataclass(frozen=True)
class InducedPlan:
    """Points whose acceleration is told, and whether weights and velocities are one source each."""

    points: tuple[InducedPoint, ...] = ()
    whole: bool = False


def induced_points(texts: Sequence[str], robot: OpenedRobot) -> tuple[InducedPoint, ...]:
    """Return the points that are written as FRAME, FRAME,X,Y,Z, joints or centre-of-mass.

    Raises LinkwiseError for a frame that does not exist, a point that is not three numbers, and a point that
    is given twice.
    """
    twice = [text for text, count in Counter(texts).items() if count > 1]
    if twice:
        raise LinkwiseError(f"--induced {twice[0]} is given twice; leave one of them out")
    return tuple(_point(text, robot) for text in texts)


def _point(text: str, robot: OpenedRobot) -> InducedPoint:
    tree = robot.package.manifest.tree
    frames = () if tree is None else tuple(frame.name for frame in tree.frames)
    if text == JOINTS and text not in frames:
        return InducedPoint(text, robot.joints, tuple(f"{unit}/s²" for unit in robot.units))
    if tree is None:
        raise LinkwiseError(
            f"--induced {text}: the links of {robot.name} are energies, which do not say where anything is;"
            f" give {JOINTS}"
        )
    if text == CENTRE and text not in frames:
        return InducedPoint(text, AXES, ("m/s²",) * 3)
    frame, place = text, (0.0, 0.0, 0.0)
    if text not in frames and "," in text:
        frame, *numbers = text.rsplit(",", 3)
        place = _place(text, numbers)
    body_frame(f"--induced {text}: not {JOINTS}, not {CENTRE}, and of frames", frame, robot)
    rows = (*(f"angular_{axis}" for axis in AXES), *AXES)
    return InducedPoint(text, rows, ("rad/s²",) * 3 + ("m/s²",) * 3, frame, place)


def _place(text: str, numbers: Sequence[str]) -> tuple[float, float, float]:
    try:
        x, y, z = map(float, numbers)
    except ValueError:
        x = math.nan
    if not math.isfinite(x) or not math.isfinite(y) or not math.isfinite(z):
        raise LinkwiseError(f"--induced {text}: give FRAME,X,Y,Z, such as hand,0,0,0.1, in m")
    return x, y, z


def _centre(robot: OpenedRobot, kinematics: Any, q: Array, qd: Array) -> tuple[Array, Array]:
    """Return J and J̇ of the centre of mass of links and payloads, each by its mass, (S, 3, n)."""
    tree = robot.package.manifest.tree
    own = sum(link.mass for link in tree.links) if tree else 0.0
    whole = own + sum(payload.mass for payload in robot.payloads)
    jacobian = own / whole * kinematics.centre_of_mass_jacobian(q)
    rate = own / whole * kinematics.centre_of_mass_jacobian_rate(q, qd)
    for payload in robot.payloads:
        share = payload.mass / whole
        jacobian = jacobian + share * kinematics.jacobian(q, payload.body, payload.point)[:, 3:]
        rate = rate + share * kinematics.jacobian_rate(q, qd, payload.body, payload.point)[:, 3:]
    return jacobian, rate
