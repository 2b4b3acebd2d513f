"""Choice of a package's kernel: straight lines of closed forms, or loops over links and joints."""

from collections.abc import Iterable, Iterator
from typing import get_args

from linkwise.dynamics.derive import Method
from linkwise.dynamics.frame_search import FrameSearch
from linkwise.dynamics.joint_chain import CommonAxes
from linkwise.dynamics.link_motion import Origin
from linkwise.emit.backend import (
    LOOPS,
    BackendFiles,
    backends_of,
    chosen_backends,
    refuse_unknown,
    usual_backends,
)
from linkwise.emit.c.loop_costs import decomposition_cost, link_costs
from linkwise.errors import LinkwiseError
from linkwise.package.entries import KernelKind
from linkwise.symbolic.system import EnergySystem, RigidSystem, System, refuse_curves

CHOICES = ("auto", "straight", "loops")

MOST_STRAIGHT = 12_000
"""Most operations for which closed forms are derived, as `closed_form_cost` estimates them:
docs/kernels.md."""

MOST_DERIVED = 50_000
"""Most operations, estimated alike, for which closed forms are worth minutes where loops cannot be had."""

LEAST_SHARE = 0.1
"""Closed forms of a large robot need more than this share of the operations of loops: planar arms 0.15.

Of links behind a single joint they need almost none.
"""


def chosen_kernel(
    system: System, choice: str, backends: Iterable[str] | None, derivation: str = "rule"
) -> KernelKind:
    """Return the kernel for one of CHOICES and the back ends asked for by name, None for all.

    Raises LinkwiseError for a choice that is not one, for an unknown back end, for loops over energies or for
    a derivation from them, and for closed forms of joints that follow curves, formulas among them.
    """
    if derivation not in get_args(Method):
        raise LinkwiseError(f"no derivation {derivation!r}; choose rule or energy")
    if choice not in CHOICES:
        raise LinkwiseError(f"no kernel {choice!r}; choose among {', '.join(CHOICES)}")
    if choice == "loops" and isinstance(system, EnergySystem):
        told = system.request.get("robot", system.name)
        raise LinkwiseError(
            f"{told}: --kernel loops goes over rigid bodies, and here are energies; leave it out"
        )
    if choice == "loops" and derivation == "energy":
        raise LinkwiseError("--kernel loops derives nothing, and --derivation energy does; leave one out")
    refuse_unknown(backends or ())
    closed = derivation == "energy" or (backends is not None and not set(backends) <= LOOPS.keys())
    if isinstance(system, RigidSystem) and system.curved:
        if choice == "straight" or closed:
            refuse_curves(system)
        return "loops"
    if choice != "auto":
        return "loops" if choice == "loops" else "straight"
    if closed or isinstance(system, EnergySystem):
        return "straight"
    cost = closed_form_cost(system)
    if cost > MOST_DERIVED:
        return "loops"
    kinds: tuple[KernelKind, ...] = ("straight", "loops") if cost <= MOST_STRAIGHT else ("loops", "straight")
    return next((kind for kind in kinds if not fault(system, kind, backends)), kinds[0])


def fault(system: System, kind: KernelKind, backends: Iterable[str] | None) -> str:
    """Return why a robot cannot have these back ends with this kernel; empty if it can."""
    return next((why for _, why in _faults(system, kind, backends)), "")


def _faults(
    system: System, kind: KernelKind, backends: Iterable[str] | None
) -> Iterator[tuple[BackendFiles, str]]:
    """Return those of these back ends that cannot be had, and why."""
    names = usual_backends(system, kind) if backends is None else backends
    return ((one, why) for one in chosen_backends(names, kind) if (why := one.fault(system)))


def check_size(system: System, kind: KernelKind, backends: Iterable[str] | None) -> None:
    """Raise LinkwiseError, which names another way, where these back ends cannot be had."""
    found = next(_faults(system, kind, backends), None)
    if found is None:
        return
    backend, why = found
    other: KernelKind = "loops" if kind == "straight" else "straight"
    possible = backend.name in backends_of(other) and (other == "loops" or _derivable(system))
    if possible and not fault(system, other, None):
        raise LinkwiseError(f"{why}; take --kernel {other}")
    raise LinkwiseError(f"{why}; take back ends without {backend.name}: --backend numpy, say")


def _derivable(system: System) -> bool:
    return isinstance(system, RigidSystem) and closed_form_cost(system) <= MOST_DERIVED


def closed_form_cost(system: RigidSystem) -> float:
    """Return the operations of the closed forms of all links, estimated from the link of median path length.

    Its operations are counted in one frame, about its centre of mass, and all others are assumed to save as
    much as it does of what loops would take: to derive them all would take the time that the choice may
    spare. No link is derived where even the sparsest would have too many.
    """
    loops, costs = decomposition_cost(system), link_costs(system)
    behind_more = sum(cost for link, cost in zip(system.links, costs, strict=True) if len(link.joints) > 1)
    least = LEAST_SHARE * loops * behind_more / sum(costs)
    if least > MOST_STRAIGHT:
        return least
    middle = sorted(range(len(system.links)), key=lambda j: len(system.path(j)))[len(system.links) // 2]
    axes = CommonAxes(len(system.links[middle].joints) // 2 + 1)
    counted, _, _ = FrameSearch(system, middle).attempt(axes, Origin())
    return loops * counted / costs[middle]
