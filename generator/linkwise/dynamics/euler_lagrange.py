"""D_i L_j by the explicit chain rule, for energies and forces of any kind (Eq. 5–12 of the paper).

With K the terms of the kinetic energy of degree two and more in the velocities, p_i = ∂K/∂q̇_i and, of each
share with a name of its own, a Lagrangian ℓ of degree one at most, a dissipation D and forces Q:

c2_ik = ∂p_i/∂q̇_k
h_i   = Σ_s ∂p_i/∂q_s q̇_s − ∂K/∂q_i
c1_ik = ∫₀¹ ∂h_i/∂q̇_k (q, σ q̇) dσ, so that Σ_k c1_ik q̇_k = h_i: each product of d velocities is owned in equal
        parts by its factors (Aumann and Shapley); for d = 2 half of ∂h_i/∂q̇_k
s_i   = Σ_s ∂²ℓ/∂q̇_i∂q_s q̇_s + ∂²ℓ/∂q̇_i∂t − ∂ℓ/∂q_i + ∂D/∂q̇_i − Q_i; of an imposed motion ∂p_i/∂t too
g_i   = Σ s_i
τ_i   = Σ_k c2_ik q̈_k + h_i + g_i
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from linkwise.dynamics.link_forms import Inputs, LinkForms, nodes
from linkwise.expression.differentiate import derivative, substitute
from linkwise.expression.expression import Expression


@dataclass(frozen=True)
class ShareTerms:
    """Terms of one share with a name; see `linkwise.symbolic.system.Share`."""

    name: str
    potential: Expression
    motion: Expression
    dissipation: Expression
    forces: Mapping[int, Expression] = field(default_factory=dict)
    takes_rate: bool = False
    """True if changes of the kinetic energy by time itself are its own."""


def euler_lagrange(
    kinetic: Expression,
    shares: Iterable[ShareTerms],
    path: tuple[int, ...],
    x: Inputs,
    by_hand: bool,
    degree: int = 2,
    time: Expression | None = None,
) -> LinkForms:
    """Return the closed forms of one link from its terms, over the coordinates of `path`.

    by_hand: the energies were written by hand, and are kept, with each share
    degree: of the kinetic energy in the velocities
    time: None where nothing depends on it
    """
    zero, shares = kinetic.number(0.0), tuple(shares)
    momentum = {i: derivative(kinetic, x.qd[i]) for i in path}
    c2 = {(i, k): derivative(momentum[i], x.qd[k]) for i in path for k in path if i <= k}
    h = {i: _along(momentum[i], path, x) - derivative(kinetic, x.q[i]) for i in path}
    c1 = {(i, k): owned(h[i], x.qd[k], path, x, degree) for i in path for k in path}
    lost = {(i, s.name): _unstored(s, i, path, x, time, momentum) for s in shares for i in path}
    named = {(i, s.name): lost[i, s.name] + derivative(s.potential, x.q[i]) for s in shares for i in path}
    gravity = {i: sum((named[i, s.name] for s in shares), zero) for i in path}
    inertial = {i: h[i] + sum((c2[min(i, k), max(i, k)] * x.qdd[k] for k in path), zero) for i in path}
    tau = {i: inertial[i] + gravity[i] for i in path}
    c0 = {(i, k): derivative(tau[i], x.q[k]) for i in path for k in path}
    excess = {}
    for i, k in c1:
        more = 2.0 * c1[i, k] - derivative(inertial[i], x.qd[k]) if degree > 2 else zero
        excess[i, k] = more - derivative(gravity[i], x.qd[k])
    if all(value.is_zero for value in excess.values()):
        excess = {}
    return LinkForms(
        kinetic.graph,
        x,
        path,
        frame=(),
        acceleration=nodes(c2),
        velocity=nodes(c1),
        gravity=nodes(gravity),
        torque=nodes(tau),
        decomposed_torque=nodes(tau),
        position_gradient=nodes(c0),
        velocity_excess=nodes(excess),
        shares=nodes(named) if by_hand else {},
        energy=nodes(_energies(kinetic, shares, lost, path, x, degree, time)) if by_hand else {},
    )


def owned(
    force: Expression, velocity: Expression, path: tuple[int, ...], x: Inputs, degree: int
) -> Expression:
    """Return ∫₀¹ ∂h/∂q̇_k (σ q̇) dσ of a polynomial h in the velocities; Gauss's points make it exact."""
    slope = derivative(force, velocity)
    if degree <= 2:
        return 0.5 * slope  # the slope is linear: the one point is at the half
    points, weights = np.polynomial.legendre.leggauss((degree + 1) // 2)
    total = force.number(0.0)
    for point, weight in zip((points + 1.0) / 2.0, weights / 2.0, strict=True):
        scaled = {x.qd[s]: force.number(float(point)) * x.qd[s] for s in path}
        total += force.number(float(weight)) * substitute(slope, scaled)
    return total


def _along(value: Expression, path: tuple[int, ...], x: Inputs) -> Expression:
    """Return Σ_s ∂value/∂q_s q̇_s."""
    return sum((derivative(value, x.q[s]) * x.qd[s] for s in path), value.number(0.0))


def _unstored(
    share: ShareTerms,
    i: int,
    path: tuple[int, ...],
    x: Inputs,
    time: Expression | None,
    momentum: Mapping[int, Expression],
) -> Expression:
    """Return s_i without the slope of its potential."""
    slope = derivative(share.motion, x.qd[i])
    force = _along(slope, path, x) - derivative(share.motion, x.q[i])
    if time is not None:
        force += derivative(slope, time)
        if share.takes_rate:
            force += derivative(momentum[i], time)
    force += derivative(share.dissipation, x.qd[i])
    return force - share.forces[i] if i in share.forces else force


def _energies(
    kinetic: Expression,
    shares: Iterable[ShareTerms],
    lost: Mapping[tuple[int, str], Expression],
    path: tuple[int, ...],
    x: Inputs,
    degree: int,
    time: Expression | None,
) -> dict[int, Expression]:
    """Return K, P and R: d(K + P)/dt = Σ_i τ_i q̇_i + R.

    K is Σ_i q̇_i p_i − K, which for a kinetic energy of degree two is that. R is the power of everything but
    the joints: of dissipation, of forces, and of what imposes a motion.
    """
    zero = kinetic.number(0.0)
    potential = sum((share.potential for share in shares), zero)
    stored = kinetic
    if degree > 2:
        stored = sum((derivative(kinetic, x.qd[i]) * x.qd[i] for i in path), zero) - kinetic
    power = -sum((x.qd[i] * force for (i, _), force in lost.items()), zero)
    if time is not None:
        power += derivative(potential, time) - derivative(kinetic, time)
        for i in path:
            power += x.qd[i] * derivative(derivative(kinetic, x.qd[i]), time)
    return {0: stored, 1: potential, 2: power}
