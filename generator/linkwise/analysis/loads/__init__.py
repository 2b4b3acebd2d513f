"""External loads: forces and moments on bodies, constant or from logs, and the torques that they require."""

from linkwise.analysis.loads.given_loads import Load, Loads

__all__ = ["Load", "Loads"]
