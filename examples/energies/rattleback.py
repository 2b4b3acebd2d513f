"""A rattleback: half an ellipsoid, heavier askew to its axes, that spins one way and turns the other back.

It rolls without slipping; its lowest point, by which it touches the ground, wanders over it. Numbers are
those of Kane and Levinson, International Journal of Non-Linear Mechanics 17(3), 1982.
"""

import sympy as sp
from linkwise import RigidBody
from sympy.physics.mechanics import dynamicsymbols

t = dynamicsymbols._t
x, y, spin, pitch, roll = dynamicsymbols("x y spin pitch roll")
m, a, b, c, h, g, loss = sp.symbols("m a b c h g loss")
turn = sp.rot_axis3(-spin) * sp.rot_axis2(-pitch) * sp.rot_axis1(-roll)

# The ellipsoid's lowest point in its own axes, from its centre; the mass is h below that.
up = turn.T * sp.Matrix([0, 0, 1])
squares = sp.diag(a**2, b**2, c**2)
height = sp.sqrt((up.T * squares * up)[0])
lowest = -squares * up / height
below = sp.Matrix([0, 0, -h])
place = sp.Matrix([x, y, height + (turn * below)[2]])
# Its velocity is that of the mass, and of turning: of the material point, not of the place where it touches.
slips = place.diff(t) + turn.diff(t) * (lowest - below)

name = "rattleback"
coordinates = {x: "m", y: "m", spin: "rad", pitch: "rad", roll: "rad"}
links = [
    RigidBody(
        "rattleback",
        m,
        list(place),
        turn,
        [[0.0002, -0.00002, 0], [-0.00002, 0.0016, 0], [0, 0, 0.0017]],
        gravity=[0, 0, -g],
        dissipation={"air": loss * (spin.diff(t) ** 2 + pitch.diff(t) ** 2 + roll.diff(t) ** 2) / 2},
    )
]
constraints = {"no slip along x": slips[0], "no slip along y": slips[1]}
independent = [spin, pitch, roll]
parameters = {m: 1.0, a: 0.2, b: 0.03, c: 0.02, h: 0.01, g: 9.81, loss: 0.0001}
