"""Phases of the movement that a picture tells apart, and which samples are in each."""

from collections.abc import Sequence
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
    """A phase, or the rest of the movement beside it; without a phase, the whole movement."""

    label: str
    placed: PlacedPhase | None = None
    is_rest: bool = False

    def on(self, result: AnalysisResult) -> NDArray[np.bool_]:
        """Return which samples (S,) of a result, or a part of one, are in it."""
        if self.placed is None:
            return np.ones(len(result.time), dtype=np.bool_)
        contacts = np.array(
            [v for c, v in zip(result.columns, result.values, strict=True) if c.quantity == "contact"]
        )
        return self.placed.on(result.robot, result.time, result.q, contacts) ^ self.is_rest


def shown_phases(result: AnalysisResult, i: int) -> list[ShownPhase]:
    """Return the phases of `asked_phases`, each followed by the rest of the movement if that is named."""
    found = []
    for phase in asked_phases(result, i):
        found.append(ShownPhase(drawn(phase.name, 34), phase))
        if phase.rest:
            found.append(ShownPhase(drawn(phase.rest, 34), phase, is_rest=True))
    return found


def require_samples(
    result: AnalysisResult, phases: list[ShownPhase], counts: Sequence[int]
) -> list[ShownPhase]:
    """Return the phases, or the whole movement where they distinguish nothing.

    counts: number of samples of each phase

    Raises LinkwiseError for a phase that was asked for and has no sample.
    """
    empty = [phase.label for phase, count in zip(phases, counts, strict=True) if not count]
    if empty and result.phases:
        raise LinkwiseError(f"--phase: {empty[0]} has no sample between {_span(result)}")
    return [ShownPhase("the whole movement")] if empty or not phases else phases


def _span(result: AnalysisResult) -> str:
    return f"{result.time[0]:.4g} and {result.time[-1]:.4g} s"


def asked_phases(result: AnalysisResult, i: int) -> tuple[PlacedPhase, ...]:
    """Return the phases that were given, else one while the only load or contact on joint i acts.

    There is no phase if several act on it, or none.
    """
    if result.phases:
        return result.phases
    ground, tree = result.robot.contacts, result.robot.package.manifest.tree
    loads = [one for one in result.loads if i in one.seat.joints]
    held: list[int] = []
    if ground is not None and tree is not None:
        body = {frame.name: frame.joint for frame in tree.frames}
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
