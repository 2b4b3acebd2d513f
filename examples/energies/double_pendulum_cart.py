"""A double pendulum on a cart: a force pushes the cart, a spring holds it, its bearing is damped.

Who loads whom is seen best here: what the lower bob does is borne by the upper rod, and pushes the cart.
"""

import sympy as sp
from linkwise import Coordinate, LinkEnergy, Particle

x, a, b = Coordinate("x", "m"), Coordinate("a"), Coordinate("b")
M, m, r, k, c, g, F = sp.symbols("M m r k c g F")
upper = [x.q + r * sp.sin(a.q), -r * sp.cos(a.q)]
lower = [upper[0] + r * sp.sin(b.q), upper[1] - r * sp.cos(b.q)]

name = "double_pendulum_cart"
coordinates = [x, a, b]
links = [
    LinkEnergy(
        "cart",
        kinetic=M * x.qd**2 / 2,
        potential={"spring": k * x.q**2 / 2},
        dissipation={"bearing": c * x.qd**2 / 2},
        forces={"push": {x: F}},
    ),
    Particle("upper", m, upper, gravity=[0, -g]),
    Particle("lower", m, lower, gravity=[0, -g]),
]
parameters = {M: 1.0, m: 0.2, r: 0.4, k: 5.0, c: 0.3, g: 9.81}
inputs = [F]
