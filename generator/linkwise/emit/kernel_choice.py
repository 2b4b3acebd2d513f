"""Which kind of kernel a package gets: straight lines of closed forms, or loops over links and joints."""

from collections.abc import Iterable
from typing import get_args

from linkwise.dynamics.derive import Method
from linkwise.emit.backend import LOOPS
from linkwise.errors import LinkwiseError
from linkwise.package.entries import KernelKind
from linkwise.symbolic.system import EnergySystem, System

CHOICES = ("auto", "straight", "loops")

MOST_STRAIGHT = 1500
"""Values of c2, c1, g and tau of one sample up to which closed forms are derived: see docs/kernels.md."""


def chosen_kernel(
    system: System, choice: str, backends: Iterable[str] | None, derivation: str = "rule"
) -> KernelKind:
    """Kind of kernel for one of CHOICES and the back ends asked for by name, None for all there are.

    Raises LinkwiseError for a choice that is not one, and for loops over energies or for a derivation from
    them.
    """
    if derivation not in get_args(Method):
        raise LinkwiseError(f"no derivation {derivation!r}; choose rule or energy")
    if choice not in CHOICES:
        raise LinkwiseError(f"no kernel {choice!r}; choose among {', '.join(CHOICES)}")
    energies = isinstance(system, EnergySystem)
    if choice == "loops" and energies:
        raise LinkwiseError("--kernel loops goes over rigid bodies, and here are energies; leave it out")
    if choice == "loops" and derivation == "energy":
        raise LinkwiseError("--kernel loops derives nothing, and --derivation energy does; leave one out")
    if choice == "auto":
        energies |= derivation == "energy"
        closed = backends is not None and not set(backends) <= LOOPS.keys()
        return "straight" if energies or closed or results(system) <= MOST_STRAIGHT else "loops"
    return "loops" if choice == "loops" else "straight"


def results(system: System) -> int:
    """Values of c2, c1, g and tau of one sample, zeros by chance of geometry included."""
    lengths = [len(system.path(j)) for j in range(len(system.links))]
    return sum(d * (d + 1) // 2 + d * d + 2 * d for d in lengths)
