"""Units of a force plate's channels, as ANALOG:UNITS of a C3D file says them."""

from collections.abc import Sequence

from linkwise.analysis.opensim.recorded_markers import METRES
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

BETWEEN = ("", ".", "*", "·", "-", " ")
"""Signs between the force and the length of a moment's unit."""
IN_SI = {
    "F": {"N": 1.0},
    "P": METRES,
    "M": {f"N{between}{unit}": size for unit, size in METRES.items() for between in BETWEEN},
}
"""Sizes in SI of the units of a force, a place and a moment; no other case, as mN is not MN."""
WORDS = {"F": "a force", "P": "a place", "M": "a moment"}
RAW = {"V", "mV"}
"""Units of what a calibration matrix turns into forces and moments."""


def sizes(number: int, letters: str, units: Sequence[str], metres: float) -> tuple[list[float], list[str]]:
    """Return the size in SI of each channel of a plate, and a line where the file says no units.

    letters: F, P or M for each channel; units: what the file says, empty for nothing, which is N, and N times
    POINT:UNITS, of `metres`

    Raises LinkwiseError for units that are not known, and for several of one quantity.
    """
    found, told = {}, []
    for what in dict.fromkeys(letters):
        said = sorted(
            {" ".join(unit.split()) for unit, one in zip(units, letters, strict=True) if one == what}
        )
        known = IN_SI[what]
        if said == [""]:
            found[what] = 1.0 if what == "F" else metres
            told.append(
                f"plate {number}: the unit of {WORDS[what]} is not said; N and N times POINT:UNITS are taken"
            )
        elif len(said) == 1 and said[0] in known:
            found[what] = known[said[0]]
        else:
            raise LinkwiseError(
                f"plate {number}: ANALOG:UNITS of {WORDS[what]} is {listed(map(repr, said))};"
                f" {listed(known, most=len(known))} are read, written so, and one for all its channels of"
                " that kind; write the right one there, or export the file again"
            )
    return [found[letter] for letter in letters], told[:1]


def matrix_sizes(
    number: int, letters: str, units: Sequence[str], metres: float
) -> tuple[list[float], list[str]]:
    """Return `sizes` of what a plate's calibration matrix makes of channels in these units.

    It makes N, and N times POINT:UNITS, of V; channels that have forces and moments already keep their units.
    """
    if set(units) <= RAW:
        return [1.0 if letter == "F" else metres for letter in letters], []
    return sizes(number, letters, units, metres)
