"""D_i L_j by the explicit chain rule, for an energy of any kind (Eq. 5–12 of the paper).

τ_i  = Σ_s ∂²L/∂q̇_i∂q_s q̇_s + Σ_s ∂²L/∂q̇_i∂q̇_s q̈_s − ∂L/∂q_i
c2_ik = ∂²L/∂q̇_i∂q̇_k          g_i = −∂L/∂q_i at q̇ = 0
h_i  = Σ_s ∂²L/∂q̇_i∂q_s q̇_s − ∂L/∂q_i = h2 + h1 + g, of degree 2, 1 and 0 in q̇
c1_ik = ½ ∂h2_i/∂q̇_k + ∂h1_i/∂q̇_k = ½ (H + H₀), H = ∂h_i/∂q̇_k and H₀ = H at q̇ = 0.
H₀ is there where L has terms b(q)·q̇, with b = ∂L/∂q̇ at q̇ = 0, but is zero where b is the gradient of a
function of q.
"""

from linkwise.dynamics.coefficients import Inputs, LinkForms
from linkwise.expression.differentiate import derivative, substitute
from linkwise.expression.expression_graph import Graph, Node


def euler_lagrange(graph: Graph, lagrangian: Node, path: tuple[int, ...], x: Inputs) -> LinkForms:
    """Return the closed forms of one link from its Lagrangian alone, over the coordinates of `path`."""
    g = graph
    rest = {x.qd[s]: g.zero for s in path}
    momentum = {i: derivative(g, lagrangian, x.qd[i]) for i in path}
    force = {i: derivative(g, lagrangian, x.q[i]) for i in path}
    c2 = {(i, k): derivative(g, momentum[i], x.qd[k]) for i in path for k in path if i <= k}
    h = {
        i: g.sub(g.sum(g.mul(derivative(g, momentum[i], x.q[s]), x.qd[s]) for s in path), force[i])
        for i in path
    }
    leans = any(substitute(g, p, rest) != g.zero for p in momentum.values())
    c1, linear = {}, {}
    for i in path:
        for k in path:
            slope = derivative(g, h[i], x.qd[k])
            at_rest = substitute(g, slope, rest)
            c1[i, k] = g.mul(g.const(0.5), g.add(slope, at_rest))
            if leans:
                linear[i, k] = at_rest
    gravity = {i: substitute(g, h[i], rest) for i in path}
    tau = {i: g.add(h[i], g.sum(g.mul(c2[min(i, k), max(i, k)], x.qdd[k]) for k in path)) for i in path}
    c0 = {(i, k): derivative(g, tau[i], x.q[k]) for i in path for k in path}
    return LinkForms(path, c2, c1, gravity, tau, tau, c0, linear)
