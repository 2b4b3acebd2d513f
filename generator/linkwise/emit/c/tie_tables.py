"""Tables in C of what ties a robot's joints beside the tree: loops and couplings."""

from dataclasses import dataclass
from itertools import accumulate
from typing import Any

from linkwise_runtime.constraints.held_frames import ROWS
from linkwise_runtime.native.library import MOST_TIED, scratch_numbers

from linkwise.escape import c_comment
from linkwise.symbolic.system import RigidSystem, System

KINDS = {"point": "POINT", "hinge": "HINGE", "frame": "FRAME", "distance": "DISTANCE"}
"""Names of the kinds of ties in tree.h, behind HELD_."""


@dataclass(frozen=True)
class CouplingRows:
    """Couplings as rows of the tables in tree.h: where each one's terms begin, terms, and coefficients."""

    starts: tuple[int, ...]
    terms: tuple[str, ...]
    factors: str


def tie_view(system: RigidSystem) -> dict[str, Any]:
    """Return the fields of NAME_tree.h that say what ties the joints."""
    ties = [
        f"{{HELD_{KINDS[tie.kind]}, {tie.first}, {tie.second}, R({float(tie.length)!r})}}, "
        f"/* {c_comment(tie.name)} */"
        for tie in system.robot.ties
    ]
    rows = tied_rows(system)
    return {"ties": ties, "couplings": _couplings(system), "tied_rows": rows, "scratch": scratch(system)}


def has_tied_functions(system: System) -> bool:
    """Return whether C has functions of tied joints: for rigid links, and not for very many joints."""
    return isinstance(system, RigidSystem) and len(system.coordinates) <= MOST_TIED


def tied_rows(system: RigidSystem) -> int:
    """Return how many rows the robot's own ties and couplings have."""
    return sum(len(ROWS[tie.kind]) for tie in system.robot.ties) + len(system.robot.couplings)


def scratch(system: RigidSystem) -> int:
    """Return how many numbers of memory a simulation needs for each motion."""
    kinds = (tie.kind for tie in system.robot.ties)
    return scratch_numbers(len(system.coordinates), kinds, len(system.robot.couplings))


def _couplings(system: RigidSystem) -> CouplingRows:
    terms, factors = [], list[float]()
    for coupling in system.robot.couplings:
        for coordinate, own in coupling.terms:
            name = c_comment(system.coordinates[coordinate].name)
            terms.append(
                f"{{{coordinate}, {len(factors)}, {len(own)}}}, /* {c_comment(coupling.name)}: {name} */"
            )
            factors += own
    counts = (len(coupling.terms) for coupling in system.robot.couplings)
    numbers = ", ".join(f"R({float(factor)!r})" for factor in factors or [0.0])
    return CouplingRows(tuple(accumulate(counts, initial=0)), tuple(terms), numbers)
