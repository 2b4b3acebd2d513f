"""Phases of the movement that a picture tells apart, and which samples are in each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linkwise.analysis.loads.placed_load import moving_joints
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.result import AnalysisResult
from linkwise.errors import LinkwiseError
from linkwise.escape import printable
from linkwise.plotstyle import drawn


@dataclass(frozen=True, eq=False)
class ShownPhase:
    """A phase, and which samples (S,) are in it."""

    label: str
    on: NDArray[np.bool_]


def phases_of(result: AnalysisResult, i: int) -> list[ShownPhase]:
    """Phases that were asked for; else while the one load or contact that joint i bears acts, and while not.

    Raises LinkwiseError for a phase that has no sample.
    """
    made = not result.phases
    contacts = np.array(
        [v for c, v in zip(result.columns, result.values, strict=True) if c.quantity == "contact"]
    )
    found = []
    for phase in asked_phases(result, i):
        on = phase.on(result.robot, result.time, result.q, contacts)
        found.append(ShownPhase(drawn(phase.name, 34), on))
        if phase.rest:
            found.append(ShownPhase(drawn(phase.rest, 34), ~on))
    empty = [phase.label for phase in found if not phase.on.any()]
    if empty and not made:
        raise LinkwiseError(f"--phase: {empty[0]} has no sample between {_span(result)}")
    whole = ShownPhase("the whole movement", np.ones(len(result.time), dtype=np.bool_))
    return [whole] if made and (empty or not found) else found


def _span(result: AnalysisResult) -> str:
    return f"{result.time[0]:.4g} and {result.time[-1]:.4g} s"


def asked_phases(result: AnalysisResult, i: int) -> tuple[PlacedPhase, ...]:
    """Phases that were given; else while the one load or contact that the joint bears acts."""
    if result.phases:
        return result.phases
    ground, tree = result.robot.contacts, result.robot.package.manifest.tree
    loads = [one for one in result.loads if i in one.seat.joints]
    held: list[int] = []
    if ground is not None and tree is not None:
        body = {frame.name: frame.body for frame in tree.frames}
        moved = [moving_joints(tree, body[str(one.frame)]) for one in ground.contacts]
        held = [number for number, joints in enumerate(moved) if i in joints]
    if len(loads) + len(held) != 1:
        return ()
    if loads:
        name = printable(f"load {loads[0].name}")
        return (PlacedPhase(f"{name} acts", f"{name} does not act", load=loads[0]),)
    assert ground is not None
    name = printable(ground.names[held[0]])
    return (PlacedPhase(f"{name} stands", f"{name} does not stand", contact=held[0]),)
