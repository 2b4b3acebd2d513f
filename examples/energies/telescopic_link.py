"""A telescopic link: a mass slides on a swinging rod against a spring."""

import sympy as sp
from linkwise import Coordinate, Particle

theta, r = Coordinate("theta"), Coordinate("r", "m")
m, k, rest, g = sp.symbols("m k r0 g")

name = "telescopic_link"
coordinates = [theta, r]
links = [
    Particle(
        "slider",
        m,
        [r.q * sp.sin(theta.q), -r.q * sp.cos(theta.q)],
        gravity=[0, -g],
        potential={"spring": k * (r.q - rest) ** 2 / 2},
    )
]
parameters = {m: 0.6, k: 60.0, rest: 0.5, g: 9.81}
