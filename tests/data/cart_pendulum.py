"""A cart on a spring that carries a pendulum: link energies written by hand."""

import sympy as sp
from linkwise import Coordinate, LinkEnergy

x, theta = Coordinate("x", "m"), Coordinate("theta")
M, m, k, r, g = sp.symbols("M m k r g", real=True)

name = "cart_pendulum"
coordinates = [x, theta]
parameters = {M: 2.0, m: 0.3, k: 40.0, r: 0.5, g: 9.81}
bob_speed = (x.qd + r * theta.qd * sp.cos(theta.q)) ** 2 + (r * theta.qd * sp.sin(theta.q)) ** 2
links = [
    LinkEnergy("cart", M * x.qd**2 / 2, {"spring": k * x.q**2 / 2}),
    LinkEnergy("bob", m * bob_speed / 2, {"gravity": -m * g * r * sp.cos(theta.q)}),
]
