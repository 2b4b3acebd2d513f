"""Contacts as a user gives them: frames that the ground holds in a movement, and when it holds them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from linkwise_runtime.quantities import Contact

from linkwise.analysis.loads import Load, Loads
from linkwise.errors import LinkwiseError

THRESHOLD = 20.0
"""Force in N; where a force plate reads less, nothing stands on it."""


@dataclass(frozen=True)
class WhileColumn:
    """Condition that a contact is on: a column of the motion's log is above a value."""

    column: str
    above: float = 0.5

    def __post_init__(self) -> None:
        if not math.isfinite(self.above):
            raise LinkwiseError(f"--contact-while: {self.column!r} above {self.above}; give a finite number")


@dataclass(frozen=True)
class Contacts:
    """Frames that the ground holds while the robot moves; the forces on them are found from the motion.

    A contact is on all the time; or, if `columns` has its name, while a column of the motion's log is above a
    value; or, if `loads` are given, while the measured loads on its body exceed `threshold` in N. These loads
    do not load the robot: contact forces are compared with them, and forces that several contacts could carry
    are shared in proportion to them. `unactuated` names the joints that nothing drives, from whose equations
    the contact forces are found, and whose torques are residuals without contacts: the joints of the floating
    base unless given, and none by the name "none".

    Raises LinkwiseError for values that do not go together.
    """

    given: Sequence[Contact] = ()
    columns: Mapping[str, WhileColumn] = field(default_factory=dict)
    loads: tuple[Load | str | Path, ...] = ()
    threshold: float | None = None
    cutoff: float | None = None
    """Cutoff in Hz of the low-pass filter for these loads; no filter unless given."""
    unactuated: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._check_kinds()
        if not self.given:
            for flag, there in (
                ("--contact-while", self.columns),
                ("--contact-loads", self.loads),
            ):
                if there:
                    raise LinkwiseError(f"{flag} goes with --contact; add it")
        if self.threshold is not None and not self.loads:
            raise LinkwiseError("--contact-threshold goes with --contact-loads; add it")
        if self.threshold is not None and not 0.0 <= self.threshold < math.inf:
            raise LinkwiseError(f"--contact-threshold {self.threshold:g}: give a force in N, 0 or more")

    def _check_kinds(self) -> None:
        if not isinstance(self.given, list | tuple) or isinstance(self.given, Contact):
            raise LinkwiseError("contacts: give a list of Contact, or Contacts")
        for one in self.given:
            if not isinstance(one, Contact):
                raise LinkwiseError(f"contacts: {str(one)[:60]!r} is not a Contact")
        for name, column in self.columns.items():
            if not isinstance(column, WhileColumn):
                raise LinkwiseError(f"contacts: columns[{name!r}] is not a WhileColumn")

    @classmethod
    def of(cls, given: "Contacts | Sequence[Contact]") -> "Contacts":
        """Return the contacts themselves, or from a sequence, contacts that are on all the time."""
        return given if isinstance(given, Contacts) else cls(given)

    @property
    def measured(self) -> Loads:
        """Measured loads, given as values or as files."""
        return Loads.of(self.loads, self.cutoff)

    @property
    def least_force(self) -> float:
        """Force in N above which the measured loads switch a contact on."""
        return THRESHOLD if self.threshold is None else self.threshold
