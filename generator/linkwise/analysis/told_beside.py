"""Choice of what a result tells: columns of torques, and what stands beside these."""

from collections.abc import Sequence
from typing import NamedTuple

from linkwise.analysis.borne_joints import BorneJoint
from linkwise.analysis.induced_points import InducedPlan
from linkwise.analysis.traced_rows import TracedRows
from linkwise.analysis.uncertain_inputs import UncertainInputs


class ToldBeside(NamedTuple):
    """Choice of all that a result tells beside torques."""

    power_terms: bool = False
    """True to tell power by cause and order too."""
    induced: InducedPlan = InducedPlan()
    """Points whose acceleration is told by source."""
    borne: Sequence[BorneJoint] = ()
    """Joints whose whole wrench is told by cause."""
    induced_power: bool = False
    """True to tell by source the power of links, and that which flows through joints."""
    traced: TracedRows | None = None
    """Velocities that are traced to their sources."""
    uncertain: UncertainInputs = UncertainInputs()
    """Uncertainty of bodies, motion and loads."""
    columns: Sequence[str] = ()
    """Presets and patterns of the columns of torques that are computed; all where there are none."""
    asked: Sequence[str] = ()
    """Presets and patterns that were asked for, by which net torques by cause are told."""


NOTHING_BESIDE = ToldBeside()
