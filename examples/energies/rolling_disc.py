"""A disc that rolls on the ground without slipping, as a coin does: two constraints of velocities.

It touches the ground at x, y, heads along yaw, leans, and turns about its own axis by spin.
"""

import sympy as sp
from linkwise import RigidBody
from sympy.physics.mechanics import dynamicsymbols

t = dynamicsymbols._t
x, y, yaw, lean, spin = dynamicsymbols("x y yaw lean spin")
m, R, g = sp.symbols("m R g")
standing = sp.rot_axis3(-yaw) * sp.rot_axis1(-lean)
centre = sp.Matrix([x, y, 0]) + R * standing * sp.Matrix([0, 0, 1])

name = "rolling_disc"
coordinates = {x: "m", y: "m", yaw: "rad", lean: "rad", spin: "rad"}
links = [
    RigidBody(
        "disc",
        m,
        list(centre),
        standing * sp.rot_axis2(-spin),
        [m * R**2 / 4, m * R**2 / 2, m * R**2 / 4],
        gravity=[0, 0, -g],
    )
]
constraints = {
    "forwards": sp.Eq(x.diff(t), R * spin.diff(t) * sp.cos(yaw)),
    "sideways": sp.Eq(y.diff(t), R * spin.diff(t) * sp.sin(yaw)),
}
independent = [yaw, lean, spin]
parameters = {m: 0.3, R: 0.15, g: 9.81}
