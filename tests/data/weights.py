"""Energies whose torques read little or nothing of the motion: weights that slide and one that only hangs."""

from linkwise import Coordinate, LinkEnergy

x, y = Coordinate("x", "m"), Coordinate("y", "m")
coordinates = [x, y]
links = [
    LinkEnergy("hanging", 0, 3 * x.q),
    LinkEnergy("sliding", 2 * x.qd**2, 0),
    LinkEnergy("pushed", y.qd**2, 2 * y.qd * x.q),
]
