"""Presets of how uncertain segments of a person are, from published regressions, by the names of links.

What counts is by how much one person's segment is off what a regression on body mass and height says of it:
the standard error of that regression. A spread over persons would be more than that.
"""

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from linkwise.errors import LinkwiseError
from linkwise.escape import listed

STATED = ("mass", "centre", "radii")
"""Keys of a link that a preset gives."""


class SegmentErrors(NamedTuple):
    """Errors of a regression for one segment, with the means of who was measured."""

    mass: float
    """Mean mass in kg."""
    mass_error: float
    """Standard error of the mass in kg."""
    sagittal: float
    """Mean moment of inertia about the centre and the axis from back to front, in kg cm^2."""
    sagittal_error: float
    transverse: float
    """Mean moment about the axis from side to side."""
    transverse_error: float
    centre_error: float
    """Standard error of the centre along the segment in mm."""

    @property
    def deviations(self) -> dict[str, Any]:
        """Deviations of mass and of radii as parts, of the centre in m along each axis.

        Moments m r^2 have the errors e_I of the source where m and r are independent of each other, with the
        radii's deviation e_r from 4 e_r^2 = e_I^2 - e_m^2, all as parts, and e_I^2 the mean over both axes.
        """
        mass = self.mass_error / self.mass
        moments = [self.sagittal_error / self.sagittal, self.transverse_error / self.transverse]
        radii = max(sum(part**2 for part in moments) / 2 - mass**2, 0.0) ** 0.5 / 2
        return {"mass": mass, "centre": [self.centre_error / 1000.0] * 3, "radii": radii}


class Preset(NamedTuple):
    """Segments of one source."""

    source: str
    segments: Mapping[str, SegmentErrors]


BOOK = (
    "V. M. Zatsiorsky, Kinetics of Human Motion, 2002: errors of regressions on body mass and height, table "
)
PRESETS = {
    "zatsiorsky-men": Preset(
        f"{BOOK}A2.6",
        {
            "foot": SegmentErrors(0.997, 0.101, 44.0, 6.8, 40.0, 5.77, 11.0),
            "shank": SegmentErrors(3.16, 0.219, 385.0, 48.6, 371.0, 49.0, 12.5),
            "thigh": SegmentErrors(10.36, 0.721, 1997.8, 248.0, 1999.4, 244.0, 13.1),
            "hand": SegmentErrors(0.447, 0.063, 13.2, 3.7, 8.76, 2.7, 11.2),
            "forearm": SegmentErrors(1.177, 0.101, 64.7, 10.2, 60.2, 9.6, 11.4),
            "upper arm": SegmentErrors(1.98, 0.178, 127.3, 27.6, 114.4, 26.6, 14.0),
            "head": SegmentErrors(5.018, 0.322, 272.1, 42.5, 293.9, 40.0, 6.9),
            "thorax": SegmentErrors(11.654, 1.142, 1725.6, 297.0, 705.2, 171.0, 11.9),
            "abdomen": SegmentErrors(11.953, 1.238, 1280.8, 237.0, 819.1, 175.0, 11.8),
            "pelvis": SegmentErrors(8.164, 1.020, 656.8, 156.0, 525.0, 117.0, 10.0),
        },
    ),
    # Its centres are in % of the length: here times the mean length, sqrt(I / m) over the radius' part of it.
    "zatsiorsky-women": Preset(
        f"{BOOK}A2.7",
        {
            "foot": SegmentErrors(0.88, 0.11, 41.1, 7.6, 35.6, 4.0, 8.9),
            "shank": SegmentErrors(3.0, 0.36, 409.9, 63.8, 399.7, 62.2, 3.9),
            "thigh": SegmentErrors(9.16, 0.81, 1690.1, 205.9, 1647.3, 252.0, 5.9),
            "hand": SegmentErrors(0.35, 0.03, 6.0, 1.47, 4.4, 1.1, 3.3),
            "forearm": SegmentErrors(0.86, 0.11, 40.9, 7.58, 39.7, 7.9, 3.5),
            "upper arm": SegmentErrors(1.58, 0.21, 92.3, 45.3, 80.7, 25.6, 2.8),
            "head": SegmentErrors(4.2, 0.49, 183.6, 53.5, 216.5, 49.1, 7.8),
            "thorax": SegmentErrors(9.58, 1.47, 1082.8, 249.5, 490.3, 147.2, 6.2),
            "abdomen": SegmentErrors(9.08, 1.09, 717.3, 245.8, 480.2, 125.0, 4.1),
            "pelvis": SegmentErrors(7.73, 0.90, 477.3, 129.5, 411.0, 78.8, 4.4),
        },
    ),
}
"""Presets by name. Figures as https://github.com/wspr/body-segment-param has them from the book."""
WORDS = {
    "foot": ("foot", "calcn", "calcaneus", "talus", "toe", "toes"),
    "shank": ("shank", "tibia", "fibula", "shin", "calf", "lowerleg"),
    "thigh": ("thigh", "femur", "upperleg", "upleg"),
    "hand": ("hand",),
    "forearm": ("forearm", "lowerarm", "ulna", "radius"),
    "upper arm": ("upperarm", "humerus"),
    "head": ("head",),
    "thorax": ("thorax", "chest"),
    "abdomen": ("abdomen",),
    "pelvis": ("pelvis",),
}
"""Words in names of links that say which segment they are, or a part of it."""
PIECES = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")


class FittedSegment(NamedTuple):
    """Segment that a link is."""

    preset: str
    segment: str

    @property
    def deviations(self) -> dict[str, Any]:
        """Deviations by key, as `SegmentErrors.deviations`."""
        return PRESETS[self.preset].segments[self.segment].deviations


def fitted_segment(
    link: str, own: Mapping[str, Any], usual: Mapping[str, Any], mass: float
) -> FittedSegment | None:
    """Return the segment that a link is; None without a preset, for a link without mass or with all stated.

    own, usual: tables of the link and of all

    Raises LinkwiseError for a preset or a segment that is not there, and where the name of a link of which
    something is not stated fits no segment, or several.
    """
    place = f"[link.{link}]"
    chosen = [(at, table["preset"]) for at, table in ((place, own), ("[all]", usual)) if "preset" in table]
    if not chosen:
        if "segment" in own:
            raise LinkwiseError(f"{place}: segment needs a preset, here or in [all]: {listed(PRESETS)}")
        return None
    preset = _one_of(*chosen[0], "preset", tuple(PRESETS))
    if "segment" in own:
        return FittedSegment(preset, _one_of(place, own["segment"], "segment", tuple(WORDS)))
    fitting = segments_of(link)
    if len(fitting) == 1:
        return FittedSegment(preset, fitting[0])
    stated = own if "preset" in own else {**usual, **own}
    if not mass > 0 or all(key in stated for key in STATED):
        return None
    fits = f"fits {listed(fitting)}" if fitting else "fits no segment"
    raise LinkwiseError(
        f"{chosen[0][0]}: the name of link {link!r} {fits} of preset {preset!r}; in {place} write "
        f"segment, one of {listed(WORDS, len(WORDS))}, or mass, centre and radii"
    )


def segments_of(link: str) -> list[str]:
    """Return the segments whose words stand in a link's name, in two pieces or one: upper_arm, upperarm."""
    pieces = [piece.lower() for piece in PIECES.findall(link)]
    words = {*pieces, *(a + b for a, b in pairwise(pieces))}
    return [segment for segment, known in WORDS.items() if words & set(known)]


def presets_record(fitted: Mapping[str, FittedSegment]) -> dict[str, Any]:
    """Return which preset gave deviations to which links, and its source, as plain data."""
    used = dict.fromkeys(one.preset for one in fitted.values())
    return {
        preset: {
            "source": PRESETS[preset].source,
            "segments": {link: one.segment for link, one in fitted.items() if one.preset == preset},
        }
        for preset in used
    }


def _one_of(place: str, given: Any, key: str, known: Sequence[str]) -> str:
    """Return a name that is known; raise LinkwiseError for another."""
    if not isinstance(given, str) or given not in known:
        raise LinkwiseError(f"{place}: {key} is {given!r}; known are {listed(known, len(known))}")
    return given
