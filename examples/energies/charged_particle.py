"""A charged particle in a magnetic field along z, and a weak electric one that holds it in the plane.

The potential of a magnet is linear in the velocity, -e A · v, and its force does no work.
"""

import sympy as sp
from linkwise import Coordinate, Particle

x, y, z = (Coordinate(name, "m") for name in "xyz")
m, e, B, k = sp.symbols("m e B k")
vector_potential = sp.Matrix([-B * y.q / 2, B * x.q / 2, 0])
velocity = sp.Matrix([x.qd, y.qd, z.qd])

name = "charged_particle"
coordinates = [x, y, z]
links = [
    Particle(
        "ion",
        m,
        [x.q, y.q, z.q],
        potential={
            "magnet": -e * vector_potential.dot(velocity),
            "trap": k * (2 * z.q**2 - x.q**2 - y.q**2) / 2,
        },
    )
]
parameters = {m: 0.02, e: 0.1, B: 1.5, k: 0.05}
