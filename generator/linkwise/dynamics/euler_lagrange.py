"""D_i L_j by the explicit chain rule, for an energy of any kind (Eq. 5–12 of the paper).

τ_i  = Σ_s ∂²L/∂q̇_i∂q_s q̇_s + Σ_s ∂²L/∂q̇_i∂q̇_s q̈_s − ∂L/∂q_i
c2_ik = ∂²L/∂q̇_i∂q̇_k          g_i = −∂L/∂q_i at q̇ = 0
h_i  = Σ_s ∂²L/∂q̇_i∂q_s q̇_s − ∂L/∂q_i = h2 + h1 + g, of degree 2, 1 and 0 in q̇
c1_ik = ½ ∂h2_i/∂q̇_k + ∂h1_i/∂q̇_k = ½ (H + H₀), H = ∂h_i/∂q̇_k and H₀ = H at q̇ = 0.
H₀ is there where L has terms b(q)·q̇, with b = ∂L/∂q̇ at q̇ = 0, but is zero where b is the gradient of a
function of q.
"""

from linkwise.dynamics.link_forms import Inputs, LinkForms, nodes
from linkwise.expression.differentiate import derivative, substitute
from linkwise.expression.expression import Expression


def euler_lagrange(
    kinetic: Expression, potential: Expression, path: tuple[int, ...], x: Inputs, by_hand: bool
) -> LinkForms:
    """Return the closed forms of one link from its energies alone, over the coordinates of `path`.

    by_hand: the energies were written by hand, and are kept
    """
    lagrangian = kinetic - potential
    zero = lagrangian.number(0.0)
    rest = {x.qd[s]: zero for s in path}
    momentum = {i: derivative(lagrangian, x.qd[i]) for i in path}
    force = {i: derivative(lagrangian, x.q[i]) for i in path}
    c2 = {(i, k): derivative(momentum[i], x.qd[k]) for i in path for k in path if i <= k}
    h = {i: sum((derivative(momentum[i], x.q[s]) * x.qd[s] for s in path), zero) - force[i] for i in path}
    leans = any(not substitute(p, rest).is_zero for p in momentum.values())
    c1, linear = {}, {}
    for i in path:
        for k in path:
            slope = derivative(h[i], x.qd[k])
            at_rest = substitute(slope, rest)
            c1[i, k] = 0.5 * (slope + at_rest)
            if leans:
                linear[i, k] = at_rest
    gravity = {i: substitute(h[i], rest) for i in path}
    tau = {i: h[i] + sum((c2[min(i, k), max(i, k)] * x.qdd[k] for k in path), zero) for i in path}
    c0 = {(i, k): derivative(tau[i], x.q[k]) for i in path for k in path}
    return LinkForms(
        lagrangian.graph,
        x,
        path,
        frame=(),
        acceleration=nodes(c2),
        velocity=nodes(c1),
        gravity=nodes(gravity),
        torque=nodes(tau),
        decomposed_torque=nodes(tau),
        position_gradient=nodes(c0),
        velocity_linear=nodes(linear),
        energy=(kinetic.node, potential.node) if by_hand else (),
    )
