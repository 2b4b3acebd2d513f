"""Differences of an arm that does not move in a plane, as the paper's arms do."""

from collections.abc import Iterator

import numpy as np

from linkwise.arrays import Array
from linkwise.report.term_count import TermPair
from linkwise.symbolic.system import RigidSystem, System

PARALLEL = 1e-9
"""Part of a unit vector: a smaller component across an axis is rounding."""


def is_spatial(system: System, links: int) -> bool:
    """Return whether the first `links` links of a serial arm of rigid bodies leave a plane.

    They stay in one where all revolute axes are parallel, and all prismatic axes perpendicular to these.
    """
    if not isinstance(system, RigidSystem):
        return False
    turn, turns, slides = np.eye(3), list[Array](), list[Array]()
    for joint in system.links[links - 1].joints:
        turn = turn @ np.array(joint.rotation, dtype=float)
        (turns if joint.kind == "revolute" else slides).append(turn[:, 2])
    leaning = [float(np.linalg.norm(np.cross(turns[0], axis))) for axis in turns]
    along = [abs(float(turns[0] @ axis)) for axis in slides] if turns else []
    return max([*leaning, *along], default=0.0) > PARALLEL


def spatial_remark(
    dof: int, terms: TermPair, uncombined: TermPair | None, first: TermPair | None
) -> Iterator[str]:
    """Yield sentences on a spatial arm.

    dof: the most degrees of freedom
    terms, uncombined: counts there, by both conventions
    first: counts of one link
    """
    yield (
        "**A spatial arm differs.** The paper's claim is about arms that move in a plane, and this one's "
        "axes are not parallel. Turns about parallel axes add up to one angle, and the counts of a planar "
        "arm are polynomials in n; here every joint's sines and cosines multiply what is there, of the part "
        "that is kept as of the rest, and all six numbers of a link's inertia count in place of one. Right "
        "angles and offsets of zero take terms away, of one robot and not of another: the counts follow no "
        "law in n, and A and λ tell of this arm alone."
    )
    if first is not None and first.kept == first.total:
        yield "Of its first link all terms are kept: that axis carries no weight, which could be left out."
    if uncombined is not None:
        yield (
            f"What the energies are written in counts more: {terms.reduction:.1%} of the terms are saved at "
            f"{dof} DoF, {uncombined.reduction:.1%} where sin² + cos² are left; of a planar arm the two are "
            "equal within 0.2 points from 4 DoF on."
        )
