"""A puck on a table that turns at a constant rate: a moving base gives terms linear in the velocities."""

from linkwise import Coordinate, LinkEnergy

RATE, MASS = 1.7, 0.4

x, y = Coordinate("x", "m"), Coordinate("y", "m")
name = "turntable"
coordinates = [x, y]
speed = (x.qd - RATE * y.q) ** 2 + (y.qd + RATE * x.q) ** 2 + (1 + x.q**2) * y.qd**2
links = [LinkEnergy("puck", MASS * speed / 2, 0)]
