"""A bead on a curved wire, with a spring along it and drag."""

from linkwise import Coordinate, LinkEnergy, Particle

x, y = Coordinate("x", "m"), Coordinate("y", "m")
name = "bead_on_wire"
coordinates = [x, y]
links = [
    Particle("bead", 0.2, [x.q, y.q], gravity=[0, -9.81], dissipation={"drag": 0.05 * (x.qd**2 + y.qd**2)}),
    LinkEnergy("spring", potential={"spring": 3 * x.q**2}),
]
constraints = {"wire": y.q - x.q**2 - x.q / 2}
independent = [x]
