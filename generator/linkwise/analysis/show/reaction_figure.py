"""Panels of the wrench that a joint carries, one for each component, and its largest causes."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import PASSIVE, REACTION_OF
from linkwise.analysis.show.sourced_panels import Kind, SourceCurve, SourcedPanels, largest_alone
from linkwise.escape import column_part

MOST = 5
"""Coordinates whose motions have curves of their own; all other motions are summed in one."""
NOTHING = 1e-9
"""Part of the largest moment, or force, below which a component is only rounding."""
MOTION = ("reaction_qdd", "reaction_qd")
AXES = {"joint": "axes of the joint, z along its axis", "world": "axes of the world"}


def reaction_panels(result: AnalysisResult, number: int) -> SourcedPanels:
    """Return a panel for each component of the wrench of a joint that was asked for."""
    parts, names = _components(result, number), result.rows.axes["wrench"].names
    borne = result.borne[number]
    told = AXES.get(borne.axes, f"axes of {column_part(borne.axes)}")
    units = ("N·m" if names[part].startswith("moment") else "N" for part in parts)
    return SourcedPanels(
        f"What {column_part(borne.joint)} carries",
        [(names[part].replace("_", " "), unit) for part, unit in zip(parts, units, strict=True)],
        _sources(result, number, parts),
        (f"{told}; moments about the joint's origin",),
    )


def _components(result: AnalysisResult, number: int) -> list[int]:
    """Return the components that are more than rounding, moments beside moments and forces beside forces."""
    sizes = np.zeros(6)
    for part in range(6):
        rows = result.rows.numbers("reaction", *MOTION, "reaction_gravity", bearing=number, wrench=part)
        sizes[part] = result.totals.mean[rows].sum()
    largest = np.repeat([sizes[:3].max(), sizes[3:].max()], 3)
    return np.flatnonzero(sizes > NOTHING * largest).tolist() or [0]


def _sources(result: AnalysisResult, number: int, parts: Sequence[int]) -> list[SourceCurve]:
    """Return the sum and the sources, motions with the largest mean force and moment first."""
    robot, names = result.robot, result.robot.figure_joints

    def source(kind: Kind, label: str, *quantities: str, at: int = 0, **where: Any) -> SourceCurve:
        rows = (result.rows.numbers(*quantities, bearing=number, wrench=part, **where) for part in parts)
        return SourceCurve(kind, label, at, tuple(rows))

    motions = [
        source("joint", f"motion of {names[k]}", *MOTION, at=at, cause=k) for at, k in enumerate(robot.driven)
    ]
    alone, rest = largest_alone(result, motions, MOST)
    found = [source("sum", "all together", "reaction"), source("named", "gravity", "reaction_gravity")]
    found += [motions[at] for at in alone]
    if rest:
        others = [robot.driven[at] for at in rest]
        found.append(source("others", f"motions of {len(rest)} others", *MOTION, cause=others))
    for e, label in enumerate(result.load_labels):
        found.append(source("load", label, "reaction_load", at=e, load=e))
    own = [REACTION_OF[name] for name in PASSIVE if REACTION_OF[name] in result.rows]
    if own:
        found.append(source("passive", "springs and losses of followers", *own))
    return found
