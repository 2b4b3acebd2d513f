"""Results over a whole movement: totals and errors of rows, and the work of powers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from linkwise.analysis.certain_signs import LargestTorque
from linkwise.analysis.chosen_columns import PRESETS
from linkwise.analysis.cutoff_sweep import CutoffSweep
from linkwise.analysis.residuals import ResidualReport
from linkwise.analysis.verify import Closure
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed


def not_asked_for(quantities: Sequence[str]) -> LinkwiseError:
    """Return an error that says which preset of columns has what was not computed."""
    preset = next(name for name in ("sums", "by-cause", "causes", "all") if {*quantities} <= {*PRESETS[name]})
    return LinkwiseError(
        f"columns left out what this is made of ({listed(quantities)}); it is there with columns {preset!r}"
    )


@dataclass(frozen=True, eq=False)
class Work:
    """Energy in J that joints gave, ∫ max(P, 0) dt, and took back, ∫ max(-P, 0) dt: arrays of one shape."""

    given: Array
    taken: Array

    @property
    def net(self) -> Array:
        """∫ P dt in J: what was given less what was taken back."""
        net: Array = self.given - self.taken
        return net


@dataclass(frozen=True, eq=False)
class Totals:
    """Mean and largest magnitude of each row, (rows,), over every sample of the movement."""

    mean: Array
    peak: Array
    rms: Array
    """Root mean square of joint torques, before and after muscles; 0 for other rows."""


@dataclass(frozen=True, eq=False)
class WholeMovement:
    """Totals, work and errors over all samples of a movement; n joints, N links."""

    totals: Totals
    works: Mapping[str, Work]
    """Work in J of joints, and of contacts, by the quantity that is its power, along its axes."""
    work_by_source: Mapping[str, Work]
    """Work that holders of energy gained by source and lost, and that flowed through joints and back, in J,
    by the quantity that is its power, along its axes; none unless power by source was asked for."""
    work_in_phases: tuple[Mapping[str, Work], ...]
    """Work in each of the `phases`, in J, by the quantity that is its power, `work_by_source` among it."""
    closure: Closure
    total: int
    """Number of samples."""
    peaks: tuple[LargestTorque, ...]
    """Torques at their largest magnitude, with their deviations there; none where nothing is uncertain."""
    cutoff_sweep: CutoffSweep | None
    """Sizes of torques at other cutoffs; None where they were not asked for."""
    residual_report: ResidualReport
    """Residuals of coordinates that nothing drives, as far as their torques are computed."""

    @property
    def work(self) -> Work:
        """Work that each joint gave to each link and took back, (n, N) in J."""
        return self.work_of("power_link")

    @property
    def joint_work(self) -> Work:
        """Work that each joint gave in all, ∫ τ_i q̇_i dt where positive, and took back, (n,) in J."""
        return self.work_of("power")

    @property
    def load_work(self) -> Work:
        """Work that each joint gave against each load and took back, (n, loads) in J."""
        return self.work_of("power_load")

    @property
    def contact_work(self) -> Work:
        """Work that each contact fed into each link as it slipped, and took back, (N, contacts) in J."""
        return self.work_of("power_contact")

    def work_of(self, power: str) -> Work:
        """Return the work of a power; raise LinkwiseError where its columns were not asked for."""
        if power not in self.works:
            raise not_asked_for([power])
        return self.works[power]
