"""Other units for figures: degrees, kN and the like."""

import math
from collections.abc import Sequence
from dataclasses import replace

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.study.deviation_columns import RANDOM, WHOLE
from linkwise.study.summary import TrialSummary

DEGREE, THOUSANDTH = 180.0 / math.pi, 1e-3
FACTORS = {
    **{(f"rad{per}", f"deg{per}"): DEGREE for per in ("", "/s", "/s²")},
    **{
        (f"m{per}", f"{small}{per}"): by
        for per in ("", "/s", "/s²")
        for small, by in (("mm", 1e3), ("cm", 1e2))
    },
    **{(unit, f"k{unit}"): THOUSANDTH for unit in ("N", "N·m", "W", "J")},
}
"""Factors that take a value from the first unit to the second."""


def in_unit(trials: Sequence[TrialSummary], columns: Sequence[str], unit: str) -> list[TrialSummary]:
    """Return trials whose columns of these names, with their deviations, are in another unit.

    Raises LinkwiseError where a column's own unit cannot become it.
    """
    return [_in_unit(trial, columns, unit) for trial in trials]


def _in_unit(trial: TrialSummary, columns: Sequence[str], unit: str) -> TrialSummary:
    factors = {name: _factor(trial.units[name], unit) for name in columns if name in trial.units}
    every = {f"{beside}{name}": by for name, by in factors.items() for beside in ("", WHOLE, RANDOM)}
    return replace(
        trial,
        units={name: unit if name in every else own for name, own in trial.units.items()},
        statistics={name: values * every.get(name, 1.0) for name, values in trial.statistics.items()},
        curves={name: values * every.get(name, 1.0) for name, values in trial.curves.items()},
    )


def _factor(own: str, unit: str) -> float:
    if own == unit:
        return 1.0
    if (own, unit) not in FACTORS:
        others = listed(repr(after) for before, after in FACTORS if before == own) or repr(own)
        raise LinkwiseError(
            f"[[figure]]: 'unit' is {unit!r}, and what is in {own} cannot become it; it may be {others}"
        )
    return FACTORS[own, unit]
