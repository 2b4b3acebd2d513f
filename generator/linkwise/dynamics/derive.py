"""Derivation of kernels from a system: the closed forms of each link."""

from operator import itemgetter
from typing import Literal

from linkwise.dynamics.euler_lagrange import euler_lagrange
from linkwise.dynamics.frame_search import MAX_AXES, FrameSearch
from linkwise.dynamics.kernel import Kernel, lowering, parameter_nodes
from linkwise.errors import within
from linkwise.progress import Progress, silent
from linkwise.symbolic.link_energy import lineage, link_energies
from linkwise.symbolic.system import EnergySystem, System, refuse_curves

Method = Literal["rule", "energy"]
"""Ways to the closed forms of rigid links: the rigid-link rule, or their SymPy energies."""


def link_kernel(system: System, link: int, method: Method = "rule") -> Kernel:
    """Return the closed forms of one link from its own path alone, whatever else the robot has.

    For energies that a user wrote, they are derived from these in any case. Raises LinkwiseError for joints
    that follow curves.
    """
    refuse_curves(system)
    with within(f"link {system.links[link].name!r}"):
        if isinstance(system, EnergySystem) or method == "energy":
            return _energy_kernel(system, link)
        rigid = system.links[link]
        tree = [(f - 1, joint) for f, joint in enumerate(rigid.joints)]
        search = FrameSearch(system, [link], tree, [range(len(tree))])
        _, axes, origin = min([*search.central(MAX_AXES), *search.framed(MAX_AXES)], key=itemgetter(0))
        return search.build(axes, origin)


def _energy_kernel(system: System, link: int) -> Kernel:
    """Return the closed forms of a link by Euler-Lagrange on the expression graph."""
    lower, x = lowering(system)
    energies = link_energies(system)
    for carrier in lineage(energies, link):
        lower.define(carrier.twist.definitions)
        lower.define(carrier.height.definitions)
    energy = energies[link]
    kinetic, potential = lower(energy.kinetic), lower(energy.potential)
    lagrangian = lower.graph.sub(kinetic, potential)
    forms = euler_lagrange(lower.graph, lagrangian, system.path(link), x)
    own = (kinetic, potential) if isinstance(system, EnergySystem) else ()
    return Kernel(lower.graph, x, parameter_nodes(system, lower), (forms,), (), own)


def derive(system: System, progress: Progress = silent, method: Method = "rule") -> tuple[Kernel, ...]:
    """Return one kernel per link: its closed forms on a graph."""
    kernels = []
    for j in range(len(system.links)):
        progress("derive", j, len(system.links))
        with within(f"while deriving robot {system.name!r}"):
            kernels.append(link_kernel(system, j, method))
    progress("derive", len(system.links), len(system.links))
    return tuple(kernels)
