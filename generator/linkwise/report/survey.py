"""Every link's torques, expanded one link at a time within a budget of terms."""

from collections.abc import Iterator
from dataclasses import dataclass

import sympy as sp

from linkwise.errors import LinkwiseError, within
from linkwise.progress import Progress
from linkwise.report import laurent
from linkwise.report.count import FORM, TermCount, count_terms
from linkwise.report.expand import ROUNDING, Expansion, Variables
from linkwise.report.laurent import BudgetExceededError, ExponentError, Laurent
from linkwise.report.torque import Differentiation
from linkwise.symbolic.link_energy import StepwiseEnergy, link_energies
from linkwise.symbolic.system import RigidSystem, System


@dataclass(frozen=True)
class LinkTorques:
    """τ_ij of link j for the joints asked for; those off path(j) are missing: their torque is 0."""

    link: int
    torques: dict[int, Laurent]
    variables: Variables


def link_torques(
    system: System,
    joints: tuple[int, ...],
    budget: int,
    progress: Progress,
    links: int | None = None,
) -> Iterator[LinkTorques]:
    """Expand the first `links` links (None: all); raises BudgetExceededError at one too large."""
    rounding = 0.0 if is_exact(system) else ROUNDING
    expansion = Expansion(system.coordinates, budget, rounding)
    wanted = link_energies(system)[:links]
    for j, link in enumerate(wanted):
        with within(f"link {link.name!r}"):
            try:
                expansion.define((*link.twist.definitions, *link.height.definitions))
                torques = _torques(expansion, link, joints, system.path(j))
            except ExponentError as error:
                raise LinkwiseError(
                    f"a power above {laurent.LIMIT} is more than a term count can hold; lower it"
                ) from error
        if any(len(torque) > budget for torque in torques.values()):
            raise BudgetExceededError
        yield LinkTorques(j, torques, expansion.variables)
        progress("expand", j + 1, len(wanted))


def _torques(
    expansion: Expansion, link: StepwiseEnergy, joints: tuple[int, ...], path: tuple[int, ...]
) -> dict[int, Laurent]:
    """Torques of a link on those of the joints that move it, by joint."""
    chosen = [i for i in path if i in joints]
    if not chosen:
        return {}
    parts = expansion(link.kinetic), expansion(link.potential).scaled(-1)
    lagrangian = laurent.add(parts).pruned(expansion.rounding)
    by = Differentiation(expansion.coordinates, expansion.variables)
    return {i: by.torque(lagrangian, i, path).pruned(expansion.rounding) for i in chosen}


def is_exact(system: System) -> bool:
    """Whether no coefficient is rounded: rotations of 0 and ±1, no angle offsets, no irrational number."""
    links = system.robot.links if isinstance(system, RigidSystem) else ()
    straight = all(e in (-1.0, 0.0, 1.0) for link in links for row in link.joint.rotation for e in row)
    return straight and all(
        _is_rational(e.kinetic) and _is_rational(e.potential) for e in link_energies(system)
    )


def _is_rational(energy: sp.Expr) -> bool:
    waves, powers = energy.atoms(sp.sin, sp.cos), energy.atoms(sp.Pow)
    offsets = any(wave.args[0].as_coeff_Add()[0] != 0 for wave in waves)
    return not (offsets or energy.has(sp.NumberSymbol) or any(p.is_number for p in powers))


def form_of(system: System) -> str:
    """Name the canonical form that the counts of `system` are taken in."""
    rounded = f"fixed angles as decimals, coefficients below {ROUNDING:g} of the largest dropped"
    return f"{FORM}; {'coefficients exact' if is_exact(system) else rounded}"


class RunningCount:
    """Terms of Σ_j τ_ij while links are added; like terms of different links are collected."""

    def __init__(self, n: int) -> None:
        self.count = TermCount.none(n)
        self._parts: list[Laurent] = []
        self._keys: set[int] = set()

    def add(self, torque: Laurent, variables: Variables) -> TermCount:
        """Add one link's torque; returns its own count."""
        own = count_terms(torque, variables)
        if self._keys.isdisjoint(torque.terms):
            self._parts.append(torque)
            self.count += own
        else:
            self._parts = [laurent.add([*self._parts, torque])]
            self.count = count_terms(self._parts[0], variables)
        self._keys.update(torque.terms)
        return own
