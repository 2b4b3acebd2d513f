"""Loads from outside: forces and moments on bodies, constant or from logs, and what they ask of joints."""

from linkwise.analysis.loads.given_loads import Load, Loads

__all__ = ["Load", "Loads"]
