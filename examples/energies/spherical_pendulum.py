"""A spherical pendulum: a bob on a rod, by its angle from below and its turn about the vertical."""

import sympy as sp
from linkwise import Coordinate, Particle

theta, phi = Coordinate("theta"), Coordinate("phi")
m, r, g = sp.symbols("m r g")
place = [
    r * sp.sin(theta.q) * sp.cos(phi.q),
    r * sp.sin(theta.q) * sp.sin(phi.q),
    -r * sp.cos(theta.q),
]

name = "spherical_pendulum"
coordinates = [theta, phi]
links = [Particle("bob", m, place, gravity=[0, 0, -g])]
parameters = {m: 0.5, r: 0.8, g: 9.81}
