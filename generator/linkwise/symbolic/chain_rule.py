"""D_i L_j in SymPy by the explicit chain rule: readable for a small robot, a reference for the rest.

D_i L = Σ_s ∂²L/∂q̇_i∂q_s q̇_s + Σ_s ∂²L/∂q̇_i∂q̇_s q̈_s + ∂²L/∂q̇_i∂t − ∂L/∂q_i
τ_i   = D_i L + ∂D/∂q̇_i − Q_i, with the dissipation D and the forces Q of links that were written by hand
"""

import sympy as sp

from linkwise.symbolic.link_energy import lineage, link_energies
from linkwise.symbolic.system import EnergySystem, System


def lagrangian(system: System, link: int) -> sp.Expr:
    """Return L_j with the named definitions written out; it grows with the chain: for small robots only."""
    if isinstance(system, EnergySystem):
        terms = system.links[link]
        return terms.kinetic + sp.Add(*(share.motion - share.potential for share in terms.shares))
    twist: dict[sp.Symbol, sp.Expr] = {}
    height: dict[sp.Symbol, sp.Expr] = {}
    energies = link_energies(system)
    for energy in lineage(energies, link):
        for known, steps in ((twist, energy.twist), (height, energy.height)):
            for symbol, expr in steps.definitions:
                known[symbol] = expr.xreplace(known)
    energy = energies[link]
    return energy.kinetic.xreplace(twist) - energy.potential.xreplace(height)


def partial_torques(system: System, link: int) -> dict[int, sp.Expr]:
    """Return τ_ij for every coordinate i on the path of link j, unsimplified."""
    value, path = lagrangian(system, link), system.path(link)
    c = system.coordinates
    shares = system.links[link].shares if isinstance(system, EnergySystem) else ()
    time = system.time if isinstance(system, EnergySystem) else None
    torques = {}
    for i in path:
        momentum = sp.diff(value, c[i].qd)
        rate = sum(sp.diff(momentum, c[s].q) * c[s].qd + sp.diff(momentum, c[s].qd) * c[s].qdd for s in path)
        if time is not None:
            rate += sp.diff(momentum, time)
        lost = sp.Add(*(sp.diff(share.dissipation, c[i].qd) for share in shares))
        given = sp.Add(*(share.forces.get(i, sp.S.Zero) for share in shares))
        torques[i] = rate - sp.diff(value, c[i].q) + lost - given
    return torques
