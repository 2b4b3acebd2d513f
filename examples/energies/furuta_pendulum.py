"""A Furuta pendulum: a motor turns an arm, from whose end a pendulum swings across; with friction.

Coulomb's friction is that of a smooth sign, and viscous friction stands beside it.
"""

import sympy as sp
from linkwise import Coordinate, LinkEnergy, Particle

phi, theta = Coordinate("phi"), Coordinate("theta")
J, m, R, r, g, mu, c, u = sp.symbols("J m R r g mu c u")
bob = [
    R * sp.cos(phi.q) - r * sp.sin(theta.q) * sp.sin(phi.q),
    R * sp.sin(phi.q) + r * sp.sin(theta.q) * sp.cos(phi.q),
    -r * sp.cos(theta.q),
]
slow = sp.Rational(1, 50)

name = "furuta_pendulum"
coordinates = [phi, theta]
links = [
    LinkEnergy(
        "arm",
        J * phi.qd**2 / 2,
        dissipation={"viscous": c * phi.qd**2 / 2},
        forces={"motor": {phi: u}, "dry": {phi: -mu * sp.tanh(phi.qd / slow)}},
    ),
    Particle("bob", m, bob, gravity=[0, 0, -g], dissipation={"hinge": c * theta.qd**2 / 20}),
]
parameters = {J: 0.004, m: 0.1, R: 0.2, r: 0.25, g: 9.81, mu: 0.01, c: 0.003}
inputs = [u]
