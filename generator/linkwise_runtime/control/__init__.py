"""Partial impedance: torques under which a robot moves as if its shares of inertia were different ones."""
