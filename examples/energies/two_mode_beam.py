"""A beam on a turning hub, by two assumed shapes of its bending: coordinates are deflections of the tip.

Shapes are (s/L)^2 and (s/L)^3 along the beam; kinetic energy and that of bending are integrals of them. As
the hub turns, the beam is softened: the deflection moves mass outwards.
"""

import sympy as sp
from linkwise import Coordinate, LinkEnergy

hub, first, second = Coordinate("hub"), Coordinate("first", "m"), Coordinate("second", "m")
J, rho, EI, L, c, s = sp.symbols("J rho EI L c s", positive=True)
shapes = [(s / L) ** 2, (s / L) ** 3]
bend = shapes[0] * first.q + shapes[1] * second.q
bending = shapes[0] * first.qd + shapes[1] * second.qd
# In axes that turn with the hub, a piece at (s, bend) has the velocity (-bend, s) hub' + (0, bending).
moving = sp.expand((bend * hub.qd) ** 2 + (s * hub.qd + bending) ** 2)
curvature = sp.diff(bend, s, 2)

name = "two_mode_beam"
coordinates = [hub, first, second]
links = [
    LinkEnergy("hub", J * hub.qd**2 / 2),
    LinkEnergy(
        "beam",
        sp.integrate(rho * moving / 2, (s, 0, L)),
        {"bending": sp.integrate(sp.expand(EI * curvature**2 / 2), (s, 0, L))},
        {"loss": c * (first.qd**2 + second.qd**2) / 2},
    ),
]
parameters = {J: 0.05, rho: 0.4, EI: 2.0, L: 0.8, c: 0.02}
