"""An arm on an elastic joint: a motor's rotor turns it through a gear and a spring, which loses a little.

The motor's torque acts on the rotor alone; what the arm feels is the spring.
"""

import sympy as sp
from linkwise import Coordinate, LinkEnergy

arm, motor = Coordinate("arm"), Coordinate("motor")
inertia, rotor, ratio, m, r, k, d, g, u = sp.symbols("I J n m r k d g u")
twist = motor.q / ratio - arm.q
twisting = motor.qd / ratio - arm.qd

name = "elastic_joint"
coordinates = [arm, motor]
links = [
    LinkEnergy("arm", inertia * arm.qd**2 / 2, {"gravity": -m * g * r * sp.cos(arm.q)}),
    LinkEnergy("rotor", rotor * motor.qd**2 / 2, forces={"motor": {motor: u}}),
    LinkEnergy("gear", potential={"spring": k * twist**2 / 2}, dissipation={"loss": d * twisting**2 / 2}),
]
parameters = {inertia: 0.12, rotor: 2e-5, ratio: 100.0, m: 1.5, r: 0.25, k: 80.0, d: 0.4, g: 9.81}
inputs = [u]
