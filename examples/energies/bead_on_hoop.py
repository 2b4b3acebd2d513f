"""A bead on a hoop that a motor turns about the vertical: the turning is imposed, and is a share of its own.

Above a rate of sqrt(g / R) the bead leaves the bottom.
"""

import sympy as sp
from linkwise import Particle
from sympy.physics.mechanics import dynamicsymbols

t = dynamicsymbols._t
theta = dynamicsymbols("theta")
m, R, omega, g, c = sp.symbols("m R omega g c")
place = [
    R * sp.sin(theta) * sp.cos(omega * t),
    R * sp.sin(theta) * sp.sin(omega * t),
    -R * sp.cos(theta),
]

name = "bead_on_hoop"
coordinates = {theta: "rad"}
links = [Particle("bead", m, place, gravity=[0, 0, -g], dissipation={"rubbing": c * theta.diff(t) ** 2 / 2})]
parameters = {m: 0.1, R: 0.5, omega: 6.0, g: 9.81, c: 0.002}
