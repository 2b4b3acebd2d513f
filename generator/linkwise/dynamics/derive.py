"""Derivation of the closed forms of each link of a system."""

from operator import itemgetter
from typing import Literal

from linkwise_runtime.structure import GRAVITY, IMPOSED_MOTION

from linkwise.dynamics.euler_lagrange import ShareTerms, euler_lagrange
from linkwise.dynamics.frame_search import MAX_AXES, FrameSearch
from linkwise.dynamics.link_forms import LinkForms, lowering
from linkwise.errors import within
from linkwise.expression.expression import Expression
from linkwise.progress import Progress, silent
from linkwise.robot.robot import Scalar
from linkwise.symbolic.link_energy import lineage, link_energies
from linkwise.symbolic.system import EnergySystem, System, refuse_curves

Method = Literal["rule", "energy"]
"""Ways to the closed forms of rigid links: the rigid-link rule, or their SymPy energies."""


def link_forms(system: System, link: int, method: Method = "rule") -> LinkForms:
    """Return the closed forms of one link from its own path alone, whatever else the robot has.

    Energies that a user wrote are differentiated whatever the method. Raises LinkwiseError for joints
    that follow curves.
    """
    refuse_curves(system)
    with within(f"link {system.links[link].name!r}"):
        if isinstance(system, EnergySystem) or method == "energy":
            return _energy_forms(system, link)
        search = FrameSearch(system, link)
        _, axes, origin = min([*search.central(MAX_AXES), *search.framed(MAX_AXES)], key=itemgetter(0))
        return search.build(axes, origin)


def _energy_forms(system: System, link: int) -> LinkForms:
    """Return the closed forms of a link by Euler-Lagrange on the expression graph."""
    lower, x = lowering(system)

    def node(expr: Scalar) -> Expression:
        return Expression(lower.graph, lower(expr))

    if isinstance(system, EnergySystem):
        terms = system.links[link]
        shares = (
            ShareTerms(
                share.name,
                node(share.potential),
                node(share.motion),
                node(share.dissipation),
                {i: node(q) for i, q in share.forces.items()},
                share.name == IMPOSED_MOTION,
            )
            for share in terms.shares
        )
        time = None if system.time is None else node(system.time)
        return euler_lagrange(node(terms.kinetic), shares, system.path(link), x, True, terms.degree, time)
    energies = link_energies(system)
    for carrier in lineage(energies, link):
        lower.define(carrier.twist.definitions)
        lower.define(carrier.height.definitions)
    energy, nothing = energies[link], node(0.0)
    weight = ShareTerms(GRAVITY, node(energy.potential), nothing, nothing)
    return euler_lagrange(node(energy.kinetic), [weight], system.path(link), x, False)


def check_written(system: EnergySystem) -> None:
    """Raise LinkwiseError for a function that closed forms do not have, by the link or constraint with it."""
    lower, _ = lowering(system)
    for link in system.links:
        with within(f"link {link.name!r}"):
            for part in (link.kinetic, *(part for share in link.shares for part in share.parts())):
                lower(part)
    for one in system.constraints:
        with within(f"constraint {one.name!r}"):
            lower(one.expression)


def derive(system: System, progress: Progress = silent, method: Method = "rule") -> tuple[LinkForms, ...]:
    """Return the closed forms of every link, each on a graph of its own."""
    links = []
    for j in range(len(system.links)):
        progress("derive", j, len(system.links))
        with within(f"while deriving robot {system.name!r}"):
            links.append(link_forms(system, j, method))
    progress("derive", len(system.links), len(system.links))
    return tuple(links)
