"""Which joints rub: all but the coordinates of a base that floats, and has no bearings.

A floating joint `base` that carries the link `trunk` is six coordinates, base_x to base_roll; five of them
carry frames without mass, trunk_x to trunk_pitch, and the last one the link.
"""

from collections.abc import Sequence

from linkwise.package.entries import BodyEntry
from linkwise.robot.joint_types import FLOATING

SUFFIXES = tuple(f"_{name}" for name, _, _ in FLOATING)
SLIDES = SUFFIXES[:3]


def floating_coordinates(bodies: Sequence[BodyEntry]) -> frozenset[str]:
    """Names of the coordinates of floating joints; a ball joint, which does not slide, is none."""
    links = {body.link: body for body in bodies}
    found = set[str]()
    for body in bodies:
        name = body.joint.removesuffix(SUFFIXES[-1])
        frames = [links.get(f"{body.link}{suffix}") for suffix in SUFFIXES[:-1]]
        parts = [
            frame.joint
            for frame, suffix in zip(frames, SUFFIXES, strict=False)
            if frame is not None and frame.mass == 0 and frame.joint == f"{name}{suffix}"
        ]
        if name != body.joint and any(part.endswith(SLIDES) for part in parts):
            found |= {*parts, body.joint}
    return frozenset(found)
